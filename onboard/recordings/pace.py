"""Strides of numpy over a recording: how far one may go, and what it meets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Integers: TypeAlias = NDArray[np.int64]

SHORTEST, LONGEST = 1 << 12, 1 << 17
"""bytes of a stride: shorter ones are no faster than steps, longer ones take memory [cost]."""
FEWEST, MOST = 512, 8192
"""records that are copied at a time: fewer are slow, more take memory beside the copies [cost]."""
MOST_DECEPTIONS = 64
"""Places in one stride that look like the beginning of something but stand inside another thing:
past it steps are faster.  The answer is the same either way [cost]."""


@dataclass(slots=True)
class Pace:
    """Lets strides grow while nothing stops them.

    After one that was stopped, some bytes are walked step by step, so that no file costs much more
    than such a walk, however it is made.
    """

    length: int = SHORTEST
    slow_until: int = 0

    def strides(self, at: int) -> bool:
        """Whether to try a stride from ``at``."""
        return at >= self.slow_until

    def took(self, end: int, *, whole: bool) -> None:
        """A stride came to ``end``; whether that is as far as it was to go."""
        if whole:
            self.length = min(2 * self.length, LONGEST)
        else:
            self.length, self.slow_until = SHORTEST, end + SHORTEST


def chain(starts: Integers, following: Integers) -> Integers:
    """Numbers of the places that are reached from the first one, each where another ends.

    Args:
        starts: (n,) where things may begin, in order.
        following: (n,) where each would end.
    """
    last_of_runs = np.append(np.flatnonzero(following[:-1] != starts[1:]), len(starts) - 1)
    runs, i = [], 0
    for _ in range(MOST_DECEPTIONS):
        last = int(last_of_runs[np.searchsorted(last_of_runs, i)])
        runs.append(np.arange(i, last + 1))
        i = int(np.searchsorted(starts, following[last]))
        if i == len(starts) or starts[i] != following[last]:
            break
    return np.concatenate(runs)


def block_length(count: int) -> int:
    """Records to copy at a time, so that what is held beside the copies is little, but not slow."""
    return min(max(count // 12, FEWEST), MOST)
