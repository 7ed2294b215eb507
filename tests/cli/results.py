"""Calibrations for tests of what is shown and written."""

from __future__ import annotations

import math
from dataclasses import replace

from onboard.core.estimate.result import (
    Calibration,
    Certificate,
    Coverage,
    DeadReckoning,
    Estimate,
    Status,
)

SIGMAS = (0.0011, 0.0012, 0.0280, 0.004, 0.005, 0.274)
TOGETHER = -0.999
"""Correlation of z scale and z offset, which only show up together."""
COVARIANCE = tuple(
    tuple(
        a * b * (1.0 if i == j else TOGETHER if {i, j} == {2, 5} else 0.0)
        for j, b in enumerate(SIGMAS)
    )
    for i, a in enumerate(SIGMAS)
)

CALIBRATED = Calibration(
    imu=1,
    status=Status.CALIBRATED,
    scale=(1.024, 0.987, 1.011),
    offset=(0.221, -0.154, 0.302),
    scale_sigma=SIGMAS[:3],
    offset_sigma=SIGMAS[3:],
    covariance=COVARIANCE,
    observable=(True, True, False, True, True, False),
    note="z scale and z offset cannot be told apart",
    in_force_scale=(1.001, 1.001, 1.001),
    in_force_offset=(0.001, 0.001, 0.001),
    parameters_known=True,
    timing={"gps_delay_s": Estimate(0.081, 0.002), "imu_delay_s": Estimate(0.003, math.inf)},
    trusted_s=251.0,
    rejected={"no_fix": 12, "gps_glitch": 3},
    whitened_rms_before=2.4,
    whitened_rms_after=1.02,
    held_out_before=2.5,
    held_out_after=1.05,
    velocity_rms_before=0.61,
    velocity_rms_after=0.05,
    coverage=Coverage(83.0, (90.0, 88.0, 40.0, 91.0, 90.0, 45.0), "z scale", "fly banked turns"),
    certificate=Certificate(251.0, 0.4, 1.1, 0.9, 0.31),
    dead_reckoning=DeadReckoning(60.0, 12.1, 0.4, 3),
)

NOTHING_KNOWN = replace(
    CALIBRATED,
    imu=2,
    status=Status.INSUFFICIENT,
    scale=(math.nan,) * 3,
    offset=(math.nan,) * 3,
    scale_sigma=(math.inf,) * 3,
    offset_sigma=(math.inf,) * 3,
    observable=(False,) * 6,
    parameters_known=False,
    timing={},
    trusted_s=0.0,
    rejected={},
    whitened_rms_before=math.nan,
    whitened_rms_after=math.nan,
    held_out_before=math.nan,
    held_out_after=math.nan,
    velocity_rms_before=math.nan,
    velocity_rms_after=math.nan,
    coverage=Coverage(0.0, (0.0,) * 6, "x scale", "take off"),
    certificate=None,
    dead_reckoning=None,
)
