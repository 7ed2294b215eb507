"""Segments made ready for the filter, kept while several passes go over them.

What a segment is made ready from - times of fixes without latency, the force of the calibration in
force, effects of a given size - is that of a linearisation and a model.  While neither changes,
only noise levels and the gyroscope's bias do from pass to pass.  A bias is a state of the filter:
it goes on from a segment that was made ready with another one as soon as that state counts from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.limits import (
    MADE_READY_AT_ONCE,
    MOST_PREPARED_BYTES,
    MOST_PREPARED_LIVE_BYTES,
    NEAR_BIAS_RAD_S,
)
from onboard.core.filter.prepared import Prepared
from onboard.core.inputs.segments import Batch, Fixes, Segment
from onboard.core.inputs.stretches import continues, joined
from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import preferred


@dataclass(frozen=True, slots=True)
class Source:
    """What is made ready: a segment, after another.

    Attributes:
        segment: samples.
        fixes: GPS epochs.
        trusted: (n,) whether the receiver is to be believed there.
        before: the segment before, with what effects remember of it, or the stretch that both are
            of; None after a gap.
        skipped: how many fixes from the first on are left out.
    """

    segment: Segment
    fixes: Fixes
    trusted: NDArray[np.bool_]
    before: Segment | None
    skipped: int

    @property
    def key(self) -> tuple[int, ...]:
        """Says whether another one is of the very same objects, as long as this one lives."""
        objects = (self.segment, self.fixes, self.trusted, self.before)
        return (*map(id, objects), self.skipped)


@dataclass(frozen=True, slots=True)
class Kept:
    """A segment that was made ready.

    Attributes:
        of: what it was made of.
        segment: the same with what effects remember; of a stretch that was made ready at once, all.
        ready: what the filter goes through.
        bias_b: (3,) gyroscope bias that was subtracted, body axes, rad/s.
        rest: what is of the same stretch from here on, this one first.
    """

    of: Source
    segment: Segment
    ready: Prepared
    bias_b: Array
    rest: tuple[Source, ...]

    @property
    def size(self) -> int:
        """Bytes that are its own, with its part of the stretch."""
        s = self.segment
        if s is self.of.segment:
            return self.ready.size
        arrays = [s.t, s.w_b, s.raw_s, s.t_attitude, s.R_attitude]
        arrays += [x for signal in s.slow.values() for x in signal]
        share = (self.ready.end - self.ready.start) / max(float(s.t[-1] - s.t[0]), 1e-9)
        return self.ready.size + round(share * sum(x.nbytes for x in arrays))

    def serves(self, bias_b: Array) -> bool:
        """Whether it does for a pass with this gyroscope bias (3,), rad/s."""
        return float(np.abs(self.bias_b - bias_b).max()) < NEAR_BIAS_RAD_S


def stretch(first: Source, following: Sequence[Batch]) -> tuple[Segment, tuple[Source, ...]]:
    """What is made ready at once: a segment, and all that it is for.

    Args:
        first: what has to be.
        following: flight after it; as much of it as goes on without a break, and no more than
            :data:`~onboard.core.filter.limits.MADE_READY_AT_ONCE`.
    """
    batches = [Batch(first.segment, first.fixes, first.trusted, fresh=True)]
    for batch in following[: MADE_READY_AT_ONCE - 1]:
        if not continues(batch, batches[-1]):
            break
        batches.append(batch)
    segment = joined(batches)
    return segment, (first, *(Source(b.segment, b.fixes, b.trusted, None, 0) for b in batches[1:]))


class Preparations:
    """What the passes about one linearisation, with one model, have made ready."""

    def __init__(self, most_bytes: int | None = None) -> None:
        """Take how much may be kept; None: what the program can spare."""
        spare = MOST_PREPARED_BYTES if preferred() else MOST_PREPARED_LIVE_BYTES
        self._room = spare if most_bytes is None else most_bytes
        self._kept: dict[tuple[int, ...], Kept] = {}

    def __len__(self) -> int:
        return len(self._kept)

    def of(self, source: Source) -> Kept | None:
        """What was made of the same; None: nothing."""
        return self._kept.get(source.key)

    def keep(self, made: Kept) -> None:
        """Keep it if there is room, in the place of what was made of the same."""
        before = self._kept.pop(made.of.key, None)
        if before is not None:
            self._room += before.size
        if made.size <= self._room:
            self._kept[made.of.key] = made
            self._room -= made.size
