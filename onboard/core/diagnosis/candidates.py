"""An effect on trial: its score, and what makes it acceptable besides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from onboard.core.diagnosis.limits import (
    CLEARLY,
    MATTERS_HELD_OUT,
    MATTERS_OFFSET,
    MATTERS_SCALE,
)
from onboard.core.diagnosis.score import least, needed, surprise
from onboard.core.diagnosis.selection import Fit, Fitter, Gain
from onboard.core.estimate.limits import BEYOND
from onboard.core.maths.arrays import Array
from onboard.core.physics.effect import Effect
from onboard.core.physics.effects.bias_step import Witness


@dataclass(frozen=True, slots=True)
class Candidate:
    """Columns that stand for one effect; ``columns`` is None for a jump at a block's start.

    ``index`` has the sizes first, as many as are ``plausible``; what follows are its shapes.
    ``places`` is at how many it was looked for (a jump's moments).  ``jump`` is True for a jump of
    the offsets at one moment, or of the scales, that matters from ``worth`` on; other
    accelerometers may have been ``witness`` of it.  ``room_for``
    are effects that it is when some of its unknowns are told by the others.  Of two jumps the
    ``rare`` one is taken where it is clearly likelier.  At the force that was ``felt`` (3,), m/s^2,
    on average since then, it is the jump of the offset that they have seen.  No size of what is
    ``positive`` can be negative; what it is then may be an unknown of every model (``mirrored``).
    """

    effect: str
    index: tuple[int, ...]
    plausible: tuple[float, ...]
    columns: Effect | None = None
    places: float = 1.0
    jump: bool = False
    worth: float = MATTERS_OFFSET
    rare: bool = False
    witness: Witness | None = None
    felt: Array | None = None
    room_for: tuple[str, ...] = ()
    positive: bool = False
    mirrored: tuple[str, ...] = ()

    def new_beside(self, columns: Sequence[int]) -> bool:
        """Whether none of its columns is among those: no simpler form of it is in."""
        return not set(self.index) & set(columns)

    @property
    def sizes(self) -> list[int]:
        """Columns of the sizes, without the shapes."""
        return list(self.index[: len(self.plausible)])

    def score(self, fitter: Fitter, before: Fit, after: Fit) -> float:
        """How surprising by chance what ``after``, the fit with the effect in, explains more.

        Where both have been tried on flight that they were not fitted to, it is no more evidence
        than what it explains there.  An unknown that is not needed costs as much there as it
        brings in the fit, so twice the variance is given back for each (Akaike 1974, Stone 1977).
        """
        unknowns, gain = len(self.index), self._gain(fitter, before, after)
        if self.witness is None:
            return surprise(gain.fall, unknowns, self.places, gain.variance, gain.freedom)
        seen = self.witness.gain - self._unseen(fitter, after, self.witness)
        return surprise(seen + gain.weakened, unknowns, self.witness.places)

    def common_score(self, fitter: Fitter, before: Fit, after: Fit) -> float:
        """The score in units of one variance, that of the flight: to compare it with rivals.

        A score is of the scatter along an effect's own columns, and of how well that is known.
        That is right for whether it is there.  Of what is there beyond doubt, scores then differ
        by their scatter more than by what the flight says of the two, which is how much more one
        explains of it, and with how many unknowns.  What others have seen counts with it.
        """
        gain, k = fitter.gain(before, after) / max(fitter.pool.variance, 1.0), len(self.index)
        if self.witness is None:
            return surprise(gain, k, self.places)
        gain += self.witness.gain - self._unseen(fitter, after, self.witness)
        return surprise(gain, k, self.witness.places)

    def merit(self, fitter: Fitter, before: Fit, after: Fit) -> float:
        """The same, of what cannot be by as much as it is clearly more than of what can."""
        score = self.common_score(fitter, before, after)
        return score if possible(fitter, after, self) else score - CLEARLY

    def margin(self, fitter: Fitter, before: Fit, after: Fit) -> float:
        """By how much a jump is rather one of this accelerometer than of another one.

        Without a witness there is nobody else.  With one, the size is told, so it is one model
        against another without any unknown: what GPS explains by it, or contradicts, and what the
        others say of each other.
        """
        if self.witness is None:
            return inf
        against = self._unseen(fitter, after, self.witness)
        return self._gain(fitter, before, after).weakened + self.witness.blame - against

    def _unseen(self, fitter: Fitter, after: Fit, witness: Witness) -> float:
        """What others say against the size that ``after`` has.

        They have seen a jump of the offset, whose size is what is expected of one.  One of the
        scale is as much at the force that was felt, and is nothing that they have seen where it
        is another one: least of all where it is none.
        """
        if self.felt is None:
            return 0.0
        size = (after.theta[self.sizes] - fitter.absent[self.sizes]) * self.felt
        return witness.against(size)

    def _gain(self, fitter: Fitter, before: Fit, after: Fit) -> Gain:
        gain = fitter.gain_by(self.index, before, after)
        there = fitter.held_gain(before, after) + 2.0 * len(self.index) * max(gain.variance, 1.0)
        return gain if np.isnan(there) else replace(gain, fall=min(gain.fall, there))


def smallest(fitter: Fitter, fit: Fit, c: Candidate) -> Array:
    """Sizes (k,) of an effect from which each, alone, would count as found beside a fit.

    Expected: an effect of that size is found as often as not.

    Args:
        fitter: has the columns.
        fit: with the effect in.
        c: the effect.
    """
    variance, freedom = fitter.variance_along(fit, c.index)
    fall = needed(len(c.index), c.places, variance, freedom)
    known = np.diag(fitter.informed(fit, c.index))[: len(c.plausible)]
    out: Array = np.sqrt(fall / np.maximum(known, 1e-30))
    return out


def accepted(fitter: Fitter, before: Fit, after: Fit, c: Candidate) -> bool:
    """Whether an effect is no chance, holds on flight not fitted, is believable and matters."""
    if c.score(fitter, before, after) < least() or c.margin(fitter, before, after) <= CLEARLY:
        return False
    # What nothing has a name for may be taken all the same, and is told of as what cannot be.
    if not _small_enough(fitter, after, c) or (c.mirrored and not possible(fitter, after, c)):
        return False
    if not _there(fitter, after, c):
        return False
    value = after.theta[c.sizes] - fitter.absent[c.sizes]
    if c.jump and np.max(np.abs(value)) > c.worth:
        # What is learned over the whole flight lies in between, and nearer to both.
        return True
    return _matters(fitter, before, after) or _missed(fitter, before, c)


def believable(fitter: Fitter, after: Fit, c: Candidate) -> bool:
    """Whether an effect of the size that ``after`` has it can be."""
    return _small_enough(fitter, after, c) and possible(fitter, after, c)


def _small_enough(fitter: Fitter, after: Fit, c: Candidate) -> bool:
    value = after.theta[c.sizes] - fitter.absent[c.sizes]
    return bool(np.all(np.abs(value) <= np.array(c.plausible)))


def possible(fitter: Fitter, after: Fit, c: Candidate) -> bool:
    """Whether no size that ``after`` has is surely of the sign that nature does not allow."""
    if not c.positive:
        return True
    value = after.theta[c.sizes] - fitter.absent[c.sizes]
    sigma = np.sqrt(np.diag(fitter.covariance(after))[c.sizes])
    return bool(np.all(value >= -BEYOND * sigma))


def _there(fitter: Fitter, after: Fit, c: Candidate) -> bool:
    """Whether it has a size, where its shapes are shares of one."""
    if c.columns is None:
        return True
    value = after.theta[c.sizes] - fitter.absent[c.sizes]
    return c.columns.there(value, np.sqrt(np.diag(fitter.covariance(after))[c.sizes]))


def _missed(fitter: Fitter, before: Fit, c: Candidate) -> bool:
    """Whether what it is with the other sign is surely less than nothing without it.

    No such flight is explained, whatever that changes.
    """
    index = [fitter.model.index[name] for name in c.mirrored]
    if not index:
        return False
    value = before.theta[index] - fitter.absent[index]
    sigma = np.sqrt(np.diag(fitter.covariance(before))[index])
    return bool(np.any(value < -BEYOND * sigma))


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
