"""Numbers in a JSON document: every one is finite, and what is not known is ``null``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import msgspec

from onboard.core.estimate.result import Estimate

TIMING = ("gps_delay_s", "gps_smoothing_window_s", "imu_delay_s")
"""Always in ``timing``, ``null`` where a flight could not tell."""

Numbers = list[float | None]


class Number(msgspec.Struct, frozen=True):
    """A value with its standard deviation, both in the unit that the name carries."""

    value: float | None = None
    sigma: float | None = None


def finite(value: float | None) -> float | None:
    """The number, or None where it is not one."""
    return float(value) if value is not None and math.isfinite(value) else None


def numbers(values: Sequence[float]) -> Numbers:
    """Numbers for a document; None where one is not finite."""
    return [finite(value) for value in values]


def number(estimate: Estimate | None) -> Number:
    """An estimate; both fields ``null`` where there is none."""
    if estimate is None:
        return Number()
    return Number(finite(estimate.value), finite(estimate.sigma))


def timing_document(timing: Mapping[str, Estimate]) -> dict[str, Number]:
    """The three that are always estimated, then whatever else the core knows."""
    names = (*TIMING, *(name for name in timing if name not in TIMING))
    return {name: number(timing.get(name)) for name in names}
