"""An offset that wanders: how much by the sums of blocks, then by columns of its own.

A model has one offset for a flight.  A sensor's is not quite the same from minute to minute, and
blocks of the flight then contradict each other.  As flicker noise it is one number for each axis,
its instability: how likely the sums are for any of it has a closed form, with what wanders and
everything else integrated out.  It is asked of sums that are there, the offset's own columns
standing for it within a block, so that a flight without it costs nothing.  Twice the rise of that
logarithm is chi-square at the most (none is at the bound of each number: half of the flights gain
nothing at all; Self and Liang 1987).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.diagnosis.block_jumps import OFFSETS
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.final_model import FinalModel
from onboard.core.diagnosis.flight_constants import inconstant
from onboard.core.diagnosis.score import least, surprise
from onboard.core.diagnosis.settling import needed_beside, only
from onboard.core.estimate.limits import FEWEST_BLOCKS, OFFSET_FLOOR
from onboard.core.estimate.solution import share_of_gram
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block, total
from onboard.core.maths.flicker import waves, waves_variance
from onboard.core.maths.sums import NormalSums
from onboard.core.model.regressors import Model
from onboard.core.physics.effect import AXES, Effect, Origin
from onboard.core.physics.effects.offset_wander import PLAUSIBLE, OffsetWander

WAVES = 24
"""Cosines for each axis: a pass takes as long as one that looks for a jump [cost]."""
TRIED = OFFSET_FLOOR * 2.0 ** np.arange(0.0, np.log2(2.0 * PLAUSIBLE / OFFSET_FLOOR) + 0.25, 0.25)
"""m/s^2, of the instability: from what is nothing beside what no model knows, to what cannot be
[cost]."""
SWEEPS = 3
"""Over the axes: what one wanders hardly bears on another [cost]."""


@dataclass(frozen=True, slots=True)
class Told:
    """What sums say of amplitudes about nothing, everything else left free.

    Attributes:
        S: (n, n) information.
        s: (n,) that times what they ask for.
        axis: (n,) which axis each is of.
        variance: (n,) of each, of unit instability.
    """

    S: Array
    s: Array
    axis: Array
    variance: Array

    def likelier(self, instability: Array) -> float:
        """Rise of the logarithm of the likelihood by some instability (3,), m/s^2."""
        root = np.sqrt(self.variance) * instability[self.axis]
        on = root > 0.0
        if not np.any(on):
            return 0.0
        root = root[on]
        L = np.linalg.cholesky(np.eye(len(root)) + root[:, None] * self.S[np.ix_(on, on)] * root)
        x = np.linalg.solve(L, root * self.s[on])
        return float(0.5 * x @ x - np.sum(np.log(np.diagonal(L))))

    def likeliest(self) -> tuple[Array, float]:
        """(3,) of the instability, m/s^2, and by how much that is likelier than none."""
        best, most = np.zeros(3), 0.0
        for _ in range(SWEEPS):
            for axis in range(3):
                ways = np.tile(best, (len(TRIED) + 1, 1))
                ways[1:, axis], ways[0, axis] = TRIED, 0.0
                rise = [self.likelier(way) for way in ways]
                best, most = ways[int(np.argmax(rise))], max(rise)
        return best, most


@dataclass(frozen=True, slots=True)
class Wandering:
    """An offset that wanders: what it is, the model with it, what of the others is needed."""

    wander: OffsetWander
    made: Examination
    kept: list[Effect]
    settled: bool
    """Whether all that was chosen without it stands beside it, has a name, and is all there is."""


def wandering(
    full: Examination,
    families: Sequence[Effect],
    final: Examination,
    origin: Origin,
    parameters: ParametersInForce,
) -> Wandering | None:
    """An offset that wanders beside the model that stands; None where that may be chance.

    None either where a constant of the flight is none: what makes up for that wanders, too.

    Args:
        full: with every column of the catalogue.
        families: of the model that stands.
        final: that model.
        origin: what effects count from.
        parameters: in force.
    """
    blocks = final.all_blocks
    starts = np.array([b.start for b in blocks])
    if len(blocks) < FEWEST_BLOCKS or np.any(np.diff(starts) <= 0.0):
        return None  # where a clock begins anew nothing goes on
    start, end = blocks[0].start, blocks[-1].end
    instability_s, gain = by_blocks(blocks, final.model, final.found().nis).likeliest()
    if not _believed(instability_s, gain):
        return None
    if any(c.contradicts for c in inconstant(FinalModel(final, families, origin, parameters))):
        return None
    R_bs = final.batches[0].segment.R_bs
    wander = OffsetWander(origin).along(start, end, np.abs(R_bs) @ instability_s, WAVES)
    made, _ = only(full, [*families, wander], final)
    instability_b, gain = by_columns(made, wander).likeliest()
    if not _believed(instability_b, gain):
        return None
    wander = wander.along(start, end, instability_b, WAVES)
    made, _ = only(full, [*families, wander], made)
    # What wanders may have passed for something that has a name.
    kept = needed_beside(made, families)
    dropped = len(kept) < len(families)
    if dropped:
        made, _ = only(full, [*kept, wander], made)
    left = made.found().contradicts or any(not f.named for f in kept)
    return Wandering(wander, made, kept, settled=not (dropped or left))


def still_wanders(made: Examination, wander: OffsetWander) -> bool:
    """Whether it is no chance beside what was chosen with it."""
    of = wander.instability_b
    return _believed(of, by_columns(made, wander).likelier(of))


def by_blocks(blocks: Sequence[Block], model: Model, nis: float) -> Told:
    """What sums of blocks say of a wander of the offsets along sensor axes.

    Args:
        blocks: of a flight, in order of time.
        model: of the sums, the six first.
        nis: mean square of what its estimate leaves.
    """
    start, end = blocks[0].start, blocks[-1].end
    whole = total(blocks)
    share = _share(whole, model)
    middle = np.array([0.5 * (block.start + block.end) for block in blocks])
    wave = waves(middle, start, end, WAVES)
    own, cross, asked = [], [], []
    for block in blocks:
        sums = block.sums
        signal = sums.N - share * sums.G
        own.append(signal[np.ix_(OFFSETS, OFFSETS)])
        cross.append(signal[:, OFFSETS])
        asked.append(sums.b[list(OFFSETS)])
    m, n = model.size, 3 * WAVES
    N, b = np.zeros((m + n, m + n)), np.zeros(m + n)
    N[:m, :m], b[:m] = whole.N - share * whole.G, whole.b
    N[:m, m:] = np.einsum("bmi,bk->mki", cross, wave).reshape(m, n)
    N[m:, :m] = N[:m, m:].T
    N[m:, m:] = np.einsum("bij,bk,bl->kilj", own, wave, wave, optimize=True).reshape(n, n)
    b[m:] = np.einsum("bi,bk->ki", asked, wave).ravel()
    return _left(N, b, model, list(range(m)), nis, np.tile(np.arange(3), WAVES))


def by_columns(made: Examination, wander: OffsetWander) -> Told:
    """What the sums of an examination say of a wander that has columns in it, along body axes."""
    mine = made.indices(wander)
    others = [i for i in range(made.model.size) if i not in set(mine)]
    at = [*others, *mine]
    sums = total(made.all_blocks)
    N = (sums.N - _share(sums, made.model) * sums.G)[np.ix_(at, at)]
    axis = np.tile([AXES.index(a) for a in wander.keys], wander.count)
    return _left(N, sums.b[at], made.model, others, made.found().nis, axis)


def _share(sums: NormalSums, model: Model) -> float:
    """Of the noise in the regressors, as solutions take it off."""
    return share_of_gram(sums, np.diag(model.prior_sigma**-2.0))


def _left(N: Array, b: Array, model: Model, others: Sequence[int], nis: float, axis: Array) -> Told:
    """What is left of sums for amplitudes, everything else eliminated.

    Args:
        N: of the others first, then of the amplitudes, wave by wave.
        b: likewise.
        model: has the prior of the others.
        others: their places in it.
        nis: noise is no less than what an estimate leaves.
        axis: which each amplitude is of.
    """
    m, at = len(others), list(others)
    prior = model.prior_sigma[at] ** -2.0
    A = N[:m, :m] + np.diag(prior)
    gone = np.linalg.solve(A, np.column_stack([N[:m, m:], b[:m] + prior * model.prior[at]]))
    S = N[m:, m:] - N[m:, :m] @ gone[:, :-1]
    s = b[m:] - N[m:, :m] @ gone[:, -1]
    noise = max(1.0, nis)
    variance = np.repeat(waves_variance(WAVES), len(axis) // WAVES)
    return Told((S + S.T) / (2.0 * noise), s / noise, axis, variance)


def _believed(instability: Array, gain: float) -> bool:
    """Whether it is no chance, and no more than a sensor's can be."""
    return surprise(2.0 * gain, 3) >= least() and bool(np.all(instability <= PLAUSIBLE))
