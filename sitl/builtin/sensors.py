"""Inertial sensors of a whole flight: what the chips deliver at 1 kHz, before any parameter.

Every imperfection enters here, in the order of a real device: effects on the specific force,
vibration, sensor axes, scale and offset, noise, range, quantisation; then ArduPilot's
two-pole low-pass.  The filter is linear with unit gain, so the autopilot's scale and offset
may be applied after it as well as before.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sitl.builtin import effects as fx
from sitl.builtin.effects.base import turned
from sitl.builtin.orientation import board_rotation
from sitl.builtin.smoothing import DT, RATE, Array, derivative
from sitl.builtin.trajectory import STANDARD_GRAVITY, Trajectory
from sitl.builtin.truth import ImuTruth, Truth

RANGE = 16.0 * STANDARD_GRAVITY
RESOLUTION = RANGE / 32768.0
CRUISE_THROTTLE = 0.4
VIBE_FLOOR_HZ = 5.0
VIBE_LEVEL_HZ = 2.0
SPOILING = (fx.AccelerometerResolution, fx.AccelerometerSpikes)
"""Effects on what is handed out."""


@dataclass(frozen=True, slots=True)
class ImuReadings:
    """One IMU over one flight: (n, 3) arrays at 1 kHz.

    ``raw`` and ``filtered`` are sensor axes, uncorrected, m/s^2; ``gyro`` and
    ``gyro_filtered`` are body axes, rad/s; ``vibration`` is the level that VIBRATION reports
    (body axes); ``clipped`` counts samples at the rail since the start.
    """

    raw: Array
    filtered: Array
    gyro: Array
    gyro_filtered: Array
    temperature: Array
    vibration: Array
    clipped: np.ndarray[tuple[int], np.dtype[np.int64]]

    def first(self, n: int) -> ImuReadings:
        """The first ``n`` samples."""
        return ImuReadings(*(getattr(self, f.name)[:n] for f in fields(self)))


def low_pass_response(cutoff_hz: float) -> Array:
    """Impulse response of the two-pole Butterworth low-pass, bilinear transform at 1 kHz.

    The biquad of ArduPilot's LowPassFilter2p; its group delay at low frequency is
    ``sqrt(2) / (2 pi cutoff)``.
    """
    ohm = np.tan(np.pi * cutoff_hz * DT)
    c = 1.0 + np.sqrt(2.0) * ohm + ohm**2
    b = np.array([1.0, 2.0, 1.0]) * ohm**2 / c
    a1, a2 = 2.0 * (ohm**2 - 1.0) / c, (1.0 - np.sqrt(2.0) * ohm + ohm**2) / c
    n = int(RATE * min(4.0, 8.0 / cutoff_hz)) + 8
    h = np.zeros(n)
    for i in range(n):
        h[i] = b[i] if i < 3 else 0.0
        h[i] -= (a1 * h[i - 1] if i > 0 else 0.0) + (a2 * h[i - 2] if i > 1 else 0.0)
    return h


def one_pole_response(cutoff_hz: float) -> Array:
    """Impulse response of a first-order low-pass at 1 kHz."""
    a = 1.0 - np.exp(-2.0 * np.pi * cutoff_hz * DT)
    n = int(RATE * 5.0 / cutoff_hz)
    out: Array = a * (1.0 - a) ** np.arange(n)
    return out


@lru_cache(maxsize=16)
def _response(kind: str, cutoff_hz: float) -> Array:
    return low_pass_response(cutoff_hz) if kind == "two" else one_pole_response(cutoff_hz)


def low_pass(x: Array, cutoff_hz: float, kind: str = "two") -> Array:
    """Filters (n, k) along axis 0, starting in the steady state of the first sample."""
    if cutoff_hz <= 0.0:
        return x.copy()
    h = _response(kind, float(cutoff_hz))
    size = _fast_length(len(x) + len(h))
    spectrum = np.fft.rfft(h, size)
    start = x[:1]
    out = np.empty_like(x)
    for i in range(x.shape[1]):
        y = np.fft.irfft(np.fft.rfft(x[:, i] - start[0, i], size) * spectrum, size)
        out[:, i] = y[: len(x)] + start[0, i]
    return out


def _fast_length(n: int) -> int:
    block = 1 << max(0, n.bit_length() - 4)
    return -(-n // block) * block


def temperature_profile(truth: ImuTruth, t: Array) -> Array:
    """Warming up after power-on: (n,) degrees Celsius at boot times ``t``."""
    rise = 1.0 - np.exp(-t / truth.temperature_time)
    out: Array = truth.temperature_start + (truth.temperature_end - truth.temperature_start) * rise
    return out


def read_imu(
    trajectory: Trajectory,
    truth: Truth,
    index: int,
    *,
    start: float,
    accel_filter_hz: float,
    gyro_filter_hz: float,
    origin: float = 0.0,
) -> ImuReadings:
    """Everything that IMU ``index`` (from 0) delivers on a trajectory that starts at ``start``.

    Args:
        trajectory: the motion.
        truth: the hardware.
        index: which of ``truth.imus``.
        start: boot time of the first sample, s.
        accel_filter_hz: INS_ACCEL_FILTER; 0 is no filter.
        gyro_filter_hz: INS_GYRO_FILTER.
        origin: boot time at which ramps and steps of the effects count from.
    """
    imu = truth.imus[index]
    n = trajectory.n
    t = start + np.arange(n, dtype=np.float64) * DT

    def stream(purpose: int) -> np.random.Generator:
        # One generator a purpose: a shorter flight must be a prefix of a longer one.
        return np.random.default_rng([truth.seed, index, round(start * RATE), purpose])

    shake = _vibration(imu, trajectory.throttle, stream(0), stream(1))
    level = vibration_level(shake)
    temperature = temperature_profile(imu, t)
    f_b = trajectory.f_b + _lever(trajectory, imu)
    scene = fx.Scene(
        f_b=f_b,
        elapsed=t - origin,
        temperature=temperature,
        level=level,
        trajectory=trajectory,
    )
    f_b = f_b + _deterministic(truth, index, scene)
    R_bs = board_rotation(truth.orientation)
    board = board_axes(truth)
    f_s = (f_b + shake) @ board @ R_bs
    raw = f_s / np.array(imu.scale) + np.array(imu.offset)
    raw += stream(2).standard_normal((n, 3)) * (imu.accel_noise * np.sqrt(RATE / 2.0))
    raw += np.cumsum(stream(3).standard_normal((n, 3)), axis=0) * (imu.bias_walk * np.sqrt(DT))
    raw, rail = _converted(raw, _limit(truth, index))
    gyro = _gyro(trajectory.w_b @ board, imu, stream(4), stream(5), t)
    return ImuReadings(
        raw=raw,
        filtered=_spoiled(truth, index, low_pass(raw, accel_filter_hz), stream(6)),
        gyro=gyro,
        gyro_filtered=low_pass(gyro, gyro_filter_hz),
        temperature=temperature,
        vibration=level,
        clipped=np.cumsum(rail),
    )


def _hits(wanted: int, index: int) -> bool:
    return wanted in (0, index + 1)


def _limit(truth: Truth, index: int) -> float:
    """Rail of IMU ``index``, m/s^2: the chip's range, or less."""
    lower = (e for e in truth.effects if isinstance(e, fx.Saturation) and _hits(e.imu, index))
    return min([RANGE, *(e.limit for e in lower)])


