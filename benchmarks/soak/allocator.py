"""What the process holds of the memory that it asked the allocator for."""

from __future__ import annotations

import ctypes
import math


class _Mallinfo2(ctypes.Structure):
    """glibc's ``struct mallinfo2``."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in (
            *("arena", "ordblks", "smblks", "hblks", "hblkhd"),
            *("usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"),
        )
    ]


def held_mb() -> float:
    """Asked for and not given back, MB; NaN where the C library does not tell.

    Unlike resident memory this leaves out what was given back and stays with the allocator between
    pieces that are in use.  Python's own allocator takes arenas of 1 MB; with
    ``PYTHONMALLOC=malloc`` there is none, and the number is that of the pieces themselves.
    """
    try:
        told = ctypes.CDLL("libc.so.6").mallinfo2
    except (OSError, AttributeError):
        return math.nan
    told.restype = _Mallinfo2
    found = told()
    return float(found.uordblks + found.hblkhd) / 1e6
