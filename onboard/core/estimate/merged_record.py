"""From flights that agree to the one record that people and the push see."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from onboard.core.estimate.calibration_status import good_enough
from onboard.core.estimate.joint import FLOOR
from onboard.core.estimate.merged_flights import Merged, raw_of
from onboard.core.estimate.observability import Needs, Observability, assess
from onboard.core.estimate.result import (
    Calibration,
    DeadReckoning,
    Estimate,
    Status,
)
from onboard.core.maths.accelerometer import (
    SixParameters,
    linear_of,
    parameters_jacobian,
    parameters_of,
)
from onboard.core.maths.arrays import Array, Vector3, vector3

UNKNOWN: Final = (math.nan, math.nan, math.nan)
"""Three numbers that nobody can say."""


def merged_calibration(
    flights: Sequence[Calibration],
    found: Merged,
    in_force: SixParameters,
    needs: Needs,
    kind: str = "",
) -> tuple[Calibration, Observability]:
    """One calibration of the flights that count, and what they show together.

    Times and counts are added, residuals are root mean squares over the trusted time, evidence
    against the parameters in force is that of all flights.  Timing and certificates stay with
    their flights.

    Args:
        flights: those that count (at least one), residuals against ``in_force``.
        found: what they say together.
        in_force: the parameters that the autopilot used last.
        needs: what was known before and what is needed.
        kind: of the vehicle, for the advice.
    """
    # All flights have flown with the same gyroscope: its share does not become less.
    floor = np.diag(FLOOR**2 + np.square(flights[-1].gyro_sigma))
    made = with_six(flights[-1], found.estimate, found.covariance, floor)
    back = np.linalg.inv(parameters_jacobian(found.estimate))
    seen = assess(back.T @ found.information @ back, needs, kind)
    seconds = [c.trusted_s for c in flights]
    made = replace(
        made,
        status=Status.INSUFFICIENT,
        believed=True,
        observable=seen.observed,
        note=seen.note,
        in_force_scale=in_force.scale,
        in_force_offset=in_force.offset,
        parameters_known=any(c.parameters_known for c in flights),
        timing={},
        trusted_s=sum(seconds),
        rejected=dict(sum((Counter(c.rejected) for c in flights), Counter[str]())),
        whitened_rms_before=_rms([c.whitened_rms_before for c in flights], seconds),
        whitened_rms_after=_rms([c.whitened_rms_after for c in flights], seconds),
        held_out_before=_rms([c.held_out_before for c in flights], seconds),
        held_out_after=_rms([c.held_out_after for c in flights], seconds),
        velocity_rms_before=_rms([c.velocity_rms_before for c in flights], seconds),
        velocity_rms_after=_rms([c.velocity_rms_after for c in flights], seconds),
        coverage=seen.coverage,
        load_mean=_mean([c.load_mean for c in flights], seconds),
        load_square=_mean([c.load_square for c in flights], seconds),
        predictive_gain=sum(c.predictive_gain for c in flights),
        certificate=None,
        dead_reckoning=_dead_reckoning([c.dead_reckoning for c in flights]),
        temperature=_temperature(flights, seconds),
    )
    if good_enough(made, needs):
        made = replace(made, status=Status.CALIBRATED)
    return made, seen


def unknown_six(c: Calibration, in_force: SixParameters) -> Calibration:
    """The record of an accelerometer of whose flights nobody can say which are right."""
    nothing = Calibration.unanswered(
        c.imu, in_force, c.note, parameters_known=c.parameters_known, coverage=c.coverage
    )
    return replace(
        nothing,
        scale=UNKNOWN,
        offset=UNKNOWN,
        trusted_s=c.trusted_s,
        rejected=c.rejected,
        prior_sigma=c.prior_sigma,
        load_mean=c.load_mean,
        load_square=c.load_square,
        temperature=c.temperature,
        extra=c.extra,
    )


def of_raw(c: Calibration, applied: SixParameters) -> Calibration:
    """The record of the raw sensor, if its samples were not raw but ``applied`` to them."""
    s, o, T = np.array(applied.scale), np.array(applied.offset), raw_of(applied)
    x = linear_of(np.array(c.scale + c.offset))
    back = T @ np.linalg.inv(parameters_jacobian(x))
    mean, square = np.array(c.load_mean), np.array(c.load_square)
    gyro = np.diag(np.square(c.gyro_sigma))
    made = with_six(c, T @ x, back @ c.with_its_gyroscope @ back.T, gyro)
    return replace(
        made,
        in_force_scale=applied.scale,
        in_force_offset=applied.offset,
        load_mean=vector3(mean / s + o),
        load_square=vector3(square / s**2 + 2.0 * o * mean / s + o**2),
    )


def with_six(c: Calibration, linear: Array, covariance: Array, floor: Array) -> Calibration:
    """The record with other numbers: (6,) scale and beta, (6, 6) of them, (6, 6) of the six."""
    six, J = parameters_of(linear), parameters_jacobian(linear)
    P = J @ covariance @ J.T + floor
    P = (P + P.T) / 2
    sigma = np.sqrt(np.diag(P))
    return replace(
        c,
        scale=vector3(six[:3]),
        offset=vector3(six[3:]),
        scale_sigma=vector3(sigma[:3]),
        offset_sigma=vector3(sigma[3:]),
        covariance=tuple(tuple(float(x) for x in row) for row in P),
    )


def _rms(values: Sequence[float], weights: Sequence[float]) -> float:
    """Root mean square of those that are numbers; NaN if none is."""
    pairs = [(v, w) for v, w in zip(values, weights, strict=True) if math.isfinite(v) and w > 0.0]
    if not pairs:
        return float("nan")
    return math.sqrt(sum(w * v * v for v, w in pairs) / sum(w for _, w in pairs))


def _mean(values: Sequence[Vector3], weights: Sequence[float]) -> Vector3:
    return vector3(np.average(np.array(values), axis=0, weights=np.maximum(weights, 1e-9)))


def _dead_reckoning(every: Sequence[DeadReckoning | None]) -> DeadReckoning | None:
    """Mean drift over the windows of all flights."""
    there = [d for d in every if d is not None and d.windows]
    if not there:
        return None
    windows = [d.windows for d in there]
    return DeadReckoning(
        there[0].horizon_s,
        float(np.average([d.drift_before for d in there], weights=windows)),
        float(np.average([d.drift_after for d in there], weights=windows)),
        sum(windows),
    )


def _temperature(flights: Sequence[Calibration], seconds: Sequence[float]) -> Estimate | None:
    """Mean and spread over all flights."""
    there = [(c.temperature, w) for c, w in zip(flights, seconds, strict=True) if c.temperature]
    if not there:
        return None
    values, weights = [t.value for t, _ in there], [max(w, 1e-9) for _, w in there]
    mean = float(np.average(values, weights=weights))
    square = np.average([t.value**2 + t.sigma**2 for t, _ in there], weights=weights)
    return Estimate(mean, math.sqrt(max(float(square) - mean**2, 0.0)))
