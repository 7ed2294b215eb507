"""A PX4 log's answer as PX4's parameters, ``CAL_ACCn_*``: scale and offset of the raw sensor.

``sensor_combined`` holds what PX4's own calibration has left, in body axes
(``Accelerometer::Correct`` of PX4's ``sensor_calibration``)::

    m = R (S0 (raw - o0)),        and the answer says        f = S (m - o)

with diagonal ``S0`` and ``S``.  Where ``R`` only swaps and flips axes, ``f`` is
``R (S1 (raw - o1))`` with ``S1 = (R^T S R) S0`` and ``o1 = o0 + S0^-1 R^T o``.  Which
accelerometer it was ``sensor_selection`` tells, or its being the only one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from onboard.answers.advice import advise
from onboard.answers.answer import Answer
from onboard.core.estimate.result import SIX_NAMES
from onboard.core.maths.arrays import Array
from onboard.core.maths.board_orientation import board_rotation, is_axis_aligned
from onboard.push.policy import Objection
from onboard.recordings.arrays import read_arrays
from onboard.recordings.ulog_information import ulog_information

SENSORS: Final = 4
"""Accelerometers that PX4 has calibrations for."""
SELECTED: Final = "sensor_selection"
THEIRS: Final = frozenset({Objection.PARAMETERS_UNKNOWN, Objection.ZERO_OFFSETS})
"""Objections that are about ArduPilot's parameters alone."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One parameter of PX4: its value, by how much another flight would differ, and what it is."""

    name: str
    value: float
    sigma: float
    words: str


@dataclass(frozen=True, slots=True)
class Px4Advice:
    """What to set, in the order of SIX_NAMES, and why not to (empty: set it)."""

    settings: tuple[Setting, ...]
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Sensor:
    """The accelerometer that flew, and what PX4 did to it: ``rotation`` (3, 3) to body axes."""

    number: int
    scale: Array
    offset: Array
    rotation: Array

    def names(self) -> tuple[str, ...]:
        """Of its parameters, in the order of SIX_NAMES."""
        stem = f"CAL_ACC{self.number}_"
        return tuple(f"{stem}{axis}{what}" for what in ("SCALE", "OFF") for axis in "XYZ")


def px4_advice(
    answer: Answer, path: Path, last: Mapping[str, float], *, alone: bool = True
) -> Px4Advice:
    """What PX4 may be set to by one answer.

    Args:
        answer: of the recording's only accelerometer.
        path: the log.
        last: parameters by name as they were reported last.
        alone: whether the answer is of this log and no other.

    Raises:
        RecordingError: the log cannot be read.
    """
    (advice,) = advise((answer,), last)
    first: dict[Objection, str] = {}
    for refusal in advice.refusals:
        if refusal.objection not in THEIRS:
            first.setdefault(refusal.objection, refusal.sentence)
    reasons = tuple(first.values())
    if not alone:
        return Px4Advice((), (*reasons, "several recordings: give one, PX4's values may differ"))
    sensor = sensor_of(path, last)
    if isinstance(sensor, str):
        return Px4Advice((), (*reasons, sensor))
    if advice.plan is None:
        return Px4Advice((), reasons)
    changes = advice.plan.changes
    wanted = np.array([c.wanted for c in changes])
    sigma = np.array([c.sigma for c in changes])
    turn, swap = sensor.rotation.T, np.abs(sensor.rotation.T)
    values = np.concatenate(
        (
            (swap @ wanted[:3]) * sensor.scale,
            sensor.offset + (turn @ wanted[3:]) / sensor.scale,
        )
    )
    sigmas = np.concatenate((swap @ sigma[:3] * sensor.scale, swap @ sigma[3:] / sensor.scale))
    kept = np.array([c.kept for c in changes], dtype=float)
    stays = np.concatenate((swap @ kept[:3], swap @ kept[3:])) > 0.5
    rows = zip(sensor.names(), values, sigmas, SIX_NAMES, stays, strict=True)
    return Px4Advice(
        tuple(Setting(n, float(v), float(s), words) for n, v, s, words, stay in rows if not stay),
        reasons,
    )


def sensor_of(path: Path, last: Mapping[str, float]) -> Sensor | str:
    """The accelerometer that a log is of; a sentence where that is not known for certain."""
    before = ulog_information(path).parameters
    tables = read_arrays(path, (SELECTED,)).tables
    table = tables.get(SELECTED)
    used = (
        sorted({int(x) for x in table["accel_device_id"] if x})
        if table is not None and "accel_device_id" in (table.dtype.names or ())
        else []
    )
    calibrated = {
        int(value): n for n in range(SENSORS) if (value := before.get(f"CAL_ACC{n}_ID", 0.0))
    }
    if len(used) > 1:
        return "PX4 changed from one accelerometer to another during the recording"
    device = used[0] if used else next(iter(calibrated), 0) if len(calibrated) == 1 else 0
    if device not in calibrated:
        return "the log does not say which CAL_ACCn is the accelerometer that flew"
    number = calibrated[device]
    stem = f"CAL_ACC{number}_"
    changed = [n for n, v in before.items() if n.startswith(stem) and last.get(n, v) != v]
    if changed:
        return f"PX4 changed {', '.join(sorted(changed))} during the recording"
    rotation = _rotation(before, before.get(f"{stem}ROT", -1.0))
    if rotation is None or not is_axis_aligned(rotation):
        return "the sensor is turned by other than multiples of 90 degrees"
    return Sensor(
        number,
        _three(before, [f"{stem}{axis}SCALE" for axis in "XYZ"], 1.0),
        _three(before, [f"{stem}{axis}OFF" for axis in "XYZ"], 0.0),
        rotation,
    )


def _rotation(parameters: Mapping[str, float], own: float) -> Array | None:
    """Of a sensor with a rotation of its own; of one on the board (-1), the board's."""
    if own >= 0.0:
        return board_rotation(own)
    if any(parameters.get(f"SENS_BOARD_{axis}_OFF", 0.0) for axis in "XYZ"):
        return None
    return board_rotation(parameters.get("SENS_BOARD_ROT", 0.0))


def _three(parameters: Mapping[str, float], names: Sequence[str], default: float) -> Array:
    return np.array([parameters.get(name, default) for name in names])