def _spoiled(truth: Truth, index: int, readings: Array, chance: np.random.Generator) -> Array:
    """(n, 3) what bus and driver make of readings."""
    for effect in truth.effects:
        if isinstance(effect, SPOILING) and _hits(effect.imu, index):
            readings = effect.spoil(readings, chance)
    return readings


def _converted(raw: Array, limit: float) -> tuple[Array, NDArray[np.bool_]]:
    """(n, 3) what the converter makes of it, and (n,) which samples are at the rail."""
    steps = np.round(raw / RESOLUTION) * RESOLUTION
    return np.clip(steps, -limit, limit), np.any(np.abs(steps) >= limit, axis=1)


def _lever(trajectory: Trajectory, imu: ImuTruth) -> Array:
    """Centripetal and Euler acceleration of an IMU away from the reference point."""
    if not any(imu.position):
        return np.zeros(3)
    r = np.array(imu.position)
    w = trajectory.w_b
    out: Array = np.cross(derivative(w), r) + np.cross(w, np.cross(w, r))
    return out


def _vibration(
    imu: ImuTruth, throttle: Array, phases: np.random.Generator, noise: np.random.Generator
) -> Array:
    """Motor tones with harmonics whose speed follows throttle, and broadband noise, (n, 3)."""
    n = len(throttle)
    load = np.clip(throttle / CRUISE_THROTTLE, 0.0, 3.0)
    phase = 2.0 * np.pi * np.cumsum(imu.vibration_hz * np.sqrt(load)) * DT
    out = np.zeros((n, 3))
    for harmonic, share in ((1, 1.0), (2, 0.4), (5, 0.25)):
        offsets = phases.uniform(0.0, 2.0 * np.pi, 3)
        for axis in range(3):
            if imu.vibration[axis]:
                tone = np.sin(harmonic * phase + offsets[axis])
                out[:, axis] += share * imu.vibration[axis] * load * tone
    if imu.broadband:
        out += imu.broadband * load[:, None] * noise.standard_normal((n, 3))
    return out


