"""Calibrations for tests: a good one, and what makes it less so."""

from dataclasses import replace

import numpy as np

from onboard.core.estimate.result import Calibration, Coverage, Status
from onboard.core.maths.accelerometer import parameter_names

SCALE = (1.013, 0.988, 1.007)
OFFSET = (0.15, -0.21, 0.08)
SIGMAS = (0.001, 0.001, 0.002, 0.008, 0.008, 0.02)


def covariance(sigmas=SIGMAS, correlations=()):
    """(6, 6) as tuples; ``correlations``: (i, j, rho)."""
    R = np.eye(6)
    for i, j, rho in correlations:
        R[i, j] = R[j, i] = rho
    P = R * np.outer(sigmas, sigmas)
    return tuple(tuple(float(v) for v in row) for row in P)


def calibration(**changes):
    good = Calibration(
        imu=1,
        status=Status.CALIBRATED,
        scale=SCALE,
        offset=OFFSET,
        scale_sigma=SIGMAS[:3],
        offset_sigma=SIGMAS[3:],
        covariance=covariance(),
        observable=(True,) * 6,
        note="",
        in_force_scale=(1.0, 1.0, 1.0),
        in_force_offset=(0.02, -0.03, 0.04),
        parameters_known=True,
        timing={},
        trusted_s=300.0,
        rejected={},
        whitened_rms_before=2.0,
        whitened_rms_after=1.0,
        held_out_before=2.1,
        held_out_after=1.05,
        velocity_rms_before=0.5,
        velocity_rms_after=0.05,
        predictive_gain=900.0,
        coverage=Coverage(100.0, (100.0,) * 6, "z scale", ""),
    )
    return replace(good, **changes)


def current(imu=1, scale=(1.0, 1.0, 1.0), offset=(0.02, -0.03, 0.04), device=3e6):
    names = parameter_names(imu)
    values = dict(zip(names.six, (*scale, *offset), strict=True))
    return values | {names.device_id: device}
