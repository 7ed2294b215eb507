"""An accelerometer's calibration as the snapshot shows it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import cast

from onboard.answers.calibration_document import worth_document
from onboard.answers.knowledge import seen
from onboard.core.estimate.result import SIX_NAMES, Calibration, Estimate, Six
from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.view.numbers import finite
from onboard.daemon.view.snapshot import (
    CalibrationView,
    CoverageView,
    ImuView,
    Number,
    Three,
)
from onboard.daemon.view.state import ALONE, Circumstances, state_of

SAME = 1e-6
"""Parameters are float32."""


def imu_view(
    calibration: Calibration,
    circumstances: Circumstances = ALONE,
    parameters: Mapping[str, float] | None = None,
) -> ImuView:
    """One accelerometer's answer for people; what is not finite becomes None.

    Args:
        calibration: the answer; the learner's thread may be busy and it some minutes old.
        circumstances: proposal, push and flight.
        parameters: the autopilot's, as read last.  Where they are not those that the answer was
            compared with, nothing is known yet of the residual with them.
    """
    c = calibration
    in_force = _in_force(c, parameters or {})
    current = in_force == c.in_force_scale + c.in_force_offset
    return ImuView(
        imu=c.imu,
        status=c.status.value,
        state=state_of(c, circumstances),
        calibration=_calibration_view(c),
        in_force_scale=_three(in_force[:3]),
        in_force_offset=_three(in_force[3:]),
        parameters_known=c.parameters_known,
        timing={name: _number(estimate) for name, estimate in c.timing.items()},
        trusted_s=c.trusted_s,
        rejected=c.rejected,
        whitened_rms_before=finite(c.whitened_rms_before) if current else None,
        whitened_rms_after=finite(c.whitened_rms_after),
        held_out_before=finite(c.held_out_before) if current else None,
        held_out_after=finite(c.held_out_after),
        velocity_rms_before_m_s=finite(c.velocity_rms_before) if current else None,
        velocity_rms_after_m_s=finite(c.velocity_rms_after),
        coverage=_coverage_view(c),
        certificate=_certificate_view(c),
        dead_reckoning=_dead_reckoning_view(c, current=current),
        temperature=None if c.temperature is None else _number(c.temperature),
    )


def _calibration_view(c: Calibration) -> CalibrationView:
    named = zip(parameter_names(c.imu).six, c.scale + c.offset, strict=True)
    return CalibrationView(
        scale=_three(c.scale),
        offset=_three(c.offset),
        scale_sigma=_three(c.scale_sigma),
        offset_sigma=_three(c.offset_sigma),
        parameters={name: value for name, value in named if math.isfinite(value)},
        observable=c.observable,
        known=seen(c),
        worth=worth_document(c),
        note=c.note,
    )


def _coverage_view(c: Calibration) -> CoverageView:
    return CoverageView(
        percent=c.coverage.percent,
        per_parameter=dict(zip(SIX_NAMES, c.coverage.per_parameter, strict=True)),
        weakest=c.coverage.weakest,
        advice=c.coverage.advice,
    )


def _certificate_view(c: Calibration) -> dict[str, float | None] | None:
    certificate = c.certificate
    if certificate is None:
        return None
    return {
        "window_s": finite(certificate.window_s),
        "residual_l2": finite(certificate.residual_l2),
        "acceleration_bound_m_s2": finite(certificate.acceleration_bound),
        "uniform_bound_m_s": finite(certificate.uniform_bound),
        "observed_max_m_s": finite(certificate.observed_max),
    }


def _dead_reckoning_view(c: Calibration, *, current: bool) -> dict[str, float | None] | None:
    """Drift without GPS; ``current``: the values in force are those that it was computed for."""
    drift = c.dead_reckoning
    if drift is None:
        return None
    return {
        "horizon_s": finite(drift.horizon_s),
        "drift_before_m_s": finite(drift.drift_before) if current else None,
        "drift_after_m_s": finite(drift.drift_after),
        "windows": drift.windows,
    }


def _in_force(c: Calibration, parameters: Mapping[str, float]) -> Six:
    """The six that the autopilot uses: as read last, else those of the calibration."""
    known = c.in_force_scale + c.in_force_offset
    names = parameter_names(c.imu).six
    if not c.parameters_known or not parameters.keys() >= set(names):
        return known
    read = tuple(parameters[name] for name in names)
    # The autopilot's are float32; the same number is no other value.
    same = all(abs(a - b) <= SAME for a, b in zip(read, known, strict=True))
    return known if same else cast("Six", read)


def _three(values: tuple[float, float, float]) -> Three:
    x, y, z = values
    return (finite(x), finite(y), finite(z))


def _number(estimate: Estimate) -> Number:
    return Number(value=finite(estimate.value), sigma=finite(estimate.sigma))
