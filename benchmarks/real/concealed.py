"""Known errors put into a real recording, sample by sample.

Each is what a sensor, a receiver or a clock would have done, applied to the numbers that the
autopilot reports, after reading and before the estimator.  Nothing of the estimator's model is
used: rotations and interpolation are this module's own.  What is not imitated is what the autopilot
would have made of the error: the recorded attitude stays as it was flown, as that of an EKF
that has learned the error long ago.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample, ParameterValue, Sample

Array = NDArray[np.float64]
Axis = Literal[0, 1, 2]
X, Y, Z = 0, 1, 2
LETTERS = "xyz"

REFERENCE_DEGC = 35.0
"""ArduPilot's: where a temperature law is nothing."""
WARMS_BY_K = 3.0
"""Less warming than this in flight shows no temperature law."""
LONGEST_AVERAGED_S = 0.21
"""Fixes further apart than this would average over longer than any receiver."""
FAULT_S = 10.0
METRES_PER_RADIAN = 6.371e6


@dataclass(frozen=True, slots=True)
class About:
    """What a flight without the error is known to be like.

    Attributes:
        imu: accelerometer into which errors are put.
        in_force: (6,) its scale and offset as the autopilot applies them.
        start: of its samples, s, boot clock.
        moment: half of the moving flight, s, boot clock.
        warms_by: range of its temperature in moving flight, K; 0 where it has none.
        fix_step: between fixes, s.
        late: of the GPS against its stamps, s, as the untouched flight says.
        window: averaging span of the receiver, s, likewise.
    """

    imu: int
    in_force: Array
    start: float
    moment: float
    warms_by: float
    fix_step: float
    late: float = 0.0
    window: float = 0.0


Lay = Callable[[Sequence[Sample], About], Iterable[Sample]]
Numbers = Mapping[str, float]
Truth = Callable[[Numbers, About], dict[str, float]]
"""From what the untouched flight gave to what the other one should give, those that change."""


@dataclass(frozen=True, slots=True)
class Kind:
    """One error of one size.

    Attributes:
        name: with its size.
        wanted: names of effects that may be said of it, the first must; none: the six take it.
        lay: puts it into samples.
        truth: what it should change.
        applies: whether the flight can have it.
    """

    name: str
    wanted: tuple[str, ...]
    lay: Lay
    truth: Truth
    applies: Callable[[About], bool] = lambda _: True


def about(samples: Sequence[Sample], imu: int, *, late: float = 0.0, window: float = 0.0) -> About:
    """What the samples say of themselves.

    Raises:
        ValueError: no inertial samples, no moving flight, or a board that is not along the body.
    """
    parameters: dict[str, float] = {}
    for s in samples:
        if isinstance(s, ParameterValue):
            parameters.setdefault(s.name, s.value)
    if parameters.get("AHRS_ORIENTATION", 0.0) != 0.0:
        raise ValueError("the board is turned in the body")
    rows = [s for s in samples if isinstance(s, ImuSample) and s.imu == imu]
    fixes = [s for s in samples if isinstance(s, GpsFix) and s.fix_type >= 3]
    moving = [f.t for f in fixes if np.hypot(f.v_n, f.v_e) > 1.5]
    if not rows or len(moving) < 2:
        raise ValueError("no moving flight")
    degrees = [
        s.temperature for s in rows if s.temperature is not None and moving[0] <= s.t <= moving[-1]
    ]
    prefix = "INS_ACC" if imu == 1 else f"INS_ACC{imu}"
    six = [parameters.get(f"{prefix}SCAL_{a}") or 1.0 for a in "XYZ"]
    six += [parameters.get(f"{prefix}OFFS_{a}", 0.0) for a in "XYZ"]
    return About(
        imu,
        np.array(six),
        rows[0].t,
        0.5 * (moving[0] + moving[-1]),
        max(degrees) - min(degrees) if degrees else 0.0,
        float(np.median(np.diff([f.t for f in fixes]))),
        late,
        window,
    )


# Errors of the accelerometer.


def _of_force(
    samples: Iterable[Sample], imu: int, change: Callable[[ImuSample, Array], Array]
) -> Iterator[Sample]:
    """Change what one accelerometer reads, body axes, as corrected by the autopilot, m/s^2."""
    for s in samples:
        if isinstance(s, ImuSample) and s.imu == imu:
            x, y, z = change(s, np.array(s.f_b)).tolist()
            yield replace(s, f_b=(x, y, z))
        else:
            yield s


