"""An effect on trial: what it costs, and what makes it acceptable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onboard.core.diagnosis.selection import Fit, Fitter
from onboard.core.physics.effect import Effect

MARGIN = 25.0
"""Fall of chi-square beyond BIC's own penalty: a false discovery is worse than a miss."""
HELD_OUT_GAIN = 12.0
SECOND_ORDER = 5e-3
"""Share of the evidence of what was found that columns linear in it may have left over."""
SIGNIFICANT = 5.0
CONTRADICTING, RECONCILED = 3.0, 0.35
"""Inflation of the variance from which blocks contradict each other; what share is agreement."""
FAIR = 10.0
"""Fall of BIC that is enough for an effect which makes blocks agree."""
MATTERS_SCALE, MATTERS_OFFSET, MATTERS_HELD_OUT = 0.005, 0.02, 0.03
MOST_EFFECTS = 5
LEAST_BLOCKS = 4
"""Blocks of a flight among which a jump can be looked for."""
RIVAL_SHARE = 0.15
"""Least share of an effect's evidence that makes another one its confounder."""
LEFT_BESIDE = 0.5
"""A confounder explains the same: beside the effect less than this share of its gain is left."""
USED = 4.0
"""Sigmas from which an unknown of several counts as used."""
CHANCE = 4.0
"""What an unknown that is not used gains by chance, 19 times of 20."""
STILL = 0.8
"""Share of its least size that a timing error must keep whatever else is in the model."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """Columns that stand for one effect; ``columns`` is None for a jump at a block's start.

    ``spent`` are unknowns that were chosen outside the fit (a jump's moment), ``unseen`` the share
    of the columns' own variance that happens between the samples they are made of.  ``jump`` is
    True for a jump of the offsets at one moment.
    """

    effect: str
    index: tuple[int, ...]
    plausible: tuple[float, ...]
    columns: Effect | None = None
    spent: int = 0
    unseen: float = 0.0
    jump: bool = False

    def bic(self, fitter: Fitter, before: Fit, after: Fit) -> float:
        """Fall of BIC from ``before`` to ``after``, the fit with the effect in.

        An unknown that stays at nothing (one axis of three) is not a reason for the effect, and
        pays only for what it may gain by chance.
        """
        index = list(self.index)
        sigma = np.sqrt(np.diag(after.covariance)[index])
        used = int(np.sum(np.abs(after.theta[index] - fitter.absent[index]) > USED * sigma))
        used = max(used, 1)
        cost = (used + self.spent) * fitter.log_rows + CHANCE * (len(index) - used)
        return fitter.gain(before, after) - cost


def accepted(fitter: Fitter, before: Fit, after: Fit, c: Candidate, bic: float) -> bool:
    """Whether an effect has the evidence, and is convincing besides."""
    return bic >= MARGIN and convincing(fitter, before, after, c)


def convincing(fitter: Fitter, before: Fit, after: Fit, c: Candidate) -> bool:
    """Whether an effect is significant, holds on other data, is believable and matters."""
    if fitter.held_gain(before, after) < HELD_OUT_GAIN:
        return False
    index = list(c.index)
    value = after.theta[index] - fitter.absent[index]
    sigma = np.sqrt(np.diag(after.covariance)[index])
    if np.max(np.abs(value) / sigma) < SIGNIFICANT:
        return False
    if np.any(np.abs(value) - sigma > np.array(c.plausible)):
        return False
    if c.jump and np.max(np.abs(value)) > MATTERS_OFFSET:
        # What is learned over the whole flight lies in between, and nearer to both.
        return True
    return _matters(fitter, before, after)


def _matters(fitter: Fitter, before: Fit, after: Fit) -> bool:
    six0, six1 = before.theta[:6], after.theta[:6]
    moved_scale = float(np.max(np.abs(six1[:3] - six0[:3])))
    offset0, offset1 = -six0[3:] / six0[:3], -six1[3:] / six1[:3]
    moved_offset = float(np.max(np.abs(offset1 - offset0)))
    held0, held1 = fitter.held_rms(before), fitter.held_rms(after)
    return (
        moved_scale > MATTERS_SCALE
        or moved_offset > MATTERS_OFFSET
        or held1 < (1.0 - MATTERS_HELD_OUT) * held0
    )
