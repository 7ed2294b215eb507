"""The GPS receiver: fixes on a regular grid of its own time, late, smoothed, noisy, faulty."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from sitl.builtin import effects as fx
from sitl.builtin import rotation
from sitl.builtin.smoothing import DT, RATE, Array
from sitl.builtin.trajectory import Trajectory
from sitl.builtin.truth import GpsTruth, Response, Truth

FIX_3D, NO_FIX = 3, 1
SEMI_MAJOR, ECCENTRICITY_2 = 6_378_137.0, 6.694_379_990_14e-3


@dataclass(frozen=True, slots=True)
class Fix:
    """One report of the receiver, in its own numbers.

    ``t_valid`` and ``t_arrival`` are on the autopilot's boot clock, the latter never shown to
    anyone; ``t_stamp`` is what the autopilot writes down.  ``v_n`` m/s NED, position
    degrees and m.
    """

    t_valid: float
    t_arrival: float
    t_stamp: float
    fix_type: int
    latitude_deg: float
    longitude_deg: float
    altitude: float
    v_n: tuple[float, float, float]
    p_n: tuple[float, float, float]
    speed_accuracy: float
    satellites: int
    hdop: float
    jammed: bool


def radii(latitude_deg: float) -> tuple[float, float]:
    """Meridian and transverse radius of curvature of WGS 84, m."""
    s2 = np.sin(np.radians(latitude_deg)) ** 2
    w = 1.0 - ECCENTRICITY_2 * s2
    meridian = SEMI_MAJOR * (1.0 - ECCENTRICITY_2) / w**1.5
    return float(meridian), float(SEMI_MAJOR / np.sqrt(w))


def total_latency(truth: Truth) -> float:
    """Mean time from validity to arrival, with the concealed part, s."""
    concealed = sum(e.delay for e in truth.effects if isinstance(e, fx.GpsLatency))
    return truth.gps.delay + concealed


def smoothing_window(truth: Truth) -> float:
    """Averaging span of the receiver with the concealed part, s."""
    concealed = [e.window for e in truth.effects if isinstance(e, fx.GpsSmoothing)]
    return max([truth.gps.smoothing, *concealed])


class Receiver:
    """One receiver; its coloured noise runs on from one piece of trajectory to the next."""

    def __init__(self, truth: Truth) -> None:
        self._rng = np.random.default_rng([truth.seed, 21])
        self._velocity_error = self._rng.standard_normal(3) * truth.gps.velocity_coloured
        self._position_error = self._rng.standard_normal(3) * truth.gps.position_coloured

    def read(
        self, trajectory: Trajectory, truth: Truth, *, start: float, origin: float = 0.0
    ) -> list[Fix]:
        """Fixes whose grid times lie on a trajectory that starts at boot time ``start``."""
        gps = truth.gps
        first = int(np.ceil(start * gps.rate - 1e-9))
        last = int(np.ceil((start + trajectory.duration) * gps.rate - 1e-9))
        epochs = np.arange(first, last) / gps.rate
        skew = sum(e.rate for e in truth.effects if isinstance(e, fx.ClockSkew))
        valid = epochs - skew * (epochs - origin)
        v_n, p_n = self._antenna(trajectory, truth)
        window = smoothing_window(truth)
        spread = SPREADING[gps.response]
        velocity = _sample(_tracked(spread(v_n, window), truth), valid - start)
        position = _sample(spread(p_n, window), valid - start)
        return [
            self._fix(truth, float(t), velocity[i], position[i], origin)
            for i, t in enumerate(epochs)
        ]

    def _antenna(self, trajectory: Trajectory, truth: Truth) -> tuple[Array, Array]:
        """Velocity and position of the antenna."""
        arm = np.array(truth.gps.antenna)
        for effect in truth.effects:
            if isinstance(effect, fx.GpsLeverArm):
                arm = arm + np.array([effect.x, effect.y, effect.z])
        if not arm.any():
            return trajectory.v_n, trajectory.p_n
        swing = rotation.rotate(trajectory.R_nb, np.cross(trajectory.w_b, arm))
        return trajectory.v_n + swing, trajectory.p_n + trajectory.R_nb @ arm

    def _fix(self, truth: Truth, t: float, v_n: Array, p_n: Array, origin: float) -> Fix:
        gps = truth.gps
        stretch = np.array([1.0, 1.0, gps.vertical])
        self._velocity_error = self._colour(
            self._velocity_error, gps.velocity_coloured, gps.velocity_time, gps
        )
        self._position_error = self._colour(
            self._position_error, gps.position_coloured, gps.position_time, gps
        )
        white = self._rng.standard_normal((2, 3))
        jitter = self._rng.uniform(-gps.jitter, gps.jitter)
        elapsed = t - origin
        jammed = any(a <= elapsed < b for a, b in gps.jamming)
        noise = gps.velocity_noise * (20.0 if jammed else 1.0)
        v = v_n + (self._velocity_error + noise * white[0]) * stretch
        p = p_n + (self._position_error + gps.position_noise * white[1]) * stretch
        for begin, end, north, east in gps.glitches:
            if begin <= elapsed < end:
                p = p + np.array([north, east, 0.0])
        for effect in truth.effects:
            if isinstance(effect, fx.GpsFault) and effect.start <= elapsed < effect.end:
                v = v + np.array([effect.north, effect.east, 0.0])
        home = truth.environment
        meridian, transverse = radii(home.latitude_deg)
        lost = any(a <= elapsed < b for a, b in gps.losses)
        arrival = t + total_latency(truth) + jitter
        accuracy = float(np.hypot(noise, gps.velocity_coloured))
        return Fix(
            t_valid=t,
            t_arrival=arrival,
            t_stamp=arrival - gps.stamped_early,
            fix_type=NO_FIX if lost else FIX_3D,
            latitude_deg=home.latitude_deg + float(np.degrees(p[0] / (meridian + home.altitude))),
            longitude_deg=home.longitude_deg
            + float(
                np.degrees(
                    p[1] / ((transverse + home.altitude) * np.cos(np.radians(home.latitude_deg)))
                )
            ),
            altitude=home.altitude - float(p[2]),
            v_n=(float(v[0]), float(v[1]), float(v[2])),
            p_n=(float(p[0]), float(p[1]), float(p[2])),
            speed_accuracy=max(0.1, 3.0 * accuracy),
            satellites=0 if lost else (7 if jammed else 14),
            hdop=99.99 if lost else (2.8 if jammed else 0.8),
            jammed=jammed,
        )

    def _colour(self, x: Array, sigma: float, time: float, gps: GpsTruth) -> Array:
        """One step of a first-order Gauss-Markov process."""
        keep = np.exp(-1.0 / (gps.rate * time))
        fresh = self._rng.standard_normal(3) * (sigma * np.sqrt(1.0 - keep**2))
        out: Array = keep * x + fresh
        return out


def _centred_mean(x: Array, window_s: float) -> Array:
    """Mean over ``window_s`` about each sample; ends are held."""
    half = round(window_s * RATE / 2.0)
    if half == 0:
        return x
    padded = np.concatenate([np.repeat(x[:1], half, 0), x, np.repeat(x[-1:], half, 0)])
    # Trapezoidal weights: a window from -half to +half samples with half-weight ends.
    total = np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(padded, axis=0)])
    n = len(x)
    full = total[2 * half + 1 : 2 * half + 1 + n] - total[:n]
    ends = 0.5 * (padded[:n] + padded[2 * half : 2 * half + n])
    out: Array = (full - ends) / (2 * half)
    return out


def _filtered(x: Array, window_s: float) -> Array:
    """A filter of first order that spreads like a mean over ``window_s``, its delay taken out."""
    n = round(window_s * RATE / np.sqrt(12.0))
    if n == 0:
        return x
    # Of the samples before, each weighs so much less than the next; the last 6e-6 are left out.
    weights = np.exp(-np.arange(12 * n) / n)
    weights /= weights.sum()
    late = round(float(weights @ np.arange(12 * n)))
    padded = np.concatenate([np.repeat(x[:1], 12 * n, 0), x, np.repeat(x[-1:], late, 0)])
    size = 2 ** int(np.ceil(np.log2(len(padded) + 12 * n)))
    response = np.fft.rfft(weights, size)[:, None] * np.fft.rfft(padded, size, axis=0)
    out: Array = np.fft.irfft(response, size, axis=0)[12 * n + late : 12 * n + late + len(x)]
    return out


def _tracked(x: Array, truth: Truth) -> Array:
    """What the receiver's tracking loop makes of it; it begins in step."""
    for effect in truth.effects:
        if isinstance(effect, fx.GpsOvershoot):
            x = np.column_stack([_loop(u, effect.square, effect.damping) for u in x.T])
    return x


