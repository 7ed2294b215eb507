"""An airframe's numbers as the simulator's files have them: keys with numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, Final, TypeVar

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

DIGITS: Final = 6
"""Of a number in a file: as many as single precision surely keeps, which the simulator reads it
with [data sheet]."""

LARGEST: Final = 1e6
"""Of any unit that a file has: nothing that flies has a million kilograms, metres per second or
volts, or a millionth of what it divides by [physics]."""

A = TypeVar("A", bound="DataclassInstance")


def with_numbers(
    nominal: A, given: Mapping[str, object], positive: Sequence[str], derived: Sequence[str]
) -> A:
    """An airframe with the numbers of a file in their places; other keys are ignored.

    Args:
        nominal: the airframe whose numbers stay where the file has none.
        given: the keys of the file.
        positive: numbers that must be more than zero.
        derived: what is calculated of them, and has to be a number, too.

    Raises:
        ValueError: a key that should be a number is none, or cannot be.
    """
    known = {f.name for f in fields(nominal)}
    numbers: dict[str, float] = {}
    for name, value in given.items():
        if name not in known:
            continue
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"{name} is not a number")  # noqa: TRY004 - of a file
        if not abs(value) <= LARGEST:
            raise ValueError(f"{name} is too large a number")
        numbers[name] = float(value)
    made = replace(nominal, **numbers)
    for name in positive:
        if not getattr(made, name) > 0.0:
            raise ValueError(f"{name} must be positive")
        if getattr(made, name) < 1.0 / LARGEST:
            raise ValueError(f"{name} is too small a number")
    for name in derived:
        try:
            value = getattr(made, name)
        except (ArithmeticError, ValueError):
            value = math.nan
        if not math.isfinite(value):
            raise ValueError(f"nothing flies with these numbers: no {name.replace('_', ' ')}")
    return made


def numbers_of_file(airframe: DataclassInstance) -> dict[str, float | list[float]]:
    """The keys of a file that says this airframe."""
    return {k: float(f"{v:.{DIGITS}g}") for k, v in asdict(airframe).items()}