def _unit(axis: int, size: float) -> Array:
    out = np.zeros(3)
    out[axis] = size
    return out


def offset(axis: int, size: float) -> Kind:
    """One axis reads ``size``, m/s^2, too much."""

    def truth(before: Numbers, ground: About) -> dict[str, float]:
        name = f"{LETTERS[axis]} offset"
        return {name: before[name] + size / float(ground.in_force[axis])}

    return Kind(
        f"offset {LETTERS[axis]} {size:+g}",
        (),
        lambda s, g: _of_force(s, g.imu, lambda _, f: f + _unit(axis, size)),
        truth,
    )


def scale(axis: int, factor: float) -> Kind:
    """One axis reads the force divided by ``factor``: its scale is so much larger."""

    def truth(before: Numbers, ground: About) -> dict[str, float]:
        a, old = LETTERS[axis], float(ground.in_force[3 + axis])
        return {
            f"{a} scale": before[f"{a} scale"] * factor,
            f"{a} offset": old + (before[f"{a} offset"] - old) / factor,
        }

    by = np.ones(3)
    by[axis] = 1.0 / factor
    return Kind(
        f"scale {LETTERS[axis]} {factor:g}",
        (),
        lambda s, g: _of_force(s, g.imu, lambda _, f: f * by),
        truth,
    )


def _added(name: str, key: str, size: float) -> Truth:
    """One unknown of an effect is larger by ``size``: nothing counts as zero."""
    number = f"{name}.{key}"
    return lambda before, _: {number: before.get(number, 0.0) + size}


def step(axis: int, size: float) -> Kind:
    """From half of the flight on an axis reads ``size``, m/s^2, too much."""

    def lay(samples: Sequence[Sample], ground: About) -> Iterator[Sample]:
        return _of_force(
            samples,
            ground.imu,
            lambda s, f: f + _unit(axis, size) if s.t >= ground.moment else f,
        )

    key = LETTERS[axis]
    return Kind(f"step {key} {size:+g}", ("bias_step",), lay, _added("bias_step", key, size))


def ramp(axis: int, rate: float) -> Kind:
    """An axis reads more and more too much, m/s^3."""

    def lay(samples: Sequence[Sample], ground: About) -> Iterator[Sample]:
        return _of_force(
            samples, ground.imu, lambda s, f: f + _unit(axis, rate * (s.t - ground.start))
        )

    key = LETTERS[axis]
    return Kind(f"ramp {key} {rate:+g}/s", ("bias_ramp",), lay, _added("bias_ramp", key, rate))


def warmed(axis: int, slope: float) -> Kind:
    """An axis reads too much by ``slope``, m/s^2/K, about 35 degC."""

    def lay(samples: Sequence[Sample], ground: About) -> Iterator[Sample]:
        def change(s: ImuSample, f: Array) -> Array:
            warm = REFERENCE_DEGC if s.temperature is None else s.temperature
            return f + _unit(axis, slope * (warm - REFERENCE_DEGC))

        return _of_force(samples, ground.imu, change)

    key = LETTERS[axis]
    return Kind(
        f"temperature {key} {slope:+g}/K",
        ("temperature_drift",),
        lay,
        _added("temperature_drift", key, slope),
        lambda ground: ground.warms_by >= WARMS_BY_K,
    )


def crossed(axis: int, other: int, share: float) -> Kind:
    """An axis reads a share of another one too much."""

    def change(_: ImuSample, f: Array) -> Array:
        return f + _unit(axis, share * float(f[other]))

    key = LETTERS[axis] + LETTERS[other]
    return Kind(
        f"cross {key} {share:+g}",
        ("cross_axis",),
        lambda s, g: _of_force(s, g.imu, change),
        _added("cross_axis", key, share),
    )


def turned(angle: float) -> Kind:
    """The accelerometer, not the gyroscope, is turned about x by ``angle``, rad."""
    R = about_x(angle)
    return Kind(
        f"accelerometer turned {np.degrees(angle):+.0f} deg",
        ("mount_tilt",),
        lambda s, g: _of_force(s, g.imu, lambda _, f: R.T @ f),
        _added("mount_tilt", "roll", -angle),
    )


# Errors of the receiver and its stamps.


def _held(samples: Iterable[Sample], change: Callable[[GpsFix], GpsFix]) -> Iterator[Sample]:
    """Change fixes; one that is stamped later also arrives later."""
    waiting: deque[GpsFix] = deque()
    for s in samples:
        if isinstance(s, GpsFix):
            waiting.append(change(s))
            continue
        if isinstance(s, ImuSample):
            while waiting and waiting[0].t <= s.t:
                yield waiting.popleft()
        yield s
    yield from waiting


