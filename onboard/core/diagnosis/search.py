"""Physics without a name: products of measured signals, where the catalogue does not suffice.

A product is taken when it explains a residual that is not noise, or when it explains *instead* of
an effect of the catalogue clearly more than that one does: an effect that merely resembles what
acts must not lend it its name.  The number of products that are tried is charged for.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.diagnosis.candidates import Candidate, accepted
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.jumps import candidate_of
from onboard.core.diagnosis.limits import CLEARLY, LOST
from onboard.core.diagnosis.selection import Fitter
from onboard.core.estimate.solution import by_chance
from onboard.core.physics.effect import Effect, Origin
from onboard.core.physics.effects.empirical import products


def searched(final: Examination, families: Sequence[Effect]) -> list[Effect]:
    """The families, with a product added or put in the place of an impostor.

    Args:
        final: the model that was chosen.
        families: its physics.
    """
    named = [f for f in families if f.onset is None]
    contradicting = final.found().variance_inflation > by_chance(np.array(len(final.all_blocks)))
    if not named and not contradicting:
        return list(families)
    terms = products(final.batches, Origin(final.point.skew_from))
    t0 = final.point.skew_from
    made = Examination(final, [*families, *terms], t0=t0, start=final, traced=False)
    made.once()
    fitter = Fitter(made.all_blocks, made.model, made.absent)
    ours = set(made.indices_of([*families, *terms]))
    base = [i for i in range(made.model.size) if i not in ours]
    offered = [
        Candidate(t.effect, tuple(made.indices(t)), t.plausible, t, places=len(terms))
        for t in terms
    ]
    kept = list(families)
    for family in named:
        rest = base + made.indices_of([f for f in kept if f is not family])
        own = candidate_of(made, family)
        before = fitter.fit(rest)
        with_it = fitter.fit([*rest, *own.index], held_out=False)
        mine = own.common_score(fitter, before, with_it)
        best = _best(fitter, rest, offered)
        if best is not None and best[0] > mine * (1.0 + LOST) + CLEARLY:
            kept = [f for f in kept if f is not family]
            if best[1] not in kept:
                kept.append(best[1])
    if contradicting and kept == list(families):
        best = _best(fitter, base + made.indices_of(kept), offered)
        if best is not None:
            kept.append(best[1])
    return kept


def _best(
    fitter: Fitter, rest: Sequence[int], offered: Sequence[Candidate]
) -> tuple[float, Effect] | None:
    """The acceptable product with the highest score: that, and its columns."""
    before = fitter.fit(rest)
    best: tuple[float, Effect] | None = None
    for c in offered:
        if c.columns is None or set(c.index) & set(rest):
            continue
        after = fitter.fit([*rest, *c.index])
        score = c.common_score(fitter, before, after)
        if accepted(fitter, before, after, c) and (best is None or score > best[0]):
            best = score, c.columns
    return best
