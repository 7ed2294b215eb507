"""Columns as they are given: copied to double precision, of one length, not to be changed."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from onboard.core.maths.arrays import Array
from onboard.errors import ArraysError


def column(name: str, given: ArrayLike, rows: int | None = None) -> Array:
    """(n,) numbers.

    Args:
        name: of the column, for the error.
        given: numbers, any kind of them.
        rows: how many there must be; None: any number.

    Raises:
        ArraysError: no numbers, or another shape.
    """
    return _shaped(name, given, rows, ())


def vectors(name: str, given: ArrayLike, rows: int) -> Array:
    """(n, 3) numbers, x, y, z or north, east, down.

    Raises:
        ArraysError: no numbers, or another shape.
    """
    return _shaped(name, given, rows, (3,))


def optional(name: str, given: ArrayLike | None, rows: int) -> Array | None:
    """(n,) numbers, or none."""
    return None if given is None else column(name, given, rows)


def clock(name: str, given: ArrayLike, arrived: Array | None) -> Array:
    """(n,) times, s.

    Args:
        name: of the column.
        given: the times.
        arrived: their order of arrival, where it is known: then a clock may begin anew.

    Raises:
        ArraysError: no numbers, not finite, or going back without a known order.
    """
    t = column(name, given)
    if not np.isfinite(t).all():
        raise ArraysError(f"{name}: {np.count_nonzero(~np.isfinite(t))} times are not finite")
    if arrived is None and (back := np.flatnonzero(np.diff(t) < 0.0)).size:
        raise ArraysError(f"{name}: time goes back after row {back[0]}")
    return t


def order(name: str, given: ArrayLike | None, rows: int) -> Array | None:
    """(n,) rising numbers, or none.

    Raises:
        ArraysError: another shape, or they do not rise.
    """
    arrived = optional(name, given, rows)
    if arrived is not None and not (np.diff(arrived) > 0.0).all():
        raise ArraysError(f"{name}: the order of arrival does not rise")
    return arrived


def _shaped(name: str, given: ArrayLike, rows: int | None, rest: tuple[int, ...]) -> Array:
    try:
        out = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise ArraysError(f"{name}: holds something that is no number") from None
    wanted = (len(out) if rows is None and out.ndim else rows, *rest)
    if out.shape != wanted:
        raise ArraysError(f"{name}: has the shape {out.shape}, expected {_words(rows, rest)}")
    out.flags.writeable = False
    return out


def _words(rows: int | None, rest: tuple[int, ...]) -> str:
    return f"({', '.join(map(str, ('n' if rows is None else rows, *rest)))}{'' if rest else ','})"
