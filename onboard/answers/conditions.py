"""Under which condition a number of the six holds, where it is not one for the whole flight.

An effect that changes the offset leaves the six at what they are without it: before a jump, at the
temperature that the autopilot counts from, at the first moment.  In ArduPilot's convention
``f = (raw - offset) scale``, so an accelerometer that reads ``b`` too much wants the offset
``offset + b / scale``.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from onboard.core.diagnosis.records import Diagnosis
from onboard.core.maths.accelerometer import parameter_names
from onboard.core.maths.board_orientation import board_rotation
from onboard.core.physics.effect import AXES, REFERENCE_DEGC
from onboard.core.physics.finding import Effect


def conditions(diagnosis: Diagnosis, parameters: Mapping[str, float]) -> dict[str, str]:
    """When each offset holds and what it is else, by parameter; empty where one number does.

    Args:
        diagnosis: of the accelerometer.
        parameters: the autopilot's; AHRS_ORIENTATION says how the sensor's axes lie.
    """
    c = diagnosis.calibration
    R_bs = board_rotation(parameters.get("AHRS_ORIENTATION", 0.0))
    out: dict[str, str] = {}
    for effect in diagnosis.effects:
        said = _SAID.get(effect.name)
        if said is None or R_bs is None:
            continue
        too_much_b = np.array([effect.unknowns[axis].value for axis in AXES])
        per_unit = R_bs.T @ too_much_b / np.array(c.scale)
        for name, offset, change in zip(
            parameter_names(c.imu).offset, c.offset, per_unit, strict=True
        ):
            words = said(effect, offset, float(change))
            out[name] = f"{out[name]}; {words}" if name in out else words
    return out


def _step(effect: Effect, offset: float, change: float) -> str:
    t = effect.unknowns["time"].value
    return f"{offset:.4f} until {t:.0f} s, {offset + change:.4f} from then on"


def _drift(effect: Effect, offset: float, change: float) -> str:
    said = f"{offset:.4f} at {REFERENCE_DEGC:.0f} degC, {change:+.4f} per degree"
    if effect.response_curve is None:
        return said
    low, high = float(np.min(effect.response_curve.x)), float(np.max(effect.response_curve.x))
    return f"{said}, flown from {low:.0f} to {high:.0f} degC"


def _ramp(effect: Effect, offset: float, change: float) -> str:
    said = f"{offset:.4f} at 0 s"
    if effect.response_curve is None:
        return f"{said}, {60.0 * change:+.4f} per minute"
    end = float(np.max(effect.response_curve.x))
    return f"{said}, {offset + change * end:.4f} at {end:.0f} s"


_SAID = {"bias_step": _step, "temperature_drift": _drift, "bias_ramp": _ramp}
