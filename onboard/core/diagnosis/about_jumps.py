"""A choice of effects once more on sums about the jumps that were found.

What is chosen is chosen on sums about a flight without jumps.  One of a third of gravity bends
these: the attitude turns another force, and effects that are not there explain a part of what that
leaves.  The model that stands is about its jumps; what may be right beside it, or in the place of
one of its effects, has to be asked about them, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.hypotheses import Choice
from onboard.core.diagnosis.jumps import candidates_of
from onboard.core.diagnosis.selection import Fitter
from onboard.core.physics.effect import Effect


def about_jumps(
    full: Examination, choice: Choice, final: Examination, families: Sequence[Effect]
) -> Choice:
    """What a model has and what else there could be, by sums about its jumps.

    Args:
        full: with every column, whose sums were chosen from.
        choice: made on these.
        final: the model that stands.
        families: its effects.

    Returns:
        The choice as it is, if it has no jump, or its sums said of the six what the model says.
    """
    if all(f.taken_off is None or f.onset is None for f in families) or not _moved(choice, final):
        return choice
    own = {f.name: f for f in families}
    every = [own.pop(f.name, f) for f in full.families if isinstance(f, Effect)]
    every += own.values()
    t0 = full.point.skew_from
    made = Examination(full, every, t0=t0, start=final).with_rows().doubting()
    effects = set(made.indices_of(every))
    candidates = [c for f in every for c in candidates_of(made, f)]
    return replace(
        choice,
        fitter=Fitter(made.all_blocks, made.model, made.absent),
        base=[i for i in range(made.model.size) if i not in effects],
        candidates=candidates,
        chosen=[c for c in candidates if c.columns in families],
    )


def _moved(choice: Choice, final: Examination) -> bool:
    """Whether the six are another answer in the model that stands: by a sigma of it.

    Sums that are not bent say where it will be.
    """
    found = final.found()
    said = choice.fitter.fit(choice.free, held_out=False).theta[:6]
    off = found.theta[:6] - said
    return float(off @ np.linalg.solve(found.covariance[:6, :6], off)) > 1.0
