"""Sums of portions of a flight: enough of them for folds, clusters and forgetting."""

from __future__ import annotations

from dataclasses import dataclass

from onboard.core.maths.sums import NormalSums


@dataclass(slots=True)
class Portion:
    """Sums of one portion of flight."""

    start: float
    end: float
    sums: NormalSums


@dataclass(frozen=True, slots=True)
class Seconds:
    """How much flight is behind some sums: ``trusted``, and of that ``brisk``, s."""

    trusted: float
    brisk: float


def merged(portions: list[Portion], most: int) -> list[Portion]:
    """At most ``most`` portions, neighbours added up."""
    while len(portions) > most:
        pairs = [
            Portion(a.start, b.end, a.sums + b.sums)
            for a, b in zip(portions[::2], portions[1::2], strict=False)
        ]
        portions = pairs + ([portions[-1]] if len(portions) % 2 else [])
    return portions
