"""Numbers that JSON can carry."""

from __future__ import annotations

import math
from collections.abc import Mapping


def finite_values(values: Mapping[str, float]) -> dict[str, float]:
    """The numbers that JSON can carry."""
    return {name: value for name, value in values.items() if math.isfinite(value)}


def finite(value: float) -> float | None:
    """The number, or None where there is none."""
    return value if math.isfinite(value) else None
