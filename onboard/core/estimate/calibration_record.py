"""From an engine's sums to the record that people and the push see."""

from __future__ import annotations

import numpy as np

from onboard.core.estimate.certificate import certify
from onboard.core.estimate.dead_reckoning import Drift, free_drift, intervals
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.observability import Observability, assess
from onboard.core.estimate.result import (
    Calibration,
    Certificate,
    DeadReckoning,
    Estimate,
    Status,
)
from onboard.core.estimate.solution import Solution, fitted_rms, held_out
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.maths.arrays import Array, Vector3

SCALE_FLOOR = 5e-4
OFFSET_FLOOR = 1e-3
"""What the model does not know (filters, interpolation, clocks) limits every flight to this."""
FEWEST_OBSERVED = 3
CONTRADICTION = 6.0
"""Inflation of the variance past which blocks of one flight ask for different parameters."""


def calibration_of(
    imu: int,
    engine: Engine,
    parameters: ParametersInForce,
    *,
    finished: bool,
    rejected: dict[str, int],
    kind: str = "",
) -> Calibration:
    """Everything about one accelerometer, cheap enough for once a second.

    ``kind`` is that of the vehicle, for the advice.
    """
    in_force = parameters.six(imu)
    solution = engine.solution()
    refused = dict(rejected)
    for name, count in engine.refused.items():
        key = {"velocity": "innovation", "height": "height_innovation"}.get(name, name)
        refused[key] = refused.get(key, 0) + count
    if solution is None:
        raise KeyError(imu)
    scale = solution.theta[:3]
    beta = solution.theta[3:6]
    offset = -beta / scale
    covariance = six_covariance(solution)
    seen = assess(six_information(solution), engine.settings.needs, kind)
    status, note = _status(engine, solution, seen, parameters, finished=finished)
    held_scale, held_offset = np.array(in_force.scale), np.array(in_force.offset)
    force_six = np.concatenate([held_scale, -held_scale * held_offset])
    fixed = {i: float(x) for i, x in enumerate(force_six)}
    blocks, model = engine.all_blocks, engine.model
    sigma = np.sqrt(np.diag(covariance))
    long, short = _drifts(engine, force_six, solution.theta[:6])
    return Calibration(
        imu=imu,
        status=status,
        scale=_three(scale),
        offset=_three(offset),
        scale_sigma=_three(sigma[:3]),
        offset_sigma=_three(sigma[3:]),
        covariance=tuple(tuple(float(x) for x in row) for row in covariance),
        observable=seen.observed,
        note=note,
        in_force_scale=in_force.scale,
        in_force_offset=in_force.offset,
        parameters_known=parameters.known(imu),
        timing=timing_of(engine, solution),
        trusted_s=engine.trusted_s,
        rejected=refused,
        whitened_rms_before=fitted_rms(blocks, model, fixed),
        whitened_rms_after=fitted_rms(blocks, model),
        held_out_before=held_out(blocks, model, fixed),
        held_out_after=held_out(blocks, model),
        velocity_rms_before=float("nan") if short is None else float(short.rms[0]),
        velocity_rms_after=float("nan") if short is None else float(short.rms[1]),
        coverage=seen.coverage,
        certificate=_certificate(engine),
        dead_reckoning=None
        if long is None
        else DeadReckoning(long.horizon_s, float(long.end[0]), float(long.end[1]), long.windows),
        temperature=_temperature(engine),
    )


def six_covariance(solution: Solution) -> Array:
    """(6, 6) covariance of (scale, offset) with the floor of what the model does not know."""
    J = offset_jacobian(solution.theta)
    C = J @ solution.covariance[:6, :6] @ J.T
    floor = np.array([SCALE_FLOOR**2] * 3 + [OFFSET_FLOOR**2] * 3)
    out: Array = C + np.diag(floor)
    return out


def six_information(solution: Solution) -> Array:
    """(6, 6) information of the data alone on (scale, offset), nuisances eliminated."""
    N = solution.information
    nuisance = np.linalg.inv(solution.covariance)[6:, 6:]
    # The nuisances keep their priors: the covariance of everything has them, the data do not.
    cross = N[:6, 6:]
    S = N[:6, :6] - cross @ np.linalg.solve(nuisance, cross.T)
    back = np.linalg.inv(offset_jacobian(solution.theta))
    out: Array = back.T @ S @ back
    return (out + out.T) / 2


