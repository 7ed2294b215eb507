"""Diagnoses made by hand."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from onboard.answers.advice import Advice, advise
from onboard.answers.answer import Answer
from onboard.core.diagnosis.records import (
    Ambiguity,
    Diagnosis,
    Mismatch,
    NotTestable,
    RegimeResidual,
    Rung,
    Series,
    Verdict,
)
from onboard.core.estimate.result import Calibration, Coverage, Estimate, Status
from onboard.core.physics.finding import Confounder, Finding, Quantity, Where

NAN = float("nan")
SIGMAS = (0.001, 0.001, 0.028, 0.01, 0.01, 0.274)
TOGETHER = {(2, 5): -0.999, (5, 2): -0.999}
"""Correlation of z scale and z offset: they only show up together."""
IN_FORCE = {
    "AHRS_TRIM_X": 0.0,
    "AHRS_TRIM_Y": 0.0,
    "GPS1_DELAY_MS": 0.0,
    "GPS1_POS_X": 0.0,
    "GPS1_POS_Y": 0.0,
    "GPS1_POS_Z": 0.0,
}
"""What a recording has of the autopilot's parameters beside the six."""


def calibration(**changed: object) -> Calibration:
    values: dict[str, object] = {
        "imu": 1,
        "status": Status.CALIBRATED,
        "scale": (1.01234567, 0.99, 1.002),
        "offset": (0.2, -0.1, 0.05),
        "scale_sigma": SIGMAS[:3],
        "offset_sigma": SIGMAS[3:],
        "covariance": tuple(
            tuple(a * b * TOGETHER.get((i, j), float(i == j)) for j, b in enumerate(SIGMAS))
            for i, a in enumerate(SIGMAS)
        ),
        "observable": (True, True, False, True, True, False),
        "note": "",
        "in_force_scale": (1.0, 1.0, 1.0),
        "in_force_offset": (0.0, 0.0, 0.0),
        "parameters_known": True,
        "timing": {},
        "trusted_s": 100.0,
        "rejected": {},
        "whitened_rms_before": 2.0,
        "whitened_rms_after": 1.0,
        "held_out_before": 2.0,
        "held_out_after": 1.0,
        "predictive_gain": 700.0,
        "velocity_rms_before": 0.5,
        "velocity_rms_after": 0.1,
        "coverage": Coverage(80.0, (80.0,) * 6, "z scale", "climb"),
    }
    return Calibration(**(values | changed))  # type: ignore[arg-type]  # a table of fields


def effect(name: str = "gps_latency", **changed: object) -> Finding:
    values: dict[str, object] = {
        "name": name,
        "unknowns": {"delay": Quantity(0.21, 0.004, "s")},
        "share_of_mismatch": 0.83,
        "delta_bic": -812.0,
        "held_out_before": 2.5,
        "held_out_after": 1.2,
        "held_out_velocity_before": 0.64,
        "held_out_velocity_after": 0.055,
        "parameters": {"GPS1_DELAY_MS": 210.0},
        "cure": "set GPS1_DELAY_MS",
        "where": (Where(10.0, 20.0, "body_x", "turning", 0.4),),
        "confounders": (Confounder("gps_smoothing", 55.0),),
        "intervals": ((30.0, 40.0),),
    }
    return Finding(**(values | changed))  # type: ignore[arg-type]  # a table of fields


def diagnosis(*, n: int = 20000, **changed: object) -> Diagnosis:
    t = np.arange(n) * 0.2
    before = np.column_stack([np.sin(t / k) for k in (3.0, 5.0, 7.0)])
    before[n // 3 : n // 2, 1] = np.nan
    values: dict[str, object] = {
        "imu": 1,
        "verdict": Verdict.EXPLAINED,
        "calibration": calibration(),
        "timing": {"gps_delay": Estimate(0.21, 0.004)},
        "mismatch": Mismatch(
            detected=True,
            whitened_rms_before=2.4,
            whitened_rms_after=1.02,
            p_value=0.0,
            velocity_rms_before=0.61,
            velocity_rms_after=0.05,
            held_out_before=2.5,
            held_out_after=1.05,
            where=(Where(10.0, 20.0, "body_x", "turning", 0.4),),
            held_out_velocity_before=0.65,
            held_out_velocity_after=0.055,
        ),
        "effects": (effect(),),
        "ambiguous": (),
        "not_testable": (NotTestable("temperature_drift", "no temperature in the recording"),),
        "ladder": (
            Rung("six numbers only", 2.4, 2.5, 0.61, 0.65),
            Rung("+ gps_latency", 1.02, 1.05, 0.05, 0.055),
        ),
        "regimes": (RegimeResidual("turning", 60.0, 3.0, 1.0, 0.6, 0.05),),
        "series": Series(t, before, 0.1 * before, np.zeros(n, dtype=bool)),
        "note": "",
    }
    return Diagnosis(**(values | changed))  # type: ignore[arg-type]  # a table of fields


def unknown() -> Diagnosis:
    """Nothing is finite that may not be."""
    nothing = np.full((50, 3), np.nan)
    return diagnosis(
        verdict=Verdict.UNEXPLAINED,
        calibration=calibration(
            scale=(NAN,) * 3,
            offset=(NAN,) * 3,
            scale_sigma=(NAN,) * 3,
            offset_sigma=(float("inf"),) * 3,
            observable=(True,) * 6,
        ),
        timing={"gps_delay": Estimate(NAN, NAN)},
        mismatch=Mismatch(
            detected=False,
            whitened_rms_before=NAN,
            whitened_rms_after=NAN,
            p_value=NAN,
            velocity_rms_before=NAN,
            velocity_rms_after=NAN,
            held_out_before=NAN,
            held_out_after=NAN,
            where=(Where(NAN, NAN, "body_x", "turning", NAN),),
        ),
        effects=(
            effect(
                unknowns={"delay": Quantity(NAN, NAN, "s"), "roll": Quantity(0.1, NAN, "rad")},
                share_of_mismatch=NAN,
                delta_bic=NAN,
                held_out_before=NAN,
                held_out_after=NAN,
                held_out_velocity_before=NAN,
                held_out_velocity_after=NAN,
                parameters={"GPS1_DELAY_MS": NAN},
                confounders=(Confounder("gps_smoothing", NAN),),
                intervals=((NAN, NAN),),
            ),
        ),
        ladder=(Rung("six numbers only", NAN, NAN),),
        regimes=(RegimeResidual("turning", NAN, NAN, NAN),),
        series=Series(np.arange(50.0), nothing, nothing, np.ones(50, dtype=bool)),
    )


def told_apart_not() -> Diagnosis:
    return diagnosis(
        ambiguous=(Ambiguity(("gps_latency", "imu_delay"), "fly banked turns both ways"),)
    )


def advice_on(made: Diagnosis, parameters: Mapping[str, float] = IN_FORCE) -> Advice:
    """What the policy says of it; the status is as it was made."""
    return advise((Answer(made),), parameters)[0]
