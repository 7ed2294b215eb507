"""The size of an effect in a few words, as one would say it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from onboard.answers.words import DEGREE, fixed, listed, unit_in_words
from onboard.core.physics.finding import Finding, Quantity

SURE = 3.0
"""Sigmas from which one of several unknowns is worth a word."""
PARTS_PER_MILLION = 1e6
SIDES = {"x": ("forward", "back"), "y": ("right", "left"), "z": ("down", "up")}


def size_in_words(effect: Finding) -> str:
    """``by 259 ± 8 ms``; empty where there is nothing finite to say."""
    said = _SAID.get(effect.name, _plain)(effect)
    return "" if not math.isfinite(sum(q.value for q in effect.unknowns.values())) else said


def _measured(q: Quantity, factor: float = 1.0, unit: str | None = None) -> str:
    """Value and sigma to the first digit of sigma."""
    value, sigma = factor * q.value, factor * q.sigma
    places = _places(sigma)
    unit = unit_in_words(q.unit) if unit is None else unit
    spread = f" ± {sigma:.{places}f}" if math.isfinite(sigma) and sigma > 0.0 else ""
    return f"{fixed(value, places)}{spread}{unit if unit == '°' else f' {unit}'}".rstrip()


def _places(sigma: float) -> int:
    """Decimals down to the first digit of a sigma."""
    if not math.isfinite(sigma) or sigma <= 0.0:
        return 3
    return min(max(0, -math.floor(math.log10(sigma))), 6)


def _sure(unknowns: Mapping[str, Quantity]) -> dict[str, Quantity]:
    """Those unknowns that are larger than chance; the largest if none is."""
    sure = {k: q for k, q in unknowns.items() if abs(q.value) > SURE * q.sigma}
    if sure or not unknowns:
        return sure
    most = max(unknowns, key=lambda k: abs(unknowns[k].value))
    return {most: unknowns[most]}


def _axes(unknowns: Mapping[str, Quantity], factor: float = 1.0, unit: str | None = None) -> str:
    sure = _sure(unknowns)
    if not sure:
        return ""
    first = next(iter(sure.values()))
    unit = unit_in_words(first.unit) if unit is None else unit
    each = [f"{k} {fixed(factor * q.value, _places(factor * q.sigma))}" for k, q in sure.items()]
    return f"{', '.join(each)}{unit if unit == '°' else f' {unit}'}".rstrip()


def _plain(effect: Finding) -> str:
    return _axes(effect.unknowns)


def _by(factor: float, unit: str) -> Callable[[Finding], str]:
    def said(effect: Finding) -> str:
        q = next(iter(effect.unknowns.values()))
        return f"by {_measured(q, factor, unit)}"

    return said


def _percent(effect: Finding) -> str:
    return f"{_axes(effect.unknowns, 100.0, '%')} per g"


def _over(effect: Finding) -> str:
    return f"over {_measured(next(iter(effect.unknowns.values())), 1e3, 'ms')}"


def _attitude(effect: Finding) -> str:
    q = next(iter(effect.unknowns.values()))
    late = Quantity(abs(q.value), q.sigma, q.unit)
    return f"attitude {'late' if q.value > 0.0 else 'early'} by {_measured(late, 1e3, 'ms')}"


def _degrees(effect: Finding) -> str:
    return f"by {_axes(effect.unknowns, 1.0 / DEGREE, '°')}"


def _degrees_per(what: str) -> Callable[[Finding], str]:
    return lambda effect: f"by {_axes(effect.unknowns, 1.0 / DEGREE, '°')} {what}"


def _jump(effect: Finding) -> str:
    rest = {k: q for k, q in effect.unknowns.items() if k != "time"}
    at = effect.unknowns.get("time")
    when = f"at {at.value:.0f} s " if at else ""
    return f"{when}by {_axes(rest)}"


def _arm(effect: Finding) -> str:
    sides = [
        f"{abs(q.value):.{min(_places(q.sigma), 2)}f} m {SIDES[k][q.value < 0.0]}"
        for k, q in _sure(effect.unknowns).items()
        if k in SIDES
    ]
    return listed(sides) if sides else _plain(effect)


def _limit(effect: Finding) -> str:
    q = effect.unknowns.get("limit")
    return f"of {fixed(q.value, 1)} m/s²{_times(effect)}" if q else ""


def _fault(effect: Finding) -> str:
    whole = sum(b - a for a, b in effect.intervals)
    said = f"{fixed(whole, 0)} s in all{_times(effect)}"
    off = effect.unknowns.get("offset")
    return said if off is None else f"by {fixed(off.value, 1)} m/s, {said}"


def _times(effect: Finding) -> str:
    n = len(effect.intervals)
    return f", {n} times" if n > 1 else ""


_SAID: dict[str, Callable[[Finding], str]] = {
    "gps_latency": _by(1e3, "ms"),
    "gps_smoothing": _over,
    "gps_lever_arm": _arm,
    "imu_delay": _attitude,
    "cross_axis": lambda effect: _axes(effect.unknowns, 100.0, "%"),
    "mount_tilt": _degrees,
    "heading_error": _by(1.0 / DEGREE, "°"),
    "heading_by_throttle": _degrees_per("at full throttle"),
    "load_flex": _degrees_per("per g"),
    "bias_step": _jump,
    "saturation": _limit,
    "gps_fault": _fault,
    "clock_skew": _by(PARTS_PER_MILLION, "ppm"),
    "scale_nonlinearity": _percent,
    "gravity": _by(1.0, "m/s²"),
}
