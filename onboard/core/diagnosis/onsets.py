"""Sums with a column for what begins at a moment, many moments in one pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from operator import add

import numpy as np

from onboard.core.diagnosis.block_jumps import OFFSETS
from onboard.core.diagnosis.effort import FORGOTTEN_S
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.selection import Fit, Fitter
from onboard.core.diagnosis.shocks import Shock
from onboard.core.diagnosis.stepped import places_of
from onboard.core.estimate.engine import Engine
from onboard.core.maths.blocks import Block, total
from onboard.core.maths.sums import NormalSums
from onboard.core.model.regressors import Family, Model
from onboard.core.physics.effect import Effect
from onboard.core.physics.effects.bias_step import BiasStep


def gains(
    full: Examination, chosen: Sequence[Effect], steps: Sequence[BiasStep | Shock]
) -> list[float]:
    """Gain of each jump alone beside the chosen effects."""
    fitter, before, fits = fitted(full, chosen, steps)
    return [fitter.gain(before, after) for _, after in fits]


def fitted(
    full: Examination,
    chosen: Sequence[Effect],
    steps: Sequence[BiasStep | Shock],
) -> tuple[Fitter, Fit, list[tuple[list[int], Fit]]]:
    """Fits without jumps, and with each of them alone; from one pass with all of them.

    Only the flight around the jumps is gone through.  Further away a jump is nothing before it, and
    the offsets' own columns after it, of which ``full`` has the sums; a shock is forgotten.

    Args:
        full: the flight.
        chosen: effects beside the jumps.
        steps: the jumps.

    Returns:
        Sums with a column for each; the fit without; columns of each jump, and the fit with it.
    """
    families: tuple[Family, ...] = (*chosen, *full.carried, *steps)
    made = Engine(
        replace(full.settings, refine=False), full.prior, full.point, full.noise, more=families
    )
    moments = [s.moment for s in steps]
    first, last = min(moments) - FORGOTTEN_S, max(moments) + FORGOTTEN_S
    early, late = [], []
    for batch, block in zip(full.batches, full.blocks, strict=True):
        if batch.fixes.t[-1] < first:
            early.append(block)
        elif batch.fixes.t[0] > last:
            late.append(block)
        else:
            made.batches.append(batch)
    made.once()
    sums = [total(made.blocks)] if made.blocks else []
    for blocks, after in ((early, False), (late, True)):
        if blocks:
            sums.append(_with_jumps(total(blocks), full, made.model, steps, after=after))
    absent = np.zeros(made.model.size)
    if "clock_rate" in made.model.index:
        absent[made.model.index["clock_rate"]] = -made.point.skew
    whole = Block(full.blocks[0].start, full.blocks[-1].end, reduce(add, sums))
    fitter = Fitter([whole], made.model, absent)
    places = range(made.model.size)
    columns = [list(places[made.model.slices[s.name]]) for s in steps]
    stepped = {i for index in columns for i in index}
    free = [i for i in places if i not in stepped]
    before = fitter.fit(free, held_out=False)
    fits = [(index, fitter.fit([*free, *index], held_out=False)) for index in columns]
    return fitter, before, fits


def _with_jumps(
    far: NormalSums,
    full: Examination,
    model: Model,
    steps: Sequence[BiasStep | Shock],
    *,
    after: bool,
) -> NormalSums:
    """Sums of ``model`` from those of ``full`` over flight before every jump, or after it."""
    source, sign = places_of(full, model), np.ones(model.size)
    if after:
        for step in (s for s in steps if not isinstance(s, Shock)):
            # What the sensor reads too much; the offsets' columns are what is added to it.
            source[model.slices[step.name]], sign[model.slices[step.name]] = OFFSETS, -1.0
    mine = np.flatnonzero(source >= 0)
    to, of = np.ix_(mine, mine), np.ix_(source[mine], source[mine])
    signs = np.outer(sign[mine], sign[mine])
    sums = NormalSums.zeros(model.size)
    sums.N[to] = signs * far.N[of]
    sums.G[to] = signs * far.G[of]
    sums.b[mine] = sign[mine] * far.b[source[mine]]
    sums.s, sums.rows, sums.log_det = far.s, far.rows, far.log_det
    if after:
        # Offsets are along the sensor's axes, jumps along the body's.
        R_bs = full.batches[0].segment.R_bs
        for at in (model.slices[s.name] for s in steps if not isinstance(s, Shock)):
            sums.N[at] = R_bs @ sums.N[at]
            sums.N[:, at] = sums.N[:, at] @ R_bs.T
            sums.b[at] = R_bs @ sums.b[at]
    return sums
