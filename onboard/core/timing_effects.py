"""Effects that are always in the model, and those that act on samples: when they count as found.

Timing is always estimated; it becomes an effect past the sizes that contracts.md names.  Constant
errors of the recorded attitude likewise: an EKF is never exact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from onboard.core.engine import Chunk
from onboard.core.findings import Effect, Quantity
from onboard.core.linearisation import Linearisation
from onboard.core.regimes import spans
from onboard.core.result import Estimate
from onboard.core.samples import Vector3
from onboard.core.solution import Solution
from onboard.core.traces import EpochTrace

Array = NDArray[np.float64]

LATENCY_S, WINDOW_S, IMU_DELAY_S = 0.05, 0.15, 0.03
TRIM_RAD = np.deg2rad(0.5)
TILT_RAD, HEADING_RAD = np.deg2rad(1.0), np.deg2rad(2.5)
SURE = 4.0
EKF_FLOOR = {"tilt_roll": 0.003, "tilt_pitch": 0.006, "heading": 0.005}
"""What an EKF's mean attitude is off by without anything being wrong, rad: ArduPlane's mean pitch
was off by up to 0.011 (0.007 RMS) in ten simulated flights, its roll by up to 0.0025."""
FAULT_S = 1.0
FAULT_M_S = 0.7
ONSET_FIXES = 3
RAIL_SAMPLES, RAIL_RUN = 12, 4
FEWEST_CLIPPED = 5
"""Clipped samples between two reports that are more than a knock."""
LEAST_RAIL = 10.3
"""More than any accelerometer that is at rest reads, m/s^2."""

STANDING: dict[str, tuple[str, ...]] = {
    "gps_latency": ("gps_delay",),
    "gps_smoothing": ("window_squared",),
    "imu_delay": ("attitude_delay",),
    "mount_tilt": ("tilt_roll", "tilt_pitch"),
    "heading_error": ("heading",),
}
"""Unknowns that are always in the model and become an effect past a size."""
ATTITUDE_ERRORS = ("imu_delay", "mount_tilt", "heading_error")

LEAST = {"gps_latency": LATENCY_S, "gps_smoothing": WINDOW_S, "imu_delay": IMU_DELAY_S}
"""Sizes from which timing is an effect, s."""

Standing = dict[str, tuple[dict[str, Quantity], str, dict[str, float]]]


def standing_effects(
    timing: Mapping[str, Estimate],
    solution: Solution,
    index: Mapping[str, int],
    point: Linearisation,
    told: float,
    trim: Vector3,
) -> Standing:
    """Timing and constant attitude errors that are large enough and sure enough to report.

    The tilt is that of the attitude *as recorded*: AHRS_TRIM, which was taken out of it before,
    is part of it, and a trim that is set makes half a degree worth mentioning.
    """
    out: Standing = {}
    delay = timing["gps_delay_s"]
    if abs(delay.value - told) > LATENCY_S and abs(delay.value - told) > SURE * delay.sigma:
        out["gps_latency"] = (
            {"delay": Quantity(delay.value, delay.sigma, "s")},
            "tell the autopilot the receiver's latency",
            {"GPS1_DELAY_MS": float(round(1e3 * delay.value))},
        )
    window = timing["gps_smoothing_window_s"]
    if window.value > WINDOW_S and window.value > SURE * window.sigma:
        out["gps_smoothing"] = (
            {"window": Quantity(window.value, window.sigma, "s")},
            "set the receiver's dynamic model to airborne and raise its rate",
            {},
        )
    lag = timing["imu_delay_s"]
    if abs(lag.value) > IMU_DELAY_S and abs(lag.value) > SURE * lag.sigma:
        out["imu_delay"] = (
            {"delay": Quantity(lag.value, lag.sigma, "s")},
            "look at the stream set-up and at INS_ACCEL_FILTER",
            {},
        )
    sigma = np.sqrt(np.diag(solution.covariance)).copy()
    for name, floor in EKF_FLOOR.items():
        sigma[index[name]] = np.hypot(sigma[index[name]], floor)
    roll, pitch, yaw = (index[n] for n in ("tilt_roll", "tilt_pitch", "heading"))
    extra_roll, extra_pitch = float(solution.theta[roll]), float(solution.theta[pitch])
    extra, known = float(np.hypot(extra_roll, extra_pitch)), float(np.hypot(*trim[:2]))
    whole = float(np.hypot(extra_roll - trim[0], extra_pitch - trim[1]))
    sure = max(abs(extra_roll) / sigma[roll], abs(extra_pitch) / sigma[pitch])
    surely_whole = max(
        abs(extra_roll - trim[0]) / sigma[roll], abs(extra_pitch - trim[1]) / sigma[pitch]
    )
    missing = extra > TILT_RAD and sure > SURE
    trimmed = known > TRIM_RAD and whole > TRIM_RAD and surely_whole > 3.0
    if missing or trimmed:
        cure = "level the autopilot again, or set AHRS_TRIM"
        if not missing:
            cure = "none: AHRS_TRIM holds this tilt already and was added back"
        out["mount_tilt"] = (
            {
                "roll": Quantity(extra_roll - trim[0], float(sigma[roll]), "rad"),
                "pitch": Quantity(extra_pitch - trim[1], float(sigma[pitch]), "rad"),
            },
            cure,
            {"AHRS_TRIM_X": trim[0] - extra_roll, "AHRS_TRIM_Y": trim[1] - extra_pitch}
            if missing
            else {"AHRS_TRIM_X": trim[0], "AHRS_TRIM_Y": trim[1]},
        )
    heading = point.heading + float(solution.theta[yaw])
    if abs(heading) > HEADING_RAD and abs(heading) > SURE * sigma[yaw]:
        out["heading_error"] = (
            {"yaw": Quantity(heading, float(sigma[yaw]), "rad")},
            "calibrate the compass; check COMPASS_DEC and COMPASS_ORIENT",
            {},
        )
    return out


def without(
    names: Sequence[str],
    index: Mapping[str, int],
    point: Linearisation,
    absent: Array,
    told: float,
    trim: Vector3,
) -> Array:
    """(m,) values at which the unknowns ``names`` are not in the model.

    A tilt is that of the attitude as recorded: without it the trim would not have been taken out.
    """
    at = absent.copy()
    taken = {
        "gps_delay": told - point.delay,
        "window_squared": -(point.window**2),
        "attitude_delay": -point.attitude_delay,
        "heading": -point.heading,
        "tilt_roll": trim[0],
        "tilt_pitch": trim[1],
    }
    for name in names:
        at[index[name]] = taken.get(name, 0.0)
    return at


def fault_effect(
    traces: Sequence[EpochTrace],
    chunks: Sequence[Chunk],
    t0: float,
    least: float,
    coast_s: float,
    distrusted: Sequence[tuple[float, float]] = (),
) -> Effect | None:
    """GPS velocities that cannot be true: refused by the innovation gate for a while.

    Args:
        traces: of every epoch.
        chunks: the flight.
        t0: s on the boot clock.
        least: m/s by which no honest receiver is off.
        coast_s: how long the filter goes on without a velocity, s.
        distrusted: s since ``t0`` in which the receiver contradicted itself; they stand for a
            fault where the inertia, lost itself, cannot tell.
    """
    judged = [x for x in traces if x.velocities or "velocity" in x.refused]
    bad = [(x.t, "velocity" in x.refused) for x in judged]
    refused = {x.t: x.refused_by[:2] for x in traces if len(x.refused_by)}
    spells: list[_Spell] = []
    run: list[float] = []
    for t, is_bad in [*bad, (np.inf, False)]:
        if is_bad:
            run.append(t)
        elif run and t - run[-1] > 2.0:
            off = [refused[u] for u in run if u in refused]
            mean = np.median(np.array(off), axis=0) if off else None
            # A noisy receiver errs to all sides: the mean of its errors says nothing.
            sizes_m_s = np.linalg.norm(off, axis=1) if off else np.zeros(1)
            size = float(np.median(sizes_m_s))
            # A receiver fails at once; what grows from the gate on is a filter that drifts.
            at_once = float(np.median(sizes_m_s[:ONSET_FIXES])) > least
            # A filter that had to begin anew does not tell its own failure from the receiver's.
            lost = run[-1] - run[0] >= 0.95 * coast_s and mean is not None
            long = len(run) >= 3 and run[-1] - run[0] >= FAULT_S
            if long and size > least and at_once:
                spread = float(np.std(sizes_m_s))
                onset = np.median(np.array(off[:ONSET_FIXES]), axis=0) if off else None
                spells.append(_Spell(run[0] - t0, run[-1] - t0, mean, size, onset, spread, lost))
            run = []
    spells = [s for s in _paired(spells) if not s.lost]
    spells = spells or [_Spell(a, b, None, 0.0) for a, b in distrusted]
    intervals = [(s.start, s.end) for s in spells]
    worst = max(spells, key=lambda s: s.size, default=None)
    if worst is None:
        return None
    inside = [x for x in traces if any(a <= x.t - t0 <= b for a, b in intervals)]
    return Effect(
        name="gps_fault",
        unknowns={
            "offset": Quantity(
                worst.size,
                float(np.hypot(least / 8.0, worst.spread)),
                "m/s",
            ),
            "duration": Quantity(float(sum(b - a for a, b in intervals)), 0.5, "s"),
        },
        share_of_mismatch=len(inside) / max(len(traces), 1),
        delta_bic=0.0,
        held_out_before=float("nan"),
        held_out_after=float("nan"),
        parameters={},
        cure="look at the antenna's view of the sky, at jamming, at the receiver's power",
        where=spans(chunks, t0, intervals, _earth_axis(spells)),
        intervals=tuple(intervals),
    )


@dataclass(frozen=True, slots=True)
class _Spell:
    """Refused velocities in a row.

    ``off`` (2,) is their median innovation, None where untrusted, ``size`` its median length,
    ``onset`` (2,) the first of it and ``spread`` its scatter, m/s; ``lost`` if the filter gave in
    before the velocities did.
    """

    start: float
    end: float
    off: Array | None
    size: float
    onset: Array | None = None
    spread: float = 0.0
    lost: bool = False


def _earth_axis(spells: Sequence[_Spell]) -> str:
    """The horizontal axis on which the velocity was off most."""
    known = [s for s in spells if s.off is not None and len(s.off) > 1]
    if not known:
        return "earth_north"
    worst = max((s.off for s in known if s.off is not None), key=lambda x: float(np.linalg.norm(x)))
    return "earth_north" if abs(worst[0]) >= abs(worst[1]) else "earth_east"


def _paired(spells: list[_Spell]) -> list[_Spell]:
    """Join a fault that outlasted the filter's patience with the jump back at its end.

    A constant error that was taken for a new velocity in the middle shows again, with the other
    sign, when the receiver recovers: the fault ends where the second spell starts, and whose
    failure it was is no question any more.
    """
    out: list[_Spell] = []
    for spell in spells:
        before = out[-1].off if out else None
        if before is not None and spell.onset is not None:
            sizes = float(np.linalg.norm(before) * np.linalg.norm(spell.onset))
            if float(before @ spell.onset) < -0.5 * sizes and spell.start - out[-1].end < 120.0:
                out[-1] = replace(out[-1], end=spell.start, lost=False)
                continue
        out.append(spell)
    return out


def saturation_effect(chunks: Sequence[Chunk], t0: float, imu: int) -> Effect | None:
    """An accelerometer at the rail of its range: stuck samples, or a count of clipped ones.

    Args:
        chunks: the flight.
        t0: first sample, s.
        imu: which accelerometer, from 1.
    """
    if not chunks:
        return None
    return _stuck(chunks, t0) or _counted(chunks, t0, imu)


def _counted(chunks: Sequence[Chunk], t0: float, imu: int) -> Effect | None:
    """Clipping that the autopilot has counted; a low-pass hides the rail from the samples."""
    names = [c.stretch.slow["clipping"] for c in chunks if "clipping" in c.stretch.slow]
    if not names:
        return None
    t = np.concatenate([x[0] for x in names])
    counts = np.concatenate([np.atleast_2d(x[1].T).T for x in names])
    if imu > counts.shape[1]:
        return None
    t, first = np.unique(t, return_index=True)
    rise = np.diff(counts[first, imu - 1])
    hit = np.flatnonzero(rise >= FEWEST_CLIPPED)
    if len(hit) < 2:
        return None
    spans_of = [(float(t[i]), float(t[i + 1])) for i in hit]
    joined: list[tuple[float, float]] = []
    for begin, end in spans_of:
        if joined and begin - joined[-1][1] < 1e-3:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((begin, end))
    raw = np.concatenate([c.stretch.raw_s for c in chunks])
    times = np.concatenate([c.stretch.t for c in chunks])
    inside = np.zeros(len(times), dtype=bool)
    for begin, end in joined:
        inside |= (times >= begin) & (times <= end)
    if not inside.any():
        return None
    tops = np.percentile(np.abs(raw[inside]), 99.9, axis=0)
    worst = int(np.argmax(tops))
    top = float(tops[worst])
    return _saturation(chunks, t0, top, 0.03 * top, worst, joined, float(inside.mean()))


def _stuck(chunks: Sequence[Chunk], t0: float) -> Effect | None:
    """Accelerometer samples that stay at one extreme value: the rail of its range."""
    raw = np.concatenate([c.stretch.raw_s for c in chunks])
    t = np.concatenate([c.stretch.t for c in chunks])
    best: tuple[int, float, NDArray[np.bool_], int] | None = None
    for j in range(3):
        for sign in (1.0, -1.0):
            x = sign * raw[:, j]
            top = float(x.max())
            at = x >= top - 1e-9
            runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], at.astype(int), [0]]))))[::2]
            stuck = at.sum() >= RAIL_SAMPLES and runs.max() >= RAIL_RUN and at.mean() < 0.5
            if stuck and top > LEAST_RAIL and (best is None or at.sum() > best[0]):
                best = (int(at.sum()), sign * top, at, j)
    if best is None:
        return None
    where = t[best[2]]
    cuts = np.flatnonzero(np.diff(where) > 2.0)
    starts = np.concatenate([[where[0]], where[cuts + 1]])
    ends = np.concatenate([where[cuts], [where[-1]]])
    found = [(float(a), float(b)) for a, b in zip(starts, ends, strict=True)]
    return _saturation(chunks, t0, abs(best[1]), 0.01, best[3], found, best[0] / len(t))


def _saturation(
    chunks: Sequence[Chunk],
    t0: float,
    limit: float,
    sigma: float,
    sensor_axis: int,
    clipped: Sequence[tuple[float, float]],
    share: float,
) -> Effect:
    """The record of a clipping accelerometer; ``clipped`` s on the boot clock."""
    intervals = tuple((a - t0, b - t0) for a, b in clipped)
    axis = "body_" + "xyz"[int(np.argmax(np.abs(chunks[0].stretch.R_bs[:, sensor_axis])))]
    return Effect(
        name="saturation",
        unknowns={"limit": Quantity(limit, sigma, "m/s^2")},
        share_of_mismatch=share,
        delta_bic=0.0,
        held_out_before=float("nan"),
        held_out_after=float("nan"),
        parameters={},
        cure="damp the mount; use a sensor with a wider range",
        where=spans(chunks, t0, intervals, axis),
        intervals=intervals,
    )
