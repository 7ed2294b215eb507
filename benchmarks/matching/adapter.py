"""How the challenge asks: the command ``onboard match``, its document, and what it said of it.

The only place that knows the names of keys in ``onboard.match/1``.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

SCHEMA = "onboard.match/1"
LONGEST_S = 1800.0
"""A match takes 15 s of a processor; more than a hundred times that is no busy machine."""

Converted = Callable[[float, float], tuple[float, float]]


def _same(value: float, sigma: float) -> tuple[float, float]:
    return value, sigma


def _inverse(value: float, sigma: float) -> tuple[float, float]:
    return 1.0 / value, sigma / value**2


def _exponential(value: float, sigma: float) -> tuple[float, float]:
    return math.exp(value), math.exp(value) * sigma


def _excess(value: float, sigma: float) -> tuple[float, float]:
    return 1.0 + value, sigma


def _half(value: float, sigma: float) -> tuple[float, float]:
    return 0.5 * value, 0.5 * sigma


def _milli(value: float, sigma: float) -> tuple[float, float]:
    return 1e-3 * value, 1e-3 * sigma


KEYS: dict[str, dict[str, dict[str, Converted]]] = {
    "rotor_drag": {"coefficient": {"coefficient": _same, "mcoef": _same, "EK3_DRAG_MCOEF": _same}},
    "body_drag": {
        "x": {"x": _same, "bcoef_x": _inverse, "EK3_DRAG_BCOEF_X": _inverse},
        "y": {"y": _same, "bcoef_y": _inverse, "EK3_DRAG_BCOEF_Y": _inverse},
    },
    "thrust_scale": {"ratio": {"ratio": _same, "scale": _same, "log_ratio": _exponential}},
    "thrust_curve": {"expo": {"expo": _same}},
    "motor_lag": {"time_constant": {"time_constant": _same, "lag": _same, "lag_ms": _milli}},
    "thrust_tilt": {"x": {"x": _same, "pitch": _same}, "y": {"y": _same, "roll": _same}},
    "wind": {"north": {"north": _same}, "east": {"east": _same}},
    "wind_profile": {"exponent": {"exponent": _same}},
    "turbulence": {"rms": {"rms": _same, "turbulence_rms": _same, "sigma": _same}},
    "air_density": {"ratio": {"ratio": _same, "excess": _excess}},
    "ground_effect": {"gain": {"gain": _same}},
    "mass_change": {"ratio": {"ratio": _same}},
    "voltage_sag": {"share": {"share": _same, "exponent": _half}},
    "drag": {"c_drag_p": {"c_drag_p": _same}},
    "lift": {"c_lift_0": {"c_lift_0": _same}, "c_lift_a": {"c_lift_a": _same}},
    "side_force": {"c_y_b": {"c_y_b": _same}},
    "airspeed_scale": {"scale": {"scale": _same, "over_equivalent": _same}},
    "gps_latency": {"delay": {"delay": _same}},
    "mount_tilt": {"roll": {"roll": _same}, "pitch": {"pitch": _same}},
}
"""Unknowns by effect, under the names that a document may give them, and how they convert."""


@dataclass(frozen=True, slots=True)
class Said:
    """What was said of one recording.

    Attributes:
        verdict: in words.
        values: (value, sigma) by effect and unknown, in the challenge's units.
        rivals: names of which one is said to be there, effect by effect.
        not_testable: names.
        held_out: error of the force before and after, on flight that was not used, m/s^2.
    """

    verdict: str
    values: Mapping[str, Mapping[str, tuple[float, float]]]
    rivals: tuple[tuple[str, ...], ...] = ()
    not_testable: tuple[str, ...] = ()
    held_out: tuple[float, float] = (math.nan, math.nan)
    details: Mapping[str, Any] = field(default_factory=dict)

    @property
    def clean(self) -> bool:
        """Nothing differs, it says."""
        return self.verdict == "clean"


Asked = Callable[[Path], Said]


class MatchError(Exception):
    """The command failed, or its document is none."""


def by_command(recording: Path) -> Said:
    """Asks ``onboard match``.

    Raises:
        MatchError: it failed.
    """
    document = recording.with_suffix(".json")
    command = [sys.executable, "-m", "onboard", "match", str(recording), "--json", str(document)]
    try:
        done = subprocess.run(  # noqa: S603
            command,
            capture_output=True,
            text=True,
            timeout=LONGEST_S,
            check=False,
            cwd=recording.parent,  # the installed command, not what lies where this was started
        )
    except subprocess.TimeoutExpired:
        raise MatchError(f"onboard match took longer than {LONGEST_S:.0f} s") from None
    if done.returncode:
        raise MatchError(
            f"onboard match ended with {done.returncode}: {done.stderr.strip()[-300:]}"
        )
    text = document.read_text(encoding="utf-8") if document.exists() else done.stdout
    return said(json.loads(text))


def said(document: Mapping[str, Any]) -> Said:
    """A document's effects in the challenge's words.

    Raises:
        MatchError: another schema.
    """
    if document.get("schema") != SCHEMA:
        raise MatchError(f"not {SCHEMA} but {document.get('schema')}")
    effects = document.get("effects", ())
    wind = document.get("wind") or {}
    values = {e["name"]: _values(e, wind) for e in effects}
    rivals = tuple((e["name"], *e["rivals"]) for e in effects if e.get("rivals"))
    missed = tuple(item["name"] for item in document.get("not_testable", ()))
    return Said(
        verdict=str(document.get("verdict", "")),
        values=values,
        rivals=rivals,
        not_testable=missed,
        held_out=_lateral(document.get("mismatch") or {}),
        details={"effects": effects, "wind": wind},
    )


def _values(effect: Mapping[str, Any], wind: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    name, told = effect["name"], effect.get("values", {})
    out = {}
    for unknown, aliases in KEYS.get(name, {}).items():
        for key, convert in aliases.items():
            if key in told and told[key].get("real") is not None:
                sigma = told[key].get("sigma")
                out[unknown] = convert(
                    float(told[key]["real"]), math.nan if sigma is None else float(sigma)
                )
                break
    # The wind at the flight's mean height is what the truth is of, too.
    if name == "wind" and wind.get("north") is not None:
        for axis in ("north", "east"):
            out[axis] = (float(wind[axis]), float(wind.get(f"sigma_{axis}") or math.nan))
    return out


def _lateral(mismatch: Mapping[str, Any]) -> tuple[float, float]:
    """Root mean square over x and y, before and after."""
    axes = [mismatch[a] for a in ("x", "y") if a in mismatch]
    if not axes or any(a.get(k) is None for a in axes for k in ("before", "after")):
        return math.nan, math.nan
    before, after = (
        math.sqrt(sum(float(a[k]) ** 2 for a in axes) / len(axes)) for k in ("before", "after")
    )
    return before, after
