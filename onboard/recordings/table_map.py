"""A column map: which columns of a table are what, in which units and frames (TOML)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.errors import ConfigurationError
from onboard.toml_file import read_toml

LARGEST = 1e9
"""Of any unit that a map has: a second in nanoseconds; infinity is none [bound]."""
DEGREE = float(np.pi) / 180.0
UNITS: Mapping[str, Mapping[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "position": {"m": 1.0, "cm": 0.01, "mm": 1e-3},
    "velocity": {"m/s": 1.0, "cm/s": 0.01, "mm/s": 1e-3},
    "attitude": {"rad": 1.0, "deg": DEGREE},
    "force": {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "mg": 1e-3 * STANDARD_GRAVITY},
    "rates": {"rad/s": 1.0, "deg/s": DEGREE, "mrad/s": 1e-3},
    "motors": {"us": 1.0, "1": 1.0, "%": 0.01},
    "throttle": {"1": 1.0, "%": 0.01},
    "rudder": {"1": 1.0, "%": 0.01},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "current": {"A": 1.0, "mA": 1e-3},
    "airspeed": {"m/s": 1.0, "cm/s": 0.01},
    "wind": {"m/s": 1.0, "cm/s": 0.01},
}
"""Units of each quantity; the first is meant where none is given."""
WIDTHS = {"time": 1, "position": 3, "velocity": 3, "force": 3, "rates": 3}
WIDTHS |= {"voltage": 1, "current": 1, "airspeed": 1, "throttle": 1, "rudder": 1, "wind": 2}
WORLDS = {
    "ned": np.eye(3),
    "enu": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
    "nwu": np.diag([1.0, -1.0, -1.0]),
}
"""To north, east, down."""
BODIES = {"frd": np.eye(3), "flu": np.diag([1.0, -1.0, -1.0])}
"""To forward, right, down."""
KINDS = ("specific_force", "acceleration")
AIRSPEEDS = ("equivalent", "true")
VEHICLES = ("copter", "plane", "")
QUANTITIES = (*WIDTHS, "attitude", "motors")
OF_TABLE = {"vehicle", "world", "body", "airborne", "fix_rate", "origin"}
OF_QUANTITY = {"columns", "column", "unit"}
OWN_KEYS = {
    "attitude": {"quaternion", "euler", "conjugate", "unit"},
    "force": OF_QUANTITY | {"kind", "frame", "low_pass", "derived"},
    "rates": OF_QUANTITY | {"low_pass"},
    "motors": OF_QUANTITY | {"range"},
    "airspeed": OF_QUANTITY | {"kind"},
    "wind": OF_QUANTITY | {"sigma"},
}
WIND_SIGMA_M_S = 0.1
"""Of a measured wind, where the map does not say [data sheet: an ultrasonic anemometer]."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """Columns of one quantity and what makes them SI."""

    columns: tuple[str, ...]
    factor: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TableMap:
    """What the columns of a table mean.

    Attributes:
        quantities: by name.
        world: (3, 3) frame of positions, velocities and attitude to north, east, down.
        body: (3, 3) frame of force, rates and attitude to forward, right, down.
        quaternion: whether the attitude is w, x, y, z, not roll, pitch, yaw.
        conjugate: whether the attitude turns the world to the body, not the body to the world.
        kinematic: whether the force is acceleration, without gravity's reaction.
        force_in_world: whether it is along the world's axes.
        derived: whether it is the slope of the velocity, so that there is no accelerometer.
        low_pass: cut-off (Hz) of the second-order filters that force and rates went through; 0 is
            none.
        motor_range: what the motors are at idle and at full, in SI as they are; None: as the unit
            says.
        true_airspeed: whether the airspeed is the true one, not what a pitot tube says.
        wind_sigma: of a wind that was measured, m/s.
        vehicle: ``copter``, ``plane`` or empty.
        airborne: whether all of the table is flight: then no ground is looked for.
        fix_rate: positions and velocities that are used a second, at most.
        origin: latitude and longitude (degrees) and height above the sea (m) of the position zero.
    """

    quantities: Mapping[str, Quantity]
    world: Array = field(default_factory=lambda: np.eye(3))
    body: Array = field(default_factory=lambda: np.eye(3))
    quaternion: bool = False
    conjugate: bool = False
    kinematic: bool = False
    force_in_world: bool = False
    derived: bool = False
    low_pass: tuple[float, float] = (0.0, 0.0)
    motor_range: tuple[float, float] | None = None
    true_airspeed: bool = False
    wind_sigma: float = WIND_SIGMA_M_S
    vehicle: str = ""
    airborne: bool = False
    fix_rate: float = 10.0
    origin: tuple[float, float, float] = (47.0, 8.0, 0.0)


def load_map(path: str | Path) -> TableMap:
    """Read a column map.

    Raises:
        ConfigurationError: it cannot be read or makes no sense; names file and key.
    """
    found = read_toml(Path(path))
    try:
        return table_map(found)
    except ValueError as error:
        raise ConfigurationError(f"{path}: {error}") from None


def table_map(found: Mapping[str, Any]) -> TableMap:
    """The map that a TOML document describes.

    Raises:
        ValueError: names the key that makes no sense.
    """
    _only(found, OF_TABLE | set(QUANTITIES), "")
    quantities = {
        name: _quantity(name, _table(found, name)) for name in QUANTITIES if name in found
    }
    for needed in ("time", "attitude", "force"):
        if needed not in quantities:
            raise ValueError(f"[{needed}] is missing")
    if not {"velocity", "position"} & set(quantities):
        raise ValueError("[velocity] or [position] is missing")
    if "throttle" in quantities and "motors" in quantities:
        raise ValueError("a copter has [motors], a plane has [throttle]: one of them is too many")
    if "rudder" in quantities and "throttle" not in quantities:
        raise ValueError("[rudder] is of no use without [throttle]")
    attitude, force = _table(found, "attitude"), _table(found, "force")
    airspeed = _table(found, "airspeed") if "airspeed" in found else {}
    origin = _table(found, "origin") if "origin" in found else {}
    _only(origin, {"latitude", "longitude", "altitude"}, "origin.")
    return TableMap(
        quantities=quantities,
        world=WORLDS[_word(found, "world", tuple(WORLDS), "")],
        body=BODIES[_word(found, "body", tuple(BODIES), "")],
        quaternion="quaternion" in attitude,
        conjugate=_flag(attitude, "conjugate", "attitude."),
        kinematic=_word(force, "kind", KINDS, "force.") == "acceleration",
        force_in_world=_word(force, "frame", ("body", "world"), "force.") == "world",
        derived=_flag(force, "derived", "force."),
        low_pass=(
            _number(force, "low_pass", 0.0, "force."),
            _number(_table(found, "rates"), "low_pass", 0.0, "rates.") if "rates" in found else 0.0,
        ),
        motor_range=_range(_table(found, "motors")) if "motors" in found else None,
        true_airspeed=_word(airspeed, "kind", AIRSPEEDS, "airspeed.") == "true",
        wind_sigma=_wind_sigma(_table(found, "wind")) if "wind" in found else WIND_SIGMA_M_S,
        vehicle=_word(found, "vehicle", VEHICLES, ""),
        airborne=_flag(found, "airborne", ""),
        fix_rate=_positive(found, "fix_rate", 10.0),
        origin=(
            _number(origin, "latitude", 47.0, "origin."),
            _number(origin, "longitude", 8.0, "origin."),
            _number(origin, "altitude", 0.0, "origin."),
        ),
    )


def _quantity(name: str, found: Mapping[str, Any]) -> Quantity:
    _only(found, OWN_KEYS.get(name, OF_QUANTITY), f"{name}.")
    key, width = "columns", WIDTHS.get(name, 0)
    if name == "attitude":
        key = "quaternion" if "quaternion" in found else "euler"
        width = 4 if key == "quaternion" else 3
        if {"quaternion", "euler"} <= set(found):
            raise ValueError("attitude has both quaternion and euler")
    elif "column" in found:
        key = "column"
    given = found.get(key)
    columns = [given] if isinstance(given, str) else given
    if not isinstance(columns, list) or not columns or not _are_names(columns):
        raise ValueError(f"{name}.{key} must name columns")
    if width and len(columns) != width:
        raise ValueError(f"{name}.{key} must name {width} columns, has {len(columns)}")
    unit = _word(found, "unit", tuple(UNITS[name]), f"{name}.")
    return Quantity(tuple(columns), UNITS[name][unit], unit)


def _are_names(columns: list[Any]) -> bool:
    return all(isinstance(c, str) and c for c in columns)


def _table(found: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    its = found[key]
    if not isinstance(its, dict):
        raise ValueError(f"{key} must be a table: [{key}]")  # noqa: TRY004 - of a file
    return its


def _only(found: Mapping[str, Any], known: set[str], where: str) -> None:
    for key in found:
        if key not in known:
            raise ValueError(f"{where}{key} is unknown (known: {', '.join(sorted(known))})")


def _word(found: Mapping[str, Any], key: str, known: tuple[str, ...], where: str) -> str:
    """One of some words; the first where there is none."""
    default = "" if "" in known else known[0]
    value = found.get(key, default)
    if value not in known:
        choice = ", ".join(filter(None, known))
        raise ValueError(f"{where}{key} is {value!r}, must be one of {choice}")
    return str(value)


def _flag(found: Mapping[str, Any], key: str, where: str) -> bool:
    value = found.get(key, False)
    if not isinstance(value, bool):
        raise ValueError(f"{where}{key} must be true or false")  # noqa: TRY004 - of a file
    return value


def _number(found: Mapping[str, Any], key: str, default: float, where: str) -> float:
    value = found.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise ValueError(f"{where}{key} must be a number")
    return float(value)


def _positive(found: Mapping[str, Any], key: str, default: float, where: str = "") -> float:
    value = _number(found, key, default, where)
    if value <= 0.0:
        raise ValueError(f"{where}{key} must be positive")
    return value


def _wind_sigma(wind: Mapping[str, Any]) -> float:
    """In m/s, in whatever unit it is given."""
    given = UNITS["wind"][_word(wind, "unit", tuple(UNITS["wind"]), "wind.")]
    return given * _positive(wind, "sigma", WIND_SIGMA_M_S / given, "wind.")


def _range(motors: Mapping[str, Any]) -> tuple[float, float] | None:
    if "range" not in motors:
        return None
    given = motors["range"]
    if not isinstance(given, list) or len(given) != 2:
        raise ValueError("motors.range must be two numbers, idle and full")
    low, high = (_number({"range": v}, "range", 0.0, "motors.") for v in given)
    if not low < high:
        raise ValueError("motors.range must rise")
    # In the unit of the columns, which are SI by the time that they are asked.
    factor = UNITS["motors"][_word(motors, "unit", tuple(UNITS["motors"]), "motors.")]
    return factor * low, factor * high