def _later(fix: GpsFix, by: float) -> GpsFix:
    told = None if fix.t_message is None else fix.t_message + by
    return replace(fix, t=fix.t + by, t_message=told)


def latency(by: float) -> Kind:
    """All fixes are stamped ``by`` seconds later."""
    return Kind(
        f"GPS later {1e3 * by:.0f} ms",
        ("gps_latency",),
        lambda s, _: _held(s, lambda fix: _later(fix, by)),
        lambda before, _: {"gps_delay": before["gps_delay"] + by},
    )


def skewed(rate: float) -> Kind:
    """The stamps of the fixes run away by ``rate`` seconds a second."""
    return Kind(
        f"GPS clock {1e6 * rate:+.0f} ppm",
        ("clock_skew",),
        lambda s, g: _held(s, lambda fix: _later(fix, rate * (fix.t - g.start))),
        _added("clock_skew", "rate", rate),
    )


def averaged() -> Kind:
    """Each fix is the mean of itself and the one before.

    Two moments T apart have the variance ``T^2/4`` about their middle, T/2 before the later one; a
    span w has ``w^2/12``: the square of the span grows by ``3 T^2``.
    """

    def lay(samples: Sequence[Sample], ground: About) -> Iterator[Sample]:
        before: GpsFix | None = None

        def change(fix: GpsFix) -> GpsFix:
            nonlocal before
            old, before = before, fix
            if old is None or not 0.0 < fix.t - old.t < 1.5 * ground.fix_step:
                return fix
            return _mean(old, fix)

        return _held(samples, change)

    return Kind(
        "GPS averaged over 2 fixes",
        ("gps_smoothing", "gps_latency"),
        lay,
        lambda before, g: {
            "gps_delay": before["gps_delay"] + 0.5 * g.fix_step,
            "window_squared": before["window_squared"] + 3.0 * g.fix_step**2,
        },
        lambda ground: ground.fix_step <= LONGEST_AVERAGED_S,
    )


def _mean(a: GpsFix, b: GpsFix) -> GpsFix:
    down = None if a.v_d is None or b.v_d is None else 0.5 * (a.v_d + b.v_d)
    return replace(
        b,
        v_n=0.5 * (a.v_n + b.v_n),
        v_e=0.5 * (a.v_e + b.v_e),
        v_d=down,
        latitude=0.5 * (a.latitude + b.latitude),
        longitude=0.5 * (a.longitude + b.longitude),
        altitude=0.5 * (a.altitude + b.altitude),
    )


def antenna(axis: int, arm: float) -> Kind:
    """The antenna is ``arm`` metres further along a body axis."""
    key = LETTERS[axis]
    r = _unit(axis, arm)
    return Kind(
        f"antenna {key} {arm:+g} m",
        ("gps_lever_arm",),
        lambda s, g: _on_arm(s, g, r),
        _added("gps_lever_arm", key, arm),
    )


def _on_arm(samples: Sequence[Sample], ground: About, r: Array) -> Iterator[Sample]:
    """Velocity gains ``R (w x r)`` and position ``R r``, as the receiver averages them."""
    attitude = [s for s in samples if isinstance(s, AttitudeSample)]
    rates = [
        s for s in samples if isinstance(s, ImuSample) and s.imu == ground.imu and s.w_b is not None
    ]
    t_a, t_w = np.array([s.t for s in attitude]), np.array([s.t for s in rates])
    angles = np.unwrap(np.array([(s.roll, s.pitch, s.yaw) for s in attitude]), axis=0)
    w_b = np.array([s.w_b for s in rates])
    span = np.linspace(-0.5, 0.5, 9) * ground.window

    def change(fix: GpsFix) -> GpsFix:
        t = fix.t - ground.late + span
        a = np.stack([np.interp(t, t_a, angles[:, j]) for j in range(3)], axis=-1)
        w = np.stack([np.interp(t, t_w, w_b[:, j]) for j in range(3)], axis=-1)
        R = [from_angles(*row) for row in a]
        v = np.mean([m @ np.cross(rate, r) for m, rate in zip(R, w, strict=True)], axis=0)
        p = np.mean([m @ r for m in R], axis=0)
        return replace(
            fix,
            v_n=fix.v_n + float(v[0]),
            v_e=fix.v_e + float(v[1]),
            v_d=None if fix.v_d is None else fix.v_d + float(v[2]),
            latitude=fix.latitude + float(p[0]) / METRES_PER_RADIAN,
            longitude=fix.longitude + float(p[1]) / METRES_PER_RADIAN / float(np.cos(fix.latitude)),
            altitude=fix.altitude - float(p[2]),
        )

    return (change(s) if isinstance(s, GpsFix) else s for s in samples)


