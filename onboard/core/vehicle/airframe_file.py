"""An airframe's numbers as the simulator's files have them: keys with numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, Final, TypeVar

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

DIGITS: Final = 6
"""Of a number in a file: as many as single precision surely keeps, which the simulator reads it
with [data sheet]."""

A = TypeVar("A", bound="DataclassInstance")


def with_numbers(nominal: A, given: Mapping[str, object], positive: Sequence[str]) -> A:
    """An airframe with the numbers of a file in their places; other keys are ignored.

    Args:
        nominal: the airframe whose numbers stay where the file has none.
        given: the keys of the file.
        positive: numbers that must be more than zero.

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
        numbers[name] = float(value)
    made = replace(nominal, **numbers)
    for name in positive:
        if not getattr(made, name) > 0.0:
            raise ValueError(f"{name} must be positive")
    return made


def numbers_of_file(airframe: DataclassInstance) -> dict[str, float | list[float]]:
    """The keys of a file that says this airframe."""
    return {k: float(f"{v:.{DIGITS}g}") for k, v in asdict(airframe).items()}