def offset_jacobian(theta: Array) -> Array:
    """d(scale, offset) / d(scale, beta) at ``theta``; ``offset = -beta / scale``."""
    scale, beta = theta[:3], theta[3:6]
    J = np.zeros((6, 6))
    J[range(3), range(3)] = 1.0
    J[range(3, 6), range(3)] = beta / scale**2
    J[range(3, 6), range(3, 6)] = -1.0 / scale
    return J


def timing_of(engine: Engine, solution: Solution) -> dict[str, Estimate]:
    """GPS latency, averaging span and attitude delay with their sigmas, s."""
    i = engine.model.index
    sigma = np.sqrt(np.diag(solution.covariance))
    delay, square, attitude = i["gps_delay"], i["window_squared"], i["attitude_delay"]
    w2 = engine.point.window**2 + float(solution.theta[square])
    window = float(np.sqrt(max(w2, 0.0)))
    # sqrt has no slope at zero: there its sigma is the root of that of the square.
    spread = float(sigma[square])
    window_sigma = spread / (2.0 * max(window, float(np.sqrt(spread)) / 2.0))
    return {
        "gps_delay_s": Estimate(
            engine.point.delay + float(solution.theta[delay]), float(np.hypot(sigma[delay], 5e-4))
        ),
        "gps_smoothing_window_s": Estimate(window, window_sigma),
        "imu_delay_s": Estimate(
            engine.point.attitude_delay + float(solution.theta[attitude]),
            float(np.hypot(sigma[attitude], 5e-4)),
        ),
    }


def _status(
    engine: Engine,
    solution: Solution,
    seen: Observability,
    parameters: ParametersInForce,
    *,
    finished: bool,
) -> tuple[Status, str]:
    note = seen.note
    if not parameters.representable:
        return Status.INVALID, (
            "AHRS_ORIENTATION is unknown or not a multiple of 90 degrees: scale and offset of the "
            "sensor's axes cannot be separated from here. " + note
        )
    if not engine.moving:
        note = "hovering or standing: fly fast, brake hard, turn both ways. " + note
        return (Status.INSUFFICIENT if finished else Status.COLLECTING), note
    doubt = solution.variance_inflation > CONTRADICTION
    if doubt:
        note = (
            "the flight contradicts itself: something is missing from the model, "
            "see onboard explain. " + note
        )
    enough = engine.trusted_s >= engine.settings.minimum_s and not doubt
    if enough and sum(seen.observed) >= FEWEST_OBSERVED:
        return Status.CALIBRATED, note
    return (Status.INSUFFICIENT if finished else Status.COLLECTING), note


def _certificate(engine: Engine) -> Certificate | None:
    states = list(engine.states)
    if len(states) < 2:
        return None
    t = np.array([s.t for s in states])
    residual = np.array([s.innovation for s in states])
    residual = np.where(np.isnan(residual), 0.0, residual)
    # A reboot or another file sets the clock back: windows of their own, on a clock that goes on.
    back = np.flatnonzero(np.diff(t) <= 0.0) + 1
    for i in back:
        t[i:] += t[i - 1] - t[i] + 10.0
    return certify(t, residual, gap=2.5)


def _drifts(engine: Engine, before: Array, after: Array) -> tuple[Drift | None, Drift | None]:
    """Free drift over 60 s and over 10 s, parameters in force against the estimate."""
    chain = intervals([(c.segment, c.fixes) for c in engine.batches], engine.point)
    states = list(engine.states)
    return (
        free_drift(chain, states, (before, after), horizon_s=60.0),
        free_drift(chain, states, (before, after), horizon_s=10.0, most=12),
    )


def _temperature(engine: Engine) -> Estimate | None:
    slow = [c.segment.slow for c in engine.batches]
    values = [s["temperature"][1] for s in slow if "temperature" in s]
    if not values:
        return None
    every = np.concatenate(values)
    return Estimate(float(every.mean()), float(every.std()))


def _three(x: Array) -> Vector3:
    return (float(x[0]), float(x[1]), float(x[2]))
