"""Velocity and force of a flight: the accelerometer carries the motion, GPS holds it to the truth.

The receiver's velocity is late and averaged; the integrated specific force is neither, but drifts.
So the difference of the two, both averaged alike, is smoothed over seconds and added to the
integral (a fixed-interval smoother; Rauch, Tung and Striebel 1965).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.vehicle.limits import VELOCITY_NOISE_M_S, VELOCITY_WANDER


@dataclass(frozen=True, slots=True)
class Sensors:
    """What the sensor level has found, to be undone here.

    Attributes:
        scale: (3,) and
        offset: (3,) of the accelerometer: ``f_s = scale (raw - offset)``.
        force_sigma: (3,) what they leave unknown of the force at the loads flown, m/s^2.
        gps_delay: lateness of the receiver's velocity, s.
        gps_window: averaging span of it, s.
        attitude_delay: lateness of the recorded attitude, s.
    """

    scale: Array
    offset: Array
    force_sigma: Array
    gps_delay: float = 0.0
    gps_window: float = 0.0
    attitude_delay: float = 0.0


@dataclass(frozen=True, slots=True)
class Motion:
    """One uninterrupted piece of flight at the accelerometer's samples.

    Attributes:
        t: (n,) s.
        f_b: (n, 3) specific force, m/s^2.
        w_b: (n, 3) rates, rad/s.
        R_nb: (n, 3, 3) attitude.
        v_n: (n, 3) velocity, m/s.
        height: (n,) above mean sea level, m.
        velocity_sigma: of the velocity, m/s.
    """

    t: Array
    f_b: Array
    w_b: Array
    R_nb: Array
    v_n: Array
    height: Array
    velocity_sigma: float


def motions(batches: Sequence[Batch], sensors: Sensors) -> list[Motion]:
    """The flight as pieces without gaps."""
    runs: list[list[Batch]] = []
    for batch in batches:
        if batch.fresh or not runs:
            runs.append([])
        runs[-1].append(batch)
    made = (_motion(run, sensors) for run in runs)
    return [m for m in made if m is not None]


def _motion(run: Sequence[Batch], sensors: Sensors) -> Motion | None:
    parts = []
    for k, batch in enumerate(run):
        s = batch.segment
        start = -np.inf if k == 0 else run[k - 1].fixes.t[-1]
        end = np.inf if k == len(run) - 1 else batch.fixes.t[-1]
        own = (s.t > start) & (s.t <= end)
        t = s.t[own]
        if len(t) == 0:
            continue
        R, _ = s.attitude_at(t + sensors.attitude_delay, sensors.attitude_delay)
        f_b = (sensors.scale * (s.raw_s[own] - sensors.offset)) @ s.R_bs.T
        parts.append((t, f_b, s.w_b[own], R))
    if not parts:
        return None
    t, f_b, w_b, R = (np.concatenate(x) for x in zip(*parts, strict=True))
    keep = np.concatenate([[True], np.diff(t) > 1e-6])
    t, f_b, w_b, R = t[keep], f_b[keep], w_b[keep], R[keep]
    if len(t) < 20:
        return None
    a_n = np.einsum("nij,nj->ni", R, f_b)
    a_n[:, 2] += STANDARD_GRAVITY
    v_n = np.zeros_like(a_n)
    v_n[1:] = np.cumsum(0.5 * (a_n[1:] + a_n[:-1]) * np.diff(t)[:, None], axis=0)
    fix_t, fix_v, fix_h = _fixes(run)
    true_t = fix_t - sensors.gps_delay
    inner = (true_t >= t[0]) & (true_t <= t[-1])
    if np.count_nonzero(inner) < 5:
        return None
    true_t, fix_v, fix_h = true_t[inner], fix_v[inner], fix_h[inner]
    half = sensors.gps_window / np.sqrt(12.0)
    error, sigma = np.zeros_like(v_n), 0.0
    for axis in range(3):
        late = np.interp(true_t + half, t, v_n[:, axis])
        early = np.interp(true_t - half, t, v_n[:, axis])
        left = fix_v[:, axis] - 0.5 * (late + early)
        smooth, level = _smoothed(true_t, left)
        error[:, axis] = np.interp(t, true_t, smooth)
        sigma = max(sigma, level)
    return Motion(t, f_b, w_b, R, v_n + error, np.interp(t, true_t, fix_h), sigma)


def _fixes(run: Sequence[Batch]) -> tuple[Array, Array, Array]:
    """Times (n,), velocities (n, 3) and heights (n,); NaN where GPS is not to be believed."""
    t = np.concatenate([b.fixes.t for b in run])
    v = np.concatenate([np.where(b.trusted[:, None], b.fixes.v_n, np.nan) for b in run])
    h = np.concatenate([b.fixes.height for b in run])
    t, first = np.unique(t, return_index=True)
    v, h = v[first].copy(), h[first]
    if not np.isfinite(v[:, 2]).any() and len(t) > 10:
        v[5:-5, 2] = -(h[10:] - h[:-10]) / (t[10:] - t[:-10])
    return t, v, h


def _smoothed(t: Array, y: Array) -> tuple[Array, float]:
    """Smoothed ``y`` (n,) at its times and its sigma, the wander chosen by likelihood."""
    best: tuple[float, Array, float] | None = None
    for wander in VELOCITY_WANDER:
        score, smooth, sigma = _rts(t, y, wander)
        if best is None or score > best[0]:
            best = score, smooth, sigma
    if best is None:
        raise ValueError("no level of wander")
    return best[1], best[2]


def _rts(t: Array, y: Array, wander: float) -> tuple[float, Array, float]:
    """Log-likelihood, smoothed mean (n,) and its sigma, noise of the measurement profiled out.

    The state is an error and its rate; the rate is a random walk.
    """
    n = len(t)
    r = VELOCITY_NOISE_M_S**2
    m, P = np.zeros(2), np.diag([1.0, 0.25])
    known = np.flatnonzero(np.isfinite(y))
    if len(known) == 0:
        return 0.0, np.zeros(n), 1.0
    m[0] = y[known[0]]
    means, covariances = np.empty((n, 2)), np.empty((n, 2, 2))
    ahead_m, ahead_P, moves = np.empty((n, 2)), np.empty((n, 2, 2)), np.empty((n, 2, 2))
    score, squares, count = 0.0, 0.0, 0
    for k in range(n):
        h = t[k] - t[k - 1] if k else 0.0
        A = np.array([[1.0, h], [0.0, 1.0]])
        q = wander**2
        Q = q * np.array([[h**3 / 3.0, h * h / 2.0], [h * h / 2.0, h]])
        m = A @ m
        P = A @ P @ A.T + Q
        ahead_m[k], ahead_P[k], moves[k] = m, P, A
        if np.isfinite(y[k]):
            s = P[0, 0] + r
            e = y[k] - m[0]
            gain = P[:, 0] / s
            m = m + gain * e
            P = P - np.outer(gain, P[0])
            score -= 0.5 * (e * e / s + np.log(s))
            squares += e * e / s
            count += 1
        means[k], covariances[k] = m, P
    out = means[:, 0].copy()
    ms, Ps = means[-1], covariances[-1]
    variance = Ps[0, 0]
    for k in range(n - 2, -1, -1):
        C = covariances[k] @ moves[k + 1].T @ np.linalg.inv(ahead_P[k + 1])
        ms = means[k] + C @ (ms - ahead_m[k + 1])
        Ps = covariances[k] + C @ (Ps - ahead_P[k + 1]) @ C.T
        out[k] = ms[0]
        variance += Ps[0, 0]
    scatter = squares / max(count, 1)
    return score, out, float(np.sqrt(max(variance / n, 0.0) * max(scatter, 1.0)))