def _loop(u: Array, square: float, damping: float) -> Array:
    """Second-order loop (alpha-beta filter): what it is off corrects velocity and acceleration.

    ``y' = a + 2 damping w (u - y)``, ``a' = w^2 (u - y)``; from sample to sample by the implicit
    midpoint rule, with ``w = 1 / sqrt(square)`` rad/s.
    """
    w = 1.0 / np.sqrt(square)
    p, q = float(damping * w * DT), float(0.25 * (w * DT) ** 2)
    y, a = float(u[0]), float(u[1] - u[0]) / DT
    out = np.empty_like(u)
    out[0] = y
    middles = (0.5 * (u[1:] + u[:-1])).tolist()
    for i, middle in enumerate(middles, 1):
        # Half a step ahead: off = middle - (y + half DT (a half-way + 2 p / DT off)), solved.
        off = (middle - y - 0.5 * DT * a) / (1.0 + p + q)
        y += DT * a + 2.0 * (p + q) * off
        a += 4.0 * q / DT * off
        out[i] = y
    return out


def _two_moments(x: Array, window_s: float) -> Array:
    """The mean of two moments that spread like all of ``window_s``."""
    n = round(window_s * RATE / np.sqrt(12.0))
    i = np.arange(len(x))
    out: Array = 0.5 * (x[np.maximum(i - n, 0)] + x[np.minimum(i + n, len(x) - 1)])
    return out


SPREADING: Mapping[Response, Callable[[Array, float], Array]] = {
    "mean": _centred_mean,
    "filter": _filtered,
    "two moments": _two_moments,
}


def _sample(x: Array, t: Array) -> Array:
    """Rows of ``x`` at times ``t`` after its start, linear in between, held beyond the ends."""
    grid = np.arange(len(x)) * DT
    return np.column_stack([np.interp(t, grid, x[:, i]) for i in range(x.shape[1])])
