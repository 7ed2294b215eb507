"""Why the autopilot refuses to arm: ArduPilot's rules that calibration has to do with."""

from __future__ import annotations

import numpy as np

from sitl.builtin.instant import ACCEL_STEMS, Corrections
from sitl.builtin.params import ParameterStore
from sitl.builtin.world import Piece

DEVICE_IDS = (2753028, 2753036, 2753044)


def refusals(
    parameters: ParameterStore, corrections: Corrections, piece: Piece, row: int, *, gps: bool
) -> list[str]:
    """Texts of the failed checks; empty when it may arm."""
    if not parameters["ARMING_CHECK"]:
        return []
    out = []
    readings = []
    for index, stem in enumerate(ACCEL_STEMS[: len(piece.imus)]):
        if not parameters["INS_USE" + ("" if index == 0 else str(index + 1))]:
            continue
        calibrated = parameters[stem + "_ID"] == DEVICE_IDS[index]
        if not calibrated or not any(parameters.vector(stem + "OFFS_")):
            out.append("3D Accel calibration needed")
            continue
        recent = piece.imus[index].filtered[max(0, row - 500) : row + 1].mean(axis=0)
        readings.append(np.array(corrections.apply(index, recent)))
    threshold = parameters["ARMING_ACCTHRESH"] * np.array([1.0, 1.0, 2.0])
    if any(np.any(np.abs(f - readings[0]) > threshold) for f in readings[1:]):
        out.append("Accels inconsistent")
    if not gps:
        out.append("GPS 1: Bad fix")
    return out
