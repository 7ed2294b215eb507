"""Whether loops are compiled: numpy does everything, numba some of it sooner.

A program that goes over flights hundreds of times says so (:func:`prefer_compiled`).  One that
follows a single flight in real time has no need of a second and 110 MB for numba.
"""

from __future__ import annotations

from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

from onboard.core.maths.arrays import Array


class _Choice:
    compiled = False
    loops: ModuleType | None = None


def prefer_compiled(*, yes: bool = True) -> None:
    """From now on loops are compiled, if they can be; with ``yes=False`` numpy does them."""
    _Choice.compiled = yes


def preferred() -> bool:
    """Whether loops are to be compiled."""
    return _Choice.compiled


def compiled_loops() -> ModuleType | None:
    """:mod:`onboard.core.maths.loops`; None where loops are not compiled.

    They are if that is preferred, numba is installed and there is a place to keep them.
    """
    if not _Choice.compiled:
        return None
    if _Choice.loops is None:
        try:
            from onboard.core.maths import loops  # noqa: PLC0415 - a second, and only if wanted
        except ImportError:
            _Choice.compiled = False
            return None
        _Choice.loops = loops
    return _Choice.loops


def plain(x: ArrayLike) -> Array:
    """Numbers as compiled loops take them: contiguous, and not marked as read-only."""
    if isinstance(x, np.ndarray) and x.dtype == np.float64:
        flags = x.flags  # nearly all are so already, and seventy are asked for in a segment
        if flags.c_contiguous and flags.writeable:
            return x
    return np.require(x, np.float64, ("C", "W"))