def fault(size: float) -> Kind:
    """For ten seconds the receiver's north velocity is false by ``size``, m/s."""

    def lay(samples: Sequence[Sample], ground: About) -> Iterator[Sample]:
        for s in samples:
            if isinstance(s, GpsFix) and 0.0 <= s.t - ground.moment < FAULT_S:
                yield replace(s, v_n=s.v_n + size)
            else:
                yield s

    def truth(_: Numbers, __: About) -> dict[str, float]:
        return {"gps_fault.offset": size}

    return Kind(f"GPS false by {size:g} m/s", ("gps_fault",), lay, truth)


# Errors of the recorded attitude.


def heading(by: float) -> Kind:
    """The recorded yaw is ``by`` rad too large."""

    def lay(samples: Sequence[Sample], _: About) -> Iterator[Sample]:
        return (
            replace(s, yaw=_wrapped(s.yaw + by)) if isinstance(s, AttitudeSample) else s
            for s in samples
        )

    return Kind(
        f"heading {np.degrees(by):+.0f} deg",
        ("heading_error",),
        lay,
        lambda before, _: {"heading": before["heading"] + by},
    )


def tilted(by: float) -> Kind:
    """The recorded attitude is turned about the body's x axis by ``by`` rad too much."""

    def lay(samples: Sequence[Sample], _: About) -> Iterator[Sample]:
        for s in samples:
            if isinstance(s, AttitudeSample):
                yield _turned_attitude(s, about_x(by))
            else:
                yield s

    return Kind(
        f"attitude tilted {np.degrees(by):+.0f} deg",
        ("mount_tilt",),
        lay,
        lambda before, _: {"tilt_roll": before["tilt_roll"] + by},
    )


def attitude_late(by: float) -> Kind:
    """The recorded attitude is stamped ``by`` seconds later."""

    def lay(samples: Sequence[Sample], _: About) -> Iterator[Sample]:
        return (replace(s, t=s.t + by) if isinstance(s, AttitudeSample) else s for s in samples)

    return Kind(
        f"attitude later {1e3 * by:.0f} ms",
        ("imu_delay",),
        lay,
        lambda before, _: {"imu_delay": before["imu_delay"] + by},
    )


def _turned_attitude(s: AttitudeSample, by: Array) -> AttitudeSample:
    R = from_angles(s.roll, s.pitch, s.yaw) @ by
    return replace(
        s,
        roll=float(np.arctan2(R[2, 1], R[2, 2])),
        pitch=float(-np.arcsin(np.clip(R[2, 0], -1.0, 1.0))),
        yaw=float(np.arctan2(R[1, 0], R[0, 0])),
    )


def about_x(angle: float) -> Array:
    """(3, 3) turn about x."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def from_angles(roll: float, pitch: float, yaw: float) -> Array:
    """(3, 3) body axes to NED of the usual angles, rad: yaw, then pitch, then roll."""
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(a), np.sin(a)) for a in (roll, pitch, yaw))
    return np.array(
        [
            [cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy],
            [cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy],
            [-sp, sr * cp, cr * cp],
        ]
    )


def _wrapped(angle: float) -> float:
    return float(np.arctan2(np.sin(angle), np.cos(angle)))


KINDS: tuple[Kind, ...] = (
    offset(X, 0.3),
    offset(Y, -0.3),
    offset(Z, 0.2),
    scale(X, 1.03),
    scale(Y, 0.97),
    scale(Z, 1.02),
    step(X, 0.5),
    step(Y, -0.3),
    step(Z, 0.3),
    ramp(Y, 0.003),
    warmed(X, 0.05),
    crossed(X, Y, 0.05),
    crossed(Y, Z, 0.03),
    turned(float(np.radians(3.0))),
    latency(0.06),
    latency(0.10),
    skewed(5e-4),
    averaged(),
    antenna(X, 0.5),
    antenna(Z, -0.4),
    fault(3.0),
    heading(float(np.radians(6.0))),
    tilted(float(np.radians(3.0))),
    attitude_late(0.05),
)
"""Two dozen errors, of sizes that a vehicle could have and nobody would want."""
