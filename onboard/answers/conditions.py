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
from onboard.core.physics.catalogue import kind_of
from onboard.core.physics.effect import AXES, Bearing


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
        kind = kind_of(effect.name)
        if kind is None or kind.bearing is not Bearing.NO_ONE_NUMBER or R_bs is None:
            continue
        if not set(AXES) <= effect.unknowns.keys():
            continue
        too_much_b = np.array([effect.unknowns[axis].value for axis in AXES])
        per_unit = R_bs.T @ too_much_b / np.array(c.scale)
        for name, offset, change in zip(
            parameter_names(c.imu).offset, c.offset, per_unit, strict=True
        ):
            words = kind.condition(effect, offset, float(change))
            if not words:
                continue
            out[name] = f"{out[name]}; {words}" if name in out else words
    return out
