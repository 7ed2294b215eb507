"""How loops are compiled.  Importing this imports numba, which takes a second and 110 MB.

Compiled code is kept on disk, beside the file of the function or where numba keeps it for a user,
so that only the first run waits for the compiler.  numba notices changes of that file alone, and
what is called, or a constant, is compiled with it from another one: so code is kept under a name
that tells all the sources that it can be of, and none is used that is of others.  Each function has
one signature, so that processes that compile it at the same time write the same.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from hashlib import blake2b
from pathlib import Path
from typing import Final, TypeVar

import numba

_F = TypeVar("_F", bound=Callable[..., object])

_ROOMS: Final = ("filter", "maths")
"""Of the core, in which everything is that compiled functions call and take constants from."""


def compiled(signature: str) -> Callable[[_F], _F]:
    """Compile a function for one signature, or take it from where it was kept.

    Raises:
        ImportError: it cannot be kept, and compiling it in every run costs more than it saves.
    """

    def compile_(function: _F) -> _F:
        function.__qualname__ += f"_{_sources()}"
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


@cache
def _sources() -> str:
    """A digest of all files that compiled code may be of."""
    core, told = Path(__file__).parents[1], blake2b(digest_size=8)
    for file in sorted(file for room in _ROOMS for file in (core / room).rglob("*.py")):
        told.update(file.read_bytes())
    return told.hexdigest()