def vibration_level(shake: Array) -> Array:
    """Level as VIBRATION reports it: high-pass at 5 Hz, square, low-pass at 2 Hz, root."""
    high = shake - low_pass(shake, VIBE_FLOOR_HZ, "one")
    level: Array = np.sqrt(np.maximum(low_pass(high**2, VIBE_LEVEL_HZ, "one"), 0.0))
    return level


def _deterministic(truth: Truth, index: int, scene: fx.Scene) -> Array:
    """Sum of the accelerometer effects on IMU ``index``: what it reads too much, (n, 3)."""
    extra = np.zeros_like(scene.f_b)
    for effect in truth.effects:
        if not _hits(getattr(effect, "imu", 0), index):
            continue
        added = effect.reads_too_much(scene)
        if added is not None:
            extra += added
    return extra


def board_axes(truth: Truth) -> Array:
    """(3, 3) axes of the autopilot in the airframe: ``f_b @ board_axes`` is what it feels."""
    tilts = [e for e in truth.effects if isinstance(e, fx.BoardTilt)]
    return turned(tilts[0].roll, tilts[0].pitch) if tilts else np.eye(3)


def _gyro(
    w_b: Array,
    imu: ImuTruth,
    white: np.random.Generator,
    wander: np.random.Generator,
    t: Array,
) -> Array:
    n = len(w_b)
    noise = white.standard_normal((n, 3)) * (imu.gyro_noise * np.sqrt(RATE / 2.0))
    walk = np.cumsum(wander.standard_normal((n, 3)), axis=0) * (imu.gyro_walk * np.sqrt(DT))
    drift = np.outer(np.sin(2.0 * np.pi * t / 600.0), imu.gyro_bias)
    felt = w_b + np.cross(w_b, imu.gyro_turn) if any(imu.gyro_turn) else w_b
    out: Array = felt * (1.0 + np.array(imu.gyro_scale)) + noise + walk + drift
    return out


class Barometer:
    """Static pressure with slow drift and noise; standard atmosphere."""

    SEA_LEVEL = 101_325.0
    LAPSE = 2.255_77e-5
    EXPONENT = 5.255_88

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng([seed, 31])
        self._drift = 0.0

    def altitude(self, true_altitude: float) -> float:
        """Pressure altitude over sea level, m."""
        self._drift = 0.998 * self._drift + 0.02 * float(self._rng.standard_normal())
        return true_altitude + self._drift + 0.08 * float(self._rng.standard_normal())

    def pressure(self, altitude: float) -> float:
        """Static pressure at an altitude, Pa."""
        return float(self.SEA_LEVEL * (1.0 - self.LAPSE * altitude) ** self.EXPONENT)
