"""Flights that are exactly as the estimator assumes them to be, but for chance.

One trajectory of each vehicle is computed once; every flight then draws its own accelerometer,
timing, gyroscope, and noise of each kind in the model: white and coloured GPS velocity, white and
wandering GPS height, white accelerometer and gyroscope, wandering gyroscope bias, white and slow
errors of the recorded attitude.  Nothing is quantised, filtered, vibrating or faulty.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.recorded import Array, Flight
from onboard.core.filter.limits import ATTITUDE_TIME_S, COLOUR_TIME_S
from onboard.core.filter.noise import NoiseLevels
from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample, ParameterValue, Sample
from sitl.builtin import rotation
from sitl.builtin.smoothing import RATE, derivative
from sitl.builtin.trajectory import Trajectory
from sitl.builtin.world import Vehicle
from sitl.recording import FlightSpec, run

IMU_HZ = 50
GPS_HZ = 5
WINDOW_S = 0.2
"""Averaging span of the receiver: about that of common ones."""
START_S = 1.0
"""The first fix; inertial samples come before it."""
LAUNCH_S, LANDING_S = 12.0, 10.0
"""Left out at either end: a launch is a step of the force, which no sampling follows."""
METRES_PER_RADIAN = 6.371e6

LEVELS = NoiseLevels(
    velocity=0.06,
    velocity_colour=0.04,
    height=0.3,
    height_walk=0.08,
    force_walk=0.03,
    lift_walk=0.03,
    shaken_walk=0.01,
    shaken_lift=0.01,
    tilt_walk=4e-4,
    bias_walk=4e-5,
    attitude=0.03,
    heading=0.08,
    heading_time=7.0,
    heading_walk=5e-4,
    jitter=0.008,
)
"""A common receiver and common MEMS; none of the values the search for levels begins with."""

DRAWN_SCALE, DRAWN_OFFSET = 0.02, 0.3
DRAWN_DELAY = (0.05, 0.25)
GYRO_BIAS, GYRO_SCALE, GYRO_DELAY = 0.003, 0.005, 0.003
TILT_OFFSET, HEADING_OFFSET, HEIGHT_DELAY = 0.01, 0.03, 0.05


@dataclass(frozen=True, slots=True)
class Path:
    """What really happens, on the 1 kHz grid: m, s, NED and body axes.

    ``v_gps`` and ``h_gps`` are velocity and height as the receiver averages them.
    """

    vehicle: Vehicle
    t: Array
    R_nb: Array
    w_b: Array
    f_b: Array
    v_n: Array
    p_n: Array
    v_gps: Array
    h_gps: Array
    latitude: float

    @property
    def imu(self) -> slice:
        """Rows at which inertial samples are taken."""
        return slice(0, None, RATE // IMU_HZ)

    @property
    def epochs(self) -> np.ndarray[tuple[int], np.dtype[np.int_]]:
        """Rows at which fixes are valid: all of them inertial samples too."""
        step = RATE // GPS_HZ
        return np.arange(round(START_S * RATE), len(self.t) - RATE, step)


def path(vehicle: Vehicle, *, seed: int = 5, duration: float = 262.0) -> Path:
    """Fly the simulated vehicle once."""
    pieces = run(FlightSpec(vehicle=vehicle, seed=seed, duration=duration)).pieces
    whole = [p.trajectory for p in pieces]
    n = sum(w.n for w in whole)
    latitude = float(np.radians(whole[0].environment.latitude_deg))
    aloft = slice(round(LAUNCH_S * RATE), min(round(duration * RATE), n) - round(LANDING_S * RATE))
    v_n, p_n = _joined(whole, "v_n", aloft), _joined(whole, "p_n", aloft)
    return Path(
        vehicle,
        np.arange(len(v_n)) / RATE,
        _joined(whole, "R_nb", aloft),
        _joined(whole, "w_b", aloft),
        _joined(whole, "f_b", aloft),
        v_n,
        p_n,
        _mean(v_n, WINDOW_S),
        -_mean(p_n[:, 2:], WINDOW_S)[:, 0],
        latitude,
    )


def _joined(pieces: list[Trajectory], name: str, rows: slice) -> Array:
    out: Array = np.concatenate([getattr(p, name) for p in pieces])[rows]
    return out


def _mean(x: Array, window_s: float) -> Array:
    """Centred mean over ``window_s``; ends are held."""
    half = round(window_s * RATE / 2)
    weight = np.ones(2 * half + 1)
    weight[[0, -1]] = 0.5
    padded = np.concatenate([np.repeat(x[:1], half, 0), x, np.repeat(x[-1:], half, 0)])
    return np.stack(
        [np.convolve(padded[:, j], weight / weight.sum(), "valid") for j in range(x.shape[1])],
        axis=-1,
    )


def _heading(rng: np.random.Generator, n: int, step: float, q: NoiseLevels) -> Array:
    """(n,) rad: critically damped, driven by white noise, in small steps; and it walks."""
    k = 1.0 / q.heading_time
    x, u = q.heading * rng.standard_normal(), k * q.heading * rng.standard_normal()
    kicks = 2.0 * q.heading * k**1.5 * np.sqrt(step) * rng.standard_normal(n)
    walks = q.heading_walk * np.sqrt(step) * rng.standard_normal(n)
    out = np.empty(n)
    for i in range(n):
        u += kicks[i] - (2.0 * k * u + k * k * x) * step
        x += u * step + walks[i]
        out[i] = x
    return out


def _gauss_markov(rng: np.random.Generator, n: int, step: float, time: float | Array) -> Array:
    """(n, 3) stationary, unit variance; ``time`` for all or (3,)."""
    keep = np.exp(-step / time)
    fresh = rng.standard_normal((n, 3))
    fresh[1:] *= np.sqrt(1.0 - keep**2)
    out = np.empty((n, 3))
    out[0] = fresh[0]
    for i in range(1, n):
        out[i] = keep * out[i - 1] + fresh[i]
    return out


def draw(path: Path, seed: int, levels: NoiseLevels = LEVELS) -> Flight:
    """One flight along ``path``: everything else by chance."""
    rng = np.random.default_rng([seed, 91])
    scale = 1.0 + DRAWN_SCALE * rng.standard_normal(3)
    offset = DRAWN_OFFSET * rng.standard_normal(3)
    delay = float(rng.uniform(*DRAWN_DELAY))
    samples: list[Sample] = [
        ParameterValue(f"INS_ACC{kind}_{axis}", value)
        for kind, value in (("SCAL", 1.0), ("OFFS", 0.0))
        for axis in "XYZ"
    ]
    samples += [ParameterValue(f"INS_{which}_FILTER", 0.0) for which in ("ACCEL", "GYRO")]
    timed = [
        *_inertial(path, rng, levels, scale, offset),
        *_attitude(path, rng, levels),
        *_fixes(path, rng, levels, delay),
    ]
    timed.sort(key=lambda pair: pair[0])
    samples += [sample for _, sample in timed]
    truth = {1: np.concatenate([scale, offset])}
    return Flight(f"matched {path.vehicle} {seed}", path.vehicle, samples, truth, delay)


Timed = list[tuple[float, Sample]]
"""Samples with their times of arrival, s."""


def _inertial(
    path: Path, rng: np.random.Generator, q: NoiseLevels, scale: Array, offset: Array
) -> Timed:
    t = path.t[path.imu]
    n, step = len(t), 1.0 / IMU_HZ
    f_b = path.f_b[path.imu] + rng.standard_normal((n, 3)) * np.sqrt(q.walk_b / step)
    raw = f_b / scale + offset
    late = GYRO_DELAY * rng.standard_normal()
    w_b = np.stack([np.interp(t - late, path.t, path.w_b[:, j]) for j in range(3)], axis=-1)
    w_b = w_b * (1.0 + GYRO_SCALE * rng.standard_normal(3))
    w_b = w_b + GYRO_BIAS * rng.standard_normal(3)
    w_b += np.cumsum(rng.standard_normal((n, 3)), axis=0) * q.bias_walk * np.sqrt(step)
    w_b += rng.standard_normal((n, 3)) * q.tilt_walk / np.sqrt(step)
    return [
        (float(t[i]), ImuSample(float(t[i]), 1, tuple(raw[i].tolist()), tuple(w_b[i].tolist())))
        for i in range(n)
    ]


def _attitude(path: Path, rng: np.random.Generator, q: NoiseLevels) -> Timed:
    """White noise is that of the epochs: samples between two share that of the nearest."""
    t, epochs = path.t[path.imu], path.t[path.epochs]
    nearest = np.clip(np.round((t - START_S) * GPS_HZ), 0, len(epochs) - 1).astype(int)
    white = q.attitude_white * rng.standard_normal((len(epochs), 3))[nearest]
    tilt = q.attitude * _gauss_markov(rng, len(t), 1.0 / IMU_HZ, ATTITUDE_TIME_S)[:, :2]
    turned = _heading(rng, len(t), 1.0 / IMU_HZ, q)
    slow = np.column_stack([tilt, turned])
    body = np.array([*TILT_OFFSET * rng.standard_normal(2), 0.0])
    heading = np.array([0.0, 0.0, HEADING_OFFSET * rng.standard_normal()])
    R = path.R_nb[path.imu] @ rotation.from_vector(np.tile(body, (len(t), 1)))
    R = rotation.from_vector(white + slow + heading) @ R
    roll, pitch, yaw = np.asarray(rotation.to_euler(R)).reshape(len(t), 3).T
    return [
        (float(a), AttitudeSample(float(a), float(r), float(p), float(y)))
        for a, r, p, y in zip(t, roll, pitch, yaw, strict=True)
    ]


def _fixes(path: Path, rng: np.random.Generator, q: NoiseLevels, delay: float) -> Timed:
    at = path.epochs
    t, n, step = path.t[at], len(at), 1.0 / GPS_HZ
    v = path.v_gps[at] + q.velocity * rng.standard_normal((n, 3))
    v += q.jitter * rng.standard_normal((n, 1)) * derivative(path.v_gps)[at]
    v += q.velocity_colour * _gauss_markov(rng, n, step, COLOUR_TIME_S)
    later = HEIGHT_DELAY * rng.standard_normal()
    height = np.interp(t - later, path.t, path.h_gps)
    height += q.height * rng.standard_normal(n)
    height += q.height_walk * np.sqrt(step) * np.cumsum(rng.standard_normal(n))
    latitude = path.latitude + path.p_n[at, 0] / METRES_PER_RADIAN
    longitude = path.p_n[at, 1] / METRES_PER_RADIAN / np.cos(path.latitude)
    return [
        (
            float(t[i] + delay),
            GpsFix(
                t=float(t[i] + delay),
                receiver=0,
                fix_type=3,
                latitude=float(latitude[i]),
                longitude=float(longitude[i]),
                altitude=float(height[i]),
                v_n=float(v[i, 0]),
                v_e=float(v[i, 1]),
            ),
        )
        for i in range(n)
    ]


def jerk(path: Path) -> tuple[Array, Array]:
    """Earth-frame acceleration and its derivative, NED, (n, 3) each."""
    a = derivative(path.v_n)
    return a, derivative(a)
