"""Readable numbers, and the words of timing and of distrusted GPS."""

from __future__ import annotations

import math
from collections.abc import Mapping

from onboard.core.physics.finding import Quantity
from onboard.core.physics.wording import DEGREE, UNKNOWN, fixed, listed, unit_in_words

__all__ = [
    "AUTOPILOTS",
    "DISTRUST",
    "TIMING",
    "UNKNOWN",
    "autopilot_in_words",
    "capital",
    "fixed",
    "listed",
    "number",
    "percent",
    "quantity",
    "seconds",
    "setting",
    "signed",
    "unit_in_words",
    "with_sigma",
]


TIMING = {
    "gps_delay_s": "GPS is late by",
    "gps_smoothing_window_s": "GPS averages over",
    "imu_delay_s": "attitude is late by",
}
DISTRUST = {
    "waiting": "nothing heard yet",
    "spoofed": "the receiver reports spoofing",
    "jammed": "the receiver reports jamming",
    "no_fix": "no 3D fix",
    "few_satellites": "too few satellites",
    "hdop": "satellites badly spread (HDOP)",
    "speed_accuracy": "speed too inaccurate",
    "gps_glitch": "fixes contradict each other (glitch)",
    "ekf_gps_glitch": "the autopilot reports a GPS glitch",
    "ekf_unhealthy": "the autopilot's state estimate is not ready",
    "ekf_unknown": "the autopilot has not said yet whether its state estimate is ready",
    "stale": "no fresh GPS",
    "late": "fixes come long after what the accelerometer felt",
    "gps_gap": "a gap in GPS",
    "imu_stuck": "the accelerometer repeats one reading: see to it before the next flight",
    "refused": "fixes are far from what the accelerometer says",
    "restarted": "the recording or the autopilot began anew",
    "configured_end": "the configured time is over",
    "end_of_data": "no more data",
}
"""Why GPS is not trusted."""


AUTOPILOTS = {"ardupilot": "ArduPilot", "px4": "PX4"}


def autopilot_in_words(name: str) -> str:
    """Its name as its makers write it."""
    return AUTOPILOTS.get(name, name)


def number(value: float, digits: int = 3) -> str:
    """``value`` with ``digits`` significant digits; words where it is not finite."""
    if not math.isfinite(value):
        return UNKNOWN
    if value == 0.0:
        return "0"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    if places < 0 and abs(value) < 1e6:
        return f"{float(f'{value:.{digits}g}'):.0f}".replace("-", "−")
    if places < 0 or abs(value) < 1e-4:
        return f"{value:.{digits}g}".replace("-", "−")
    return f"{value:.{min(places, 7)}f}".replace("-", "−")


def signed(value: float, places: int) -> str:
    """``value`` with its sign and ``places`` decimals; words where it is not finite."""
    return f"{value:+.{places}f}".replace("-", "−") if math.isfinite(value) else UNKNOWN


def seconds(value: float, sigma: float) -> str:
    """A time in ms with its sigma."""
    return quantity(Quantity(value, sigma, "s")) if math.isfinite(value) else UNKNOWN


def setting(value: float) -> str:
    """A parameter's value as one types it; words where it is not finite."""
    return f"{round(value, 4) + 0.0:.4g}" if math.isfinite(value) else UNKNOWN


def percent(share: float) -> str:
    """A share as per cent; words where it is not finite."""
    return f"{100.0 * share:.0f} %".replace("-", "−") if math.isfinite(share) else UNKNOWN


def with_sigma(value: float, sigma: float) -> str:
    """``value ± sigma``, the value to the second digit of sigma."""
    if not (math.isfinite(value) and math.isfinite(sigma)) or sigma <= 0.0:
        return number(value)
    places = 1 - math.floor(math.log10(sigma))
    if not 0 <= places <= 7:
        return f"{number(value)} ± {number(sigma, 2)}"
    return f"{value:.{places}f} ± {sigma:.{places}f}".replace("-", "−")


def quantity(q: Quantity) -> str:
    """Value, sigma and unit; seconds below one in ms, angles in degrees."""
    scale, unit = _shown_in(q.unit, q.value)
    text = with_sigma(q.value * scale, q.sigma * scale)
    return f"{text} {unit_in_words(unit)}".rstrip(" -")


def sizes(smallest: Mapping[str, float], unit: str) -> str:
    """Sizes of some unknowns to two digits, one unit for all: ``x 0.39, y 0.37, z 0.06 m/s²``."""
    scale, unit = _shown_in(unit, max(smallest.values(), default=0.0))
    told = [f"{key.replace('_', ' ')} {number(x * scale, 2)}" for key, x in smallest.items()]
    return f"{', '.join(told)} {unit_in_words(unit)}".rstrip(" -")


def _shown_in(unit: str, value: float) -> tuple[float, str]:
    """Factor and unit in which a value is told."""
    if unit == "s" and abs(value) < 1.0:
        return 1e3, "ms"
    if unit.startswith("rad"):
        return 1.0 / DEGREE, "°" + unit[3:]
    return 1.0, unit


def capital(sentence: str) -> str:
    """The sentence with a large first letter, unless that is the name of an axis."""
    if sentence[1:2] == " ":
        return sentence
    return sentence[:1].upper() + sentence[1:]
