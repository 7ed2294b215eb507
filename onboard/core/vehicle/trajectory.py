"""Velocity and force of a flight: the accelerometer carries the motion, GPS holds it to the truth.

The receiver's velocity is late and averaged; the integrated specific force is neither, but drifts.
So the difference of the two, both averaged alike, is what a smoother
(:mod:`onboard.core.vehicle.smoother`) finds the errors of velocity and attitude from.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from onboard.core.estimate.misread import Misread
from onboard.core.inputs.limits import EVEN_MARGIN_S
from onboard.core.inputs.reach import apart_of, reach_of
from onboard.core.inputs.segments import Batch, Segment
from onboard.core.maths.arrays import Array, Mask
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import rotation_from_vector, vector_from_rotation
from onboard.core.vehicle.limits import (
    ATTITUDE_WANDER,
    FEWEST_FIXES,
    LEVELS_FROM,
    UNCLEAR_M_S,
    VELOCITY_NOISE_M_S,
)
from onboard.core.vehicle.smoother import (
    BIAS,
    PSI,
    Levels,
    Steps,
    V,
    attitude_known,
    likelihoods,
    smoothed,
)

UNKNOWN_TILT = np.array([0.03, 0.03, 0.05])
"""What an autopilot's roll, pitch and heading are good to where nobody has looked, rad: a compass
is, to three degrees [data sheet]."""


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
        gyro_scale: (3,) by how much the gyroscope reads too much.
        misread: what the accelerometer reads wrong beside these; None: nothing that is known.
        tilt: (3,) roll and pitch of the body by which the recorded attitude is turned too far, and
            heading to north, rad.
        tilt_sigma: (3,) of that, rad.
        load_sigma: (3,) what they leave unknown of how the force changes with the load, by the
            load, body axes.
    """

    scale: Array
    offset: Array
    force_sigma: Array
    gps_delay: float = 0.0
    gps_window: float = 0.0
    attitude_delay: float = 0.0
    gyro_scale: Array = field(default_factory=lambda: np.zeros(3))
    misread: Misread | None = None
    tilt: Array = field(default_factory=lambda: np.zeros(3))
    tilt_sigma: Array = field(default_factory=UNKNOWN_TILT.copy)
    load_sigma: Array = field(default_factory=lambda: np.zeros(3))

    def attitude(self, R_nb: Array) -> Array:
        """Recorded attitudes (n, 3, 3) without what they are off by all flight long."""
        level = np.array([self.tilt[0], self.tilt[1], 0.0])
        off = R_nb @ level + np.array([0.0, 0.0, self.tilt[2]])
        out: Array = rotation_from_vector(-off) @ R_nb
        return out

    def force(self, segment: Segment, before: Segment | None) -> tuple[Array, Segment]:
        """Specific force at a segment's samples, with all undone that is known of them.

        Args:
            segment: samples.
            before: what was returned for the one before; None after a gap.

        Returns:
            (n, 3) body axes, m/s^2, and the segment to go on from.
        """
        f_b: Array = (self.scale * (segment.raw_s - self.offset)) @ segment.R_bs.T
        if self.misread is None:
            return f_b, segment
        more, segment = self.misread.taken_off(segment, before)
        return f_b + more, segment


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
        velocity_sigma: of the velocity where it is known, m/s.
        attitude_sigma: (3,) of the attitude, about north, east and down, rad.
        fixed: (k,) times of the fixes, s, and (k, 3) by how much their velocity is off that of
            force and recorded attitude, m/s, but for a constant.
        load_sigma: as that of the sensors.
        heading_drift: (n,) standard deviation of what the heading is off by more and more, with
            its sign from where it is known best, rad.
        lost: (n,) whether its velocity is not known: no receiver holds it, for so long that it may
            be off by more than :data:`~onboard.core.vehicle.limits.UNCLEAR_M_S`.
    """

    t: Array
    f_b: Array
    w_b: Array
    R_nb: Array
    v_n: Array
    height: Array
    velocity_sigma: float
    attitude_sigma: Array
    fixed: tuple[Array, Array] = (np.zeros(0), np.zeros((0, 3)))
    load_sigma: Array = field(default_factory=lambda: np.zeros(3))
    heading_drift: Array = field(default_factory=lambda: np.zeros(0))
    lost: Mask = field(default_factory=lambda: np.zeros(0, dtype=bool))

    def __post_init__(self) -> None:
        """No drift, and a velocity that is known, where nothing is said of either."""
        if len(self.lost) != len(self.t):
            object.__setattr__(self, "lost", np.zeros(len(self.t), dtype=bool))
        if len(self.heading_drift) != len(self.t):
            object.__setattr__(self, "heading_drift", np.zeros(len(self.t)))

    def finer(self, step_s: float) -> Motion:
        """The same motion at even times, where its samples are usually further apart.

        Straight lines between samples are what its velocity is the integral of.  A grid that is as
        coarse as the samples are would have steps with two of them, and steps with none, which look
        like gaps of the flight.
        """
        if float(np.median(np.diff(self.t))) <= step_s:
            return self
        # As fine as half of it: a step's mean is of two at least, wherever it begins.
        t = self.t[0] + 0.5 * step_s * (np.arange(int(2.0 * np.ptp(self.t) / step_s)) + 0.5)
        return replace(
            self,
            t=t,
            f_b=_at(t, self.t, self.f_b),
            w_b=_at(t, self.t, self.w_b),
            R_nb=_at(t, self.t, self.R_nb.reshape(-1, 9)).reshape(-1, 3, 3),
            v_n=_at(t, self.t, self.v_n),
            height=np.interp(t, self.t, self.height),
            heading_drift=np.interp(t, self.t, self.heading_drift),
            lost=np.interp(t, self.t, self.lost) > 0.0,
        )


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
    before: Segment | None = None
    for k, batch in enumerate(run):
        s, fix_t = batch.segment, batch.fixes.t
        # Of a segment that was cut, because it clips, no more than fixes need.
        reach = reach_of(apart_of(fix_t))
        start = run[k - 1].fixes.t[-1] if k else fix_t[0] - reach.before - EVEN_MARGIN_S
        end = fix_t[-1] + (reach.ahead if k == len(run) - 1 else 0.0)
        f_b, before = sensors.force(s, before)
        own = (s.t > start) & (s.t <= end)
        t = s.t[own]
        if len(t) == 0:
            continue
        R, _ = s.attitude_at(t + sensors.attitude_delay, sensors.attitude_delay)
        w_b = s.w_b[own] / (1.0 + sensors.gyro_scale)
        parts.append((t, f_b[own], w_b, sensors.attitude(R)))
    if not parts:
        return None
    t, f_b, w_b, R = (np.concatenate(x) for x in zip(*parts, strict=True))
    keep = np.concatenate([[True], np.diff(t) > 1e-6])
    t, f_b, w_b, R = t[keep], f_b[keep], w_b[keep], R[keep]
    if len(t) < 20:
        return None
    f_n = np.einsum("nij,nj->ni", R, f_b)
    v_n = _integral(t, f_n + np.array([0.0, 0.0, STANDARD_GRAVITY]))
    fix_t, fix_v, fix_h = _fixes(run)
    true_t = fix_t - sensors.gps_delay
    inner = (true_t >= t[0]) & (true_t <= t[-1])
    if np.count_nonzero(inner) < FEWEST_FIXES:
        return None
    true_t, fix_v, fix_h = true_t[inner], fix_v[inner], fix_h[inner]
    half = sensors.gps_window / np.sqrt(12.0)
    # What the receiver averages over is averaged here, too: two points have the same variance.
    average = 0.5 * (_at(true_t + half, t, v_n) + _at(true_t - half, t, v_n))
    steps = _steps(true_t, t, f_n, w_b, R, fix_v - average)
    level = float(np.max(sensors.tilt_sigma[:2]))
    start = np.array([level, level, float(sensors.tilt_sigma[2])])
    levels = _levels(steps, start)
    errors = smoothed(steps, levels, start)
    v_n = v_n + _at(t, true_t, errors.x[:, V])
    R = rotation_from_vector(_at(t, true_t, errors.x[:, PSI])) @ R
    attitude_sigma, heading = attitude_known(steps, levels, start)
    variance = errors.variance[:, V]
    unsure = np.sqrt(np.max(variance, axis=1))
    known = unsure <= UNCLEAR_M_S
    return Motion(
        t,
        f_b,
        w_b - _at(t, true_t, errors.x[:, BIAS]),
        R,
        v_n,
        np.interp(t, true_t, fix_h),
        math.sqrt(float(np.max(np.mean(variance[known if known.any() else ...], axis=0)))),
        attitude_sigma,
        (true_t, fix_v - average),
        sensors.load_sigma,
        np.interp(t, true_t, _drift(true_t, heading, float(start[2]))),
        np.interp(t, true_t, unsure) > UNCLEAR_M_S,
    )


def _steps(at: Array, t: Array, f_n: Array, w_b: Array, R: Array, measured: Array) -> Steps:
    """What the smoother goes over, from the samples at ``t`` (n,) to the fixes at ``at`` (k,)."""
    h = np.diff(t)
    mean_rate = 0.5 * (w_b[1:] + w_b[:-1])
    by_gyro = R[:-1] @ rotation_from_vector(mean_rate * h[:, None])
    beyond = vector_from_rotation(np.swapaxes(by_gyro, -1, -2) @ R[1:])
    turned = np.zeros_like(f_n)
    turned[1:] = np.cumsum(np.einsum("nij,nj->ni", R[1:], beyond), axis=0)
    impulse = _at(at, t, _integral(t, f_n))
    turned_at = _at(at, t, turned)
    nearest = np.clip(np.searchsorted(t, at), 0, len(t) - 1)
    return Steps(
        np.diff(at, prepend=at[0]),
        np.diff(impulse, axis=0, prepend=impulse[:1]),
        np.diff(turned_at, axis=0, prepend=turned_at[:1]),
        R[nearest],
        measured,
    )


def _drift(t: Array, variance: Array, most: float) -> Array:
    """(n,) rad by which a heading is off more and more, in one standard deviation of that.

    Between turns a bias of the gyroscope turns it, at an even rate: from where it is known best the
    variance (n,), rad^2, grows.  A compass holds it to ``most``, rad.
    """
    since = t - t[np.argmin(variance)]
    size = math.sqrt(float(np.mean(since**2)))
    more = math.sqrt(max(float(np.mean(variance) - np.min(variance)), 0.0))
    out: Array = min(more, most) * since / max(size, 1e-9)
    return out


def _levels(steps: Steps, start: Array) -> Levels:
    """The likeliest noise, of the first minute or two."""
    sample = steps.until(LEVELS_FROM)
    trials = [Levels(a, v) for a in ATTITUDE_WANDER for v in VELOCITY_NOISE_M_S]
    return trials[int(np.argmax(likelihoods(sample, trials, start)))]


def _integral(t: Array, x: Array) -> Array:
    """(n, 3) integral of x (n, 3) from the first sample on, by trapezes."""
    out = np.zeros_like(x)
    out[1:] = np.cumsum(0.5 * (x[1:] + x[:-1]) * np.diff(t)[:, None], axis=0)
    return out


def _at(at: Array, t: Array, x: Array) -> Array:
    """(m, 3) values of x (n, 3) by straight lines."""
    return np.stack([np.interp(at, t, x[:, j]) for j in range(x.shape[1])], axis=-1)


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
