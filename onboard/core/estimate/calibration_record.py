"""From an engine's sums to the record that people and the push see."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.estimate.calibration_status import force_known, judged
from onboard.core.estimate.certificate import certify
from onboard.core.estimate.dead_reckoning import Drift, free_drift
from onboard.core.estimate.determined import flown_loads
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.gyro_axes import gyro_sigma
from onboard.core.estimate.limits import (
    APART_S,
    LONG_DRIFT_S,
    LONG_DRIFTS,
    OFFSET_FLOOR,
    SCALE_FLOOR,
    SHORT_DRIFT_S,
    SHORT_DRIFTS,
    TIMING_FLOOR_S,
)
from onboard.core.estimate.observability import assess
from onboard.core.estimate.result import (
    Calibration,
    Certificate,
    DeadReckoning,
    Estimate,
    Six,
    Status,
)
from onboard.core.estimate.solution import Solution, fitted_rms, held_out
from onboard.core.inputs.limits import LONGEST_FIX_GAP_S
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.maths.accelerometer import (
    SixParameters,
    parameters_jacobian,
    parameters_of,
)
from onboard.core.maths.arrays import Array, Vector3, vector3


def calibration_of(
    imu: int,
    engine: Engine,
    parameters: ParametersInForce,
    *,
    finished: bool,
    rejected: dict[str, int],
    kind: str = "",
    left_open: Array | None = None,
) -> Calibration:
    """Everything about one accelerometer, cheap enough for once a second.

    Args:
        imu: which accelerometer.
        engine: has its sums.
        parameters: in force.
        finished: whether no more flight will come.
        rejected: what was refused before it reached the engine, by name.
        kind: of the vehicle, for the advice.
        left_open: (6, 6) variance of scale and beta that the model itself leaves open; None:
            nothing.

    Raises:
        KeyError: no flight was processed.
    """
    in_force = parameters.six(imu).as_linear()
    residuals = _residuals(engine, _solved(engine, imu), in_force)
    return _record(
        imu,
        engine,
        parameters,
        residuals,
        finished=finished,
        rejected=rejected,
        kind=kind,
        left_open=left_open,
    )


def known_well_enough(imu: int, engine: Engine, parameters: ParametersInForce) -> bool:
    """Whether it is calibrated, and no more flight is needed; without what takes time to say.

    Raises:
        KeyError: no flight was processed.
    """
    made = _record(imu, engine, parameters, _NOT_ASKED, finished=False, rejected={}, kind="")
    return made.status is Status.CALIBRATED and force_known(made, engine.settings.needs)


def _record(
    imu: int,
    engine: Engine,
    parameters: ParametersInForce,
    residuals: _Residuals,
    *,
    finished: bool,
    rejected: dict[str, int],
    kind: str,
    left_open: Array | None = None,
) -> Calibration:
    solution, in_force = _solved(engine, imu), parameters.six(imu)
    value, gyro = parameters_of(solution.theta), gyro_sigma(parameters.R_bs)
    covariance, load = claimed_covariance(solution, gyro, left_open), flown_loads(engine.batches)
    seen = assess(six_information(solution, left_open), engine.settings.needs, kind)
    made = Calibration(
        imu=imu,
        status=Status.INSUFFICIENT if finished else Status.COLLECTING,
        scale=vector3(value[:3]),
        offset=vector3(value[3:]),
        scale_sigma=vector3(np.sqrt(np.diag(covariance)[:3])),
        offset_sigma=vector3(np.sqrt(np.diag(covariance)[3:])),
        covariance=tuple(tuple(float(x) for x in row) for row in covariance),
        observable=seen.observed,
        note=seen.note,
        in_force_scale=in_force.scale,
        in_force_offset=in_force.offset,
        parameters_known=parameters.known(imu),
        timing=timing_of(engine, solution),
        trusted_s=engine.trusted_s,
        rejected=_refused(rejected, engine.refused),
        whitened_rms_before=residuals.fitted[0],
        whitened_rms_after=residuals.fitted[1],
        held_out_before=residuals.held_out[0],
        held_out_after=residuals.held_out[1],
        velocity_rms_before=residuals.velocity[0],
        velocity_rms_after=residuals.velocity[1],
        coverage=seen.coverage,
        prior_sigma=_six(engine.settings.needs.prior),
        gyro_sigma=_six(gyro),
        gyro_scale=_gyro_scale(engine, solution),
        alike_sigma=_alike(engine),
        load_mean=load[0],
        load_square=load[1],
        predictive_gain=residuals.predictive_gain,
        certificate=_certificate(engine),
        dead_reckoning=residuals.dead_reckoning,
        temperature=_temperature(engine),
    )
    return judged(made, engine, solution, parameters)


def _alike(engine: Engine) -> Vector3:
    """What the model's families take for beta in all flights of the sensor, sigmas."""
    every = [f.alike for f in engine.model.families if f.alike is not None]
    return vector3(np.linalg.norm(np.array(every).reshape(-1, 3), axis=0))


