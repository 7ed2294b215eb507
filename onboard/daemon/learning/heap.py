"""Memory that was freed, given back to the machine.

A diagnosis takes some 20 MB of small arrays for some seconds.  The C library keeps what is freed
between others for later; on a companion computer somebody else can use it until the next landing.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable


def _find() -> Callable[[int], int] | None:
    """``malloc_trim`` of the GNU C library; others have none."""
    try:
        function: Callable[[int], int] = ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError):
        return None
    return function


_MALLOC_TRIM = _find()


def trim() -> None:
    """Give back what is free; milliseconds."""
    if _MALLOC_TRIM is not None:
        _MALLOC_TRIM(0)
