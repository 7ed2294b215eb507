"""What a flight determines of the six, in words that a pilot understands."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from onboard.core.estimate.determined import Determined, determine
from onboard.core.estimate.result import Calibration
from onboard.core.physics.wording import listed

ALL_SIX = "all six numbers are known"
YES, ROUGHLY, TOGETHER, NO = "yes", "roughly", "together", "no"
"""How far a number is known: as well as needed; better than before; only together with the other
number of its axis, as the axis is loaded in flight; not at all."""


@dataclass(frozen=True, slots=True)
class _This:
    """A calibration by itself and not by its numbers, of which there are hundreds."""

    calibration: Calibration

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _This) and self.calibration is other.calibration

    def __hash__(self) -> int:
        return id(self.calibration)


def determined(c: Calibration) -> Determined | None:
    """What the flight determines beyond the values in force in it; None if nothing can be said."""
    return _determined(_This(c))


@lru_cache(maxsize=8)  # a page asks several times a second about the five of one vehicle
def _determined(this: _This) -> Determined | None:
    c = this.calibration
    try:
        return determine(c, c.in_force_scale + c.in_force_offset)
    except ValueError:  # no covariance: there was no flight
        return None


def seen(c: Calibration) -> tuple[str, ...]:
    """How far each of the six is known, in one word, in the order of SIX_NAMES."""
    found = determined(c)
    if found is None:
        return (NO,) * 6
    return tuple(
        YES if needed else ROUGHLY if known else TOGETHER if free else NO
        for needed, known, free in zip(c.observable, found.known, found.free, strict=True)
    )


def whole(c: Calibration) -> bool:
    """Whether there is no more to learn: all six are known as well as needed."""
    return all(c.observable)


def calibrated(c: Calibration) -> str:
    """What a calibrated accelerometer is called: some flights show more of it than others."""
    return "calibrated" if whole(c) else "calibrated in part"


def knowledge(c: Calibration) -> str:
    """What is known, as part of a sentence: ``known are x and y offset; the rest stays``."""
    words = seen(c)
    if all(w == YES for w in words):
        return ALL_SIX
    offsets = [axis for axis, w in zip("xyz", words[3:], strict=True) if w in {YES, ROUGHLY}]
    scales = [axis for axis, w in zip("xyz", words[:3], strict=True) if w in {YES, ROUGHLY}]
    loads = [
        axis
        for axis, scale, offset in zip("xyz", words[:3], words[3:], strict=True)
        if TOGETHER in {scale, offset}
    ]
    parts = [
        f"{listed(axes)} {name}" for axes, name in ((scales, "scale"), (offsets, "offset")) if axes
    ]
    if loads:
        parts.append(f"{listed(loads)} as loaded in this flight (scale and offset only together)")
    if not parts:
        return "none of the six numbers is known"
    rest = "" if all(w != NO for w in words) else "; the rest stays as it is"
    return f"known: {', '.join(parts)}{rest}"