@dataclass(frozen=True, slots=True)
class _Residuals:
    """What is left with the six in force, and with the estimate: pairs, RMS."""

    fitted: tuple[float, float]
    held_out: tuple[float, float]
    velocity: tuple[float, float]
    predictive_gain: float
    dead_reckoning: DeadReckoning | None


_NONE = (math.nan, math.nan)
_NOT_ASKED = _Residuals(_NONE, _NONE, _NONE, math.nan, None)


def _residuals(engine: Engine, solution: Solution, in_force: Array) -> _Residuals:
    """Residuals of an engine's blocks; ``in_force`` (6,) is scale and beta."""
    held = {i: float(x) for i, x in enumerate(in_force)}
    blocks, model = engine.all_blocks, engine.model
    without, with_it = held_out(blocks, model, held), held_out(blocks, model)
    # Twice a difference of log-likelihoods is one of squares, as far as they are independent.
    independent = solution.rows / solution.variance_inflation
    long, short = _drifts(engine, in_force, solution.theta[:6])
    nan = float("nan")
    return _Residuals(
        fitted=(fitted_rms(blocks, model, held), fitted_rms(blocks, model)),
        held_out=(without, with_it),
        velocity=(nan, nan) if short is None else (float(short.rms[0]), float(short.rms[1])),
        predictive_gain=independent * (without**2 - with_it**2) / 2.0,
        dead_reckoning=_dead_reckoning(long),
    )


def _six(values: Array) -> Six:
    a, b, c, d, e, f = (float(v) for v in values)
    return a, b, c, d, e, f


def _solved(engine: Engine, imu: int) -> Solution:
    solution = engine.solution()
    if solution is None:
        raise KeyError(imu)
    return solution


def _refused(before: Mapping[str, int], gates: Mapping[str, int]) -> dict[str, int]:
    """Counts of what was refused on the way and by the gates, by name."""
    names = {
        "velocity": "innovation",
        "height": "height_innovation",
        "tilt": "tilt_set_anew",
        "heading": "heading_set_anew",
    }
    refused = Counter(before)
    for name, count in gates.items():
        refused[names.get(name, name)] += count
    return dict(refused)


def six_covariance(solution: Solution) -> Array:
    """Covariance (6, 6) of scale (1) and offset (m/s^2), with a floor for what no model knows.

    It is of those that fit the gyroscope, whose axes are taken for right: see :func:`gyro_sigma`.
    """
    J = parameters_jacobian(solution.theta)
    C = J @ solution.covariance[:6, :6] @ J.T
    floor = np.array([SCALE_FLOOR**2] * 3 + [OFFSET_FLOOR**2] * 3)
    out: Array = C + np.diag(floor)
    return out


def claimed_covariance(solution: Solution, gyro: Array, left_open: Array | None = None) -> Array:
    """The same, of what a bench would find.

    Args:
        solution: of the sums.
        gyro: (6,) of :func:`~onboard.core.estimate.gyro_axes.gyro_sigma`.
        left_open: as for :func:`calibration_of`.
    """
    return six_covariance(solution) + np.diag(gyro**2) + _of_parameters(solution, left_open)


def _of_parameters(solution: Solution, left_open: Array | None) -> Array:
    """(6, 6) a variance of scale and beta as one of scale and offset; None: nothing."""
    if left_open is None:
        return np.zeros((6, 6))
    J = parameters_jacobian(solution.theta)
    out: Array = J @ left_open @ J.T
    return out


