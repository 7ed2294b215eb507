"""When the offsets jumped: to the half second, from one pass with a jump at every moment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onboard.core.choice import Candidate
from onboard.core.columns import Family
from onboard.core.engine import Engine
from onboard.core.examination import Examination
from onboard.core.physics.effect import EffectColumns
from onboard.core.physics.offsets import BiasStep
from onboard.core.selection import Fitter

REACH_S = 16.0
"""How far from the boundary of a portion a jump may have been that shows there."""
SPACINGS = ((2.0, REACH_S), (0.5, 3.0))


def jump_near(
    full: Examination, chosen: Sequence[EffectColumns], centre: float, weaken: float
) -> BiasStep | None:
    """The jump near ``centre`` (s) that explains most beside ``chosen``; None without a flight."""
    best: BiasStep | None = None
    for spacing, width in SPACINGS:
        times = np.arange(centre - width, centre + width + 1e-6, spacing)
        steps = [BiasStep(float(t)) for t in times]
        scored = _scored(full, chosen, steps, weaken)
        if not scored:
            return None
        best = max(scored, key=lambda x: x[0])[1]
        centre = best.at
    return best


def _scored(
    full: Examination, chosen: Sequence[EffectColumns], steps: Sequence[BiasStep], weaken: float
) -> list[tuple[float, BiasStep]]:
    """Gain of each jump alone beside the chosen effects, from one pass with all of them."""
    families: tuple[Family, ...] = (*chosen, *steps)
    made = Engine(
        replace(full.settings, refine=False), full.prior, full.point, full.noise, more=families
    )
    for chunk in full.chunks:
        made.add(chunk)
    if not made.all_portions:
        return []
    absent = np.zeros(made.model.size)
    if "clock_rate" in made.model.index:
        absent[made.model.index["clock_rate"]] = -made.point.skew
    fitter = Fitter(made.all_portions, made.model, weaken, absent)
    slices = made.model.slices
    stepped = {i for s in steps for i in range(slices[s.name].start, slices[s.name].stop)}
    free = [i for i in range(made.model.size) if i not in stepped]
    before = fitter.fit(free, held_out=False)
    out = []
    for s in steps:
        index = [*free, *range(slices[s.name].start, slices[s.name].stop)]
        out.append((fitter.gain(before, fitter.fit(index, held_out=False)), s))
    return out


def boundary_of(fitter: Fitter, portion: int) -> float:
    """When a portion starts, s on the boot clock."""
    return float(fitter.portions[portion].start)


def candidate_of(made: Examination, family: EffectColumns) -> Candidate:
    """A family of an examination as a candidate."""
    spent = 1 if isinstance(family, BiasStep) else 0
    return Candidate(
        family.effect, tuple(made.indices(family)), family.plausible, family, spent=spent
    )
