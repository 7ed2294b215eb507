"""How loops are compiled.  Importing this imports numba, which takes a second and 110 MB.

Compiled code is kept on disk, beside the file of the function or where numba keeps it for a user,
so that only the first run waits for the compiler.  numba notices changes of that file alone.  Each
function has one signature, so that processes that compile it at the same time write the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numba

_F = TypeVar("_F", bound=Callable[..., object])


def compiled(signature: str) -> Callable[[_F], _F]:
    """Compile a function for one signature, or take it from where it was kept.

    Raises:
        ImportError: it cannot be kept, and compiling it in every run costs more than it saves.
    """

    def compile_(function: _F) -> _F:
        try:
            made: _F = numba.njit(signature, cache=True, error_model="numpy")(function)
        except (RuntimeError, OSError) as error:  # numba finds no place, or the disk is full
            raise ImportError("there is no place to keep compiled code") from error
        return made

    return compile_


def part(function: _F) -> _F:
    """A function that compiled ones call: compiled with them, and not looked up by itself."""
    made: _F = numba.njit(error_model="numpy")(function)
    return made
