"""Segments made ready for the filter, kept while several passes go over them.

What a segment is made ready from - times of fixes without latency, the force of the calibration in
force, effects of a given size - is that of a linearisation and a model.  While neither changes,
only noise levels and the gyroscope's bias do from pass to pass.  A bias is a state of the filter:
it goes on from a segment that was made ready with another one as soon as that state counts from it.
What effects remember is of the samples alone, and the same about another linearisation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.limits import MOST_PREPARED_BYTES, NEAR_BIAS_RAD_S
from onboard.core.filter.prepared import Prepared
from onboard.core.inputs.segments import Fixes, Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import preferred


@dataclass(frozen=True, slots=True)
class Source:
    """What is made ready: a segment, after another.

    Attributes:
        segment: samples.
        fixes: GPS epochs.
        trusted: (n,) whether the receiver is to be believed there.
        before: the segment before, with what effects remember of it; None after a gap.
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
        segment: the same with what effects remember.
        ready: what the filter goes through.
        bias_b: (3,) gyroscope bias that was subtracted, body axes, rad/s.
    """

    of: Source
    segment: Segment
    ready: Prepared
    bias_b: Array

    @property
    def size(self) -> int:
        """Bytes that are its own."""
        old = self.of.segment.slow
        own = [x for name, x in self.segment.slow.items() if name not in old]
        return self.ready.size + sum(x.nbytes for signal in own for x in signal)

    def serves(self, bias_b: Array) -> bool:
        """Whether it does for a pass with this gyroscope bias (3,), rad/s."""
        return float(np.abs(self.bias_b - bias_b).max()) < NEAR_BIAS_RAD_S


class Preparations:
    """What the passes about one linearisation, with one model, have made ready."""

    def __init__(self, most_bytes: int | None = None) -> None:
        """Take how much may be kept; None: what the program can spare."""
        spare = MOST_PREPARED_BYTES if preferred() else 0
        self._most = self._room = spare if most_bytes is None else most_bytes
        self._kept: dict[tuple[int, ...], Kept] = {}
        self._remembered: dict[tuple[int, ...], tuple[Source, Segment]] = {}

    def elsewhere(self) -> Preparations:
        """For passes about another linearisation, with the same effects in the model."""
        made = Preparations(self._most)
        made._remembered = self._remembered
        return made

    def __len__(self) -> int:
        return len(self._kept)

    def of(self, source: Source) -> Kept | None:
        """What was made of the same; None: nothing."""
        return self._kept.get(source.key)

    def remembered(self, source: Source) -> Segment | None:
        """Its segment with what effects remember; None: nobody has asked for it yet."""
        found = self._remembered.get(source.key)
        return None if found is None else found[1]

    def keep(self, made: Kept) -> None:
        """Keep it if there is room, in the place of what was made of the same."""
        before = self._kept.pop(made.of.key, None)
        if before is not None:
            self._room += before.size
        if made.size <= self._room:
            self._kept[made.of.key] = made
            self._remembered[made.of.key] = made.of, made.segment
            self._room -= made.size
