"""Which numbers of an epoch the filter reads, by kinds.

``v`` is a component of velocity, ``h`` height, ``t`` tilt of the recorded attitude (about north,
about east), ``y`` its heading.  Each is the sum of two states plus white noise
(:mod:`onboard.core.filter.state`).
"""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.innovations import Epoch
from onboard.core.filter.state import ERRORS, H

Index = NDArray[np.intp]
_OF_KIND = {"v": (0, 1, 2), "h": (H,), "t": (4, 5), "y": (6,)}


class Reading(NamedTuple):
    """Which states r measured numbers read.

    Attributes:
        number: (r,) which of the numbers that can be measured each is: state ``number`` and state
            ``number + ERRORS`` are read, and noise variance ``number`` is its own.
        first: the same as what a dimension is indexed with: a slice, without copies, if it can be.
        second: the same plus ``ERRORS``.
    """

    number: Index
    first: Index | slice
    second: Index | slice


@cache
def reading(kinds: str) -> Reading:
    """For measured numbers of these kinds, in the order ``v...``, ``h``, ``tty``."""
    number = [i for kind, all_ in _OF_KIND.items() for i in all_[: kinds.count(kind)]]
    index = np.array(number, dtype=np.intp)
    start, end = number[0], number[-1] + 1
    if end - start == len(number):
        return Reading(index, slice(start, end), slice(start + ERRORS, end + ERRORS))
    return Reading(index, index, index + ERRORS)


def kinds_of(epoch: Epoch, *, velocity: bool, height: bool, attitude: bool) -> str:
    """Kinds of what an epoch has to offer of what is wanted; empty if nothing."""
    kinds = ""
    if velocity:
        north, east, down = epoch.velocity.tolist()
        if math.isfinite(north) and math.isfinite(east):
            kinds += "vvv" if math.isfinite(down) else "vv"
    if height and math.isfinite(epoch.height):
        kinds += "h"
    if attitude and epoch.R_attitude is not None:
        kinds += "tty"
    return kinds
