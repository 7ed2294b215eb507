"""Errors of a GPS receiver and of its stamps, put into its fixes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.real.concealed_attitude import from_angles
from benchmarks.real.concealed_kind import LETTERS, About, Array, Kind, Numbers, added, unit
from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample, Sample

LONGEST_AVERAGED_S = 0.21
"""Fixes further apart than this would average over longer than any receiver."""
FAULT_S = 10.0
METRES_PER_RADIAN = 6.371e6


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
        added("clock_skew", "rate", rate),
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
    r = unit(axis, arm)
    return Kind(
        f"antenna {key} {arm:+g} m",
        ("gps_lever_arm",),
        lambda s, g: _on_arm(s, g, r),
        added("gps_lever_arm", key, arm),
    )


def _on_arm(samples: Sequence[Sample], ground: About, r: Array) -> Iterator[Sample]:
    """Velocity gains ``R (w x r)`` and position ``R r``, as the receiver weighs them."""
    attitude = [s for s in samples if isinstance(s, AttitudeSample)]
    rates = [
        s for s in samples if isinstance(s, ImuSample) and s.imu == ground.imu and s.w_b is not None
    ]
    t_a, t_w = np.array([s.t for s in attitude]), np.array([s.t for s in rates])
    angles = np.unwrap(np.array([(s.roll, s.pitch, s.yaw) for s in attitude]), axis=0)
    if ground.heading.size:
        # A recorded heading that is wrong, or set anew, would put the antenna elsewhere each time.
        at, heading = ground.heading
        off = np.unwrap(np.interp(at, t_a, angles[:, 2]) - heading)
        angles[:, 2] -= np.interp(t_a, at, off)
    w_b = np.array([s.w_b for s in rates])
    span, weights = ground.response

    def change(fix: GpsFix) -> GpsFix:
        t = fix.t - ground.late + span
        a = np.stack([np.interp(t, t_a, angles[:, j]) for j in range(3)], axis=-1)
        w = np.stack([np.interp(t, t_w, w_b[:, j]) for j in range(3)], axis=-1)
        R = [from_angles(*row) for row in a]
        v = weights @ np.array([m @ np.cross(rate, r) for m, rate in zip(R, w, strict=True)])
        p = weights @ np.array([m @ r for m in R])
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
