"""An effect on trial: what it costs, and what makes it acceptable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onboard.core.diagnosis.limits import (
    CHANCE,
    HELD_OUT_GAIN,
    MARGIN,
    MATTERS_HELD_OUT,
    MATTERS_OFFSET,
    MATTERS_SCALE,
    SIGNIFICANT,
    USED,
)
from onboard.core.diagnosis.selection import Fit, Fitter
from onboard.core.physics.effect import Effect


@dataclass(frozen=True, slots=True)
class Candidate:
    """Columns that stand for one effect; ``columns`` is None for a jump at a block's start.

    ``index`` has the sizes first, as many as are ``plausible``; what follows are its shapes.
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

    @property
    def sizes(self) -> list[int]:
        """Columns of the sizes, without the shapes."""
        return list(self.index[: len(self.plausible)])

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
    value = after.theta[c.sizes] - fitter.absent[c.sizes]
    sigma = np.sqrt(np.diag(after.covariance)[c.sizes])
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
