"""What a soak has measured, and whether it grows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FEWEST = 12
"""Rows from which a slope says something."""


@dataclass(frozen=True, slots=True)
class Row:
    """What the service holds on to now; memory in MB, the disk in kB.

    ``memory`` is resident; of it ``held`` was asked of the allocator and not given back.
    """

    hour: float
    memory: float
    held: float
    objects: int
    descriptors: int
    tasks: int
    disk: float
    notices: int

    def __str__(self) -> str:
        return (
            f"| {self.hour:.0f} | {self.memory:.1f} | {self.held:.2f} | {self.objects:,} "
            f"| {self.descriptors} | {self.tasks} | {self.disk:.0f} | {self.notices} |"
        )


HEAD = (
    "| hour | memory, MB | held, MB | objects | descriptors | tasks | state, kB | notices |\n"
    "|---|---|---|---|---|---|---|---|"
)


@dataclass(frozen=True, slots=True)
class Slope:
    """How much more of something there is each day, and how far chance may have made it so."""

    of: str
    a_day: float
    sigma: float

    @property
    def grows(self) -> bool:
        """Beyond what chance makes of something constant in 999 of 1000 weeks."""
        return self.a_day > 3.1 * self.sigma

    def __str__(self) -> str:
        return f"| {self.of} | {self.a_day:+.3g} | {self.sigma:.2g} |"


def slopes(rows: list[Row]) -> list[Slope]:
    """Of each column that is known but the notices, which are kept up to a number."""
    hours = np.array([row.hour for row in rows])
    names = ("memory", "held", "objects", "descriptors", "tasks", "disk")
    columns = {name: np.array([getattr(row, name) for row in rows]) for name in names}
    return [slope(name, hours, x) for name, x in columns.items() if np.isfinite(x).all()]


def slope(of: str, hours: NDArray[np.float64], values: NDArray[np.float64]) -> Slope:
    """By least squares; what lasts from row to row counts as fewer rows."""
    days = (hours - hours.mean()) / 24.0
    gradient = float(days @ values / (days @ days))
    rest = values - values.mean() - gradient * days
    power = float(rest @ rest)
    if np.ptp(values) == 0.0:
        return Slope(of, 0.0, 0.0)
    lasting = min(max(float(rest[1:] @ rest[:-1]) / power, 0.0), 0.99)
    variance = power / (len(rest) - 2) / float(days @ days) * (1.0 + lasting) / (1.0 - lasting)
    return Slope(of, gradient, math.sqrt(variance))


def settled(rows: list[Row]) -> list[Row]:
    """Without the first day, or quarter, in which tables and caches fill."""
    return rows[min(24, len(rows) // 4) :]


def judge(rows: list[Row]) -> int:
    """Exit status: 1 if something grows."""
    if len(settled(rows)) < FEWEST:
        print("too short to tell what grows")
        return 1
    print("| of | more each day | sigma |", "|---|---|---|", sep="\n")
    found = slopes(settled(rows))
    print(*found, sep="\n")
    return int(any(one.grows for one in found))