def six_information(solution: Solution, left_open: Array | None = None) -> Array:
    """Information (6, 6) on scale and offset from the data alone, nuisances eliminated."""
    N = solution.information
    nuisance = np.linalg.inv(solution.covariance)[6:, 6:]
    # The nuisances keep their priors: the covariance of everything has them, the data do not.
    cross = N[:6, 6:]
    S = N[:6, :6] - cross @ np.linalg.solve(nuisance, cross.T)
    back = np.linalg.inv(parameters_jacobian(solution.theta))
    out: Array = back.T @ S @ back
    # Of a sum of errors, where neither the data nor what is left open knows every direction.
    out = out @ np.linalg.inv(np.eye(6) + _of_parameters(solution, left_open) @ out)
    return (out + out.T) / 2


def _gyro_scale(engine: Engine, solution: Solution) -> tuple[Estimate, ...]:
    """By what share of the true rate each axis reads too much; the unknowns are of the reading."""
    at = engine.model.slices["gyro_scale"]
    left = 1.0 - solution.theta[at]
    sigma = np.sqrt(np.diag(solution.covariance)[at]) / left**2
    return tuple(map(Estimate, (1.0 / left - 1.0).tolist(), sigma.tolist()))


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
            engine.point.delay + float(solution.theta[delay]),
            float(np.hypot(sigma[delay], TIMING_FLOOR_S)),
        ),
        "gps_smoothing_window_s": Estimate(window, window_sigma),
        "imu_delay_s": Estimate(
            engine.point.attitude_delay + float(solution.theta[attitude]),
            float(np.hypot(sigma[attitude], TIMING_FLOOR_S)),
        ),
    }


def judged_by(made: Calibration, engine: Engine, in_force: SixParameters) -> Calibration:
    """The same with its residuals against other parameters than those in force in the flight.

    Args:
        made: the calibration of ``engine``.
        engine: has its sums.
        in_force: what the estimate is to be better than.

    Raises:
        KeyError: no flight was processed.
    """
    residuals = _residuals(engine, _solved(engine, made.imu), in_force.as_linear())
    return replace(
        made,
        whitened_rms_before=residuals.fitted[0],
        held_out_before=residuals.held_out[0],
        velocity_rms_before=residuals.velocity[0],
        predictive_gain=residuals.predictive_gain,
        dead_reckoning=residuals.dead_reckoning,
    )


def _certificate(engine: Engine) -> Certificate | None:
    if len(engine.states) < 2:
        return None
    t = engine.states.t
    residual = np.nan_to_num(engine.states.innovation)
    # A reboot or another file sets the clock back: windows of their own, on a clock that goes on.
    back = np.flatnonzero(np.diff(t) <= 0.0) + 1
    for i in back:
        t[i:] += t[i - 1] - t[i] + APART_S
    return certify(t, residual, gap=LONGEST_FIX_GAP_S)


def _drifts(engine: Engine, before: Array, after: Array) -> tuple[Drift | None, Drift | None]:
    """Free drift over a long and a short horizon; ``before``, ``after`` (6,) are scale, beta."""
    chain = engine.intervals.of([(c.segment, c.fixes) for c in engine.batches], engine.point)
    states = list(engine.states)
    return (
        free_drift(chain, states, (before, after), horizon_s=LONG_DRIFT_S, most=LONG_DRIFTS),
        free_drift(chain, states, (before, after), horizon_s=SHORT_DRIFT_S, most=SHORT_DRIFTS),
    )


def _dead_reckoning(drift: Drift | None) -> DeadReckoning | None:
    """How far velocity drifts without GPS, before and after."""
    if drift is None:
        return None
    return DeadReckoning(drift.horizon_s, float(drift.end[0]), float(drift.end[1]), drift.windows)


def _temperature(engine: Engine) -> Estimate | None:
    slow = [c.segment.slow for c in engine.batches]
    values = [s["temperature"][1] for s in slow if "temperature" in s]
    if not values:
        return None
    every = np.concatenate(values)
    return Estimate(float(every.mean()), float(every.std()))
