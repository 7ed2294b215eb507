"""Effects that are always in the model, and those that act on samples: when they count as found.

Timing is always estimated; it becomes an effect past the sizes that contracts.md names.  Constant
errors of the recorded attitude likewise: an EKF is never exact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from onboard.core.calibrator import Calibrator
from onboard.core.engine import Chunk
from onboard.core.findings import Effect, Quantity
from onboard.core.passes import EpochTrace
from onboard.core.result import Estimate
from onboard.core.solution import Solution

Array = NDArray[np.float64]

LATENCY_S, WINDOW_S, IMU_DELAY_S = 0.05, 0.15, 0.03
TILT_RAD, HEADING_RAD = np.deg2rad(1.0), np.deg2rad(2.5)
SURE = 4.0
FAULT_S = 1.0
RAIL_SAMPLES, RAIL_RUN = 12, 4

Standing = dict[str, tuple[dict[str, Quantity], str, dict[str, float]]]


def standing_effects(
    timing: Mapping[str, Estimate], solution: Solution, index: Mapping[str, int], told: float
) -> Standing:
    """Timing and constant attitude errors that are large enough and sure enough to report."""
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
    sigma = np.sqrt(np.diag(solution.covariance))
    roll, pitch, yaw = (index[n] for n in ("tilt_roll", "tilt_pitch", "heading"))
    tilt = np.hypot(solution.theta[roll], solution.theta[pitch])
    if tilt > TILT_RAD and tilt > SURE * max(sigma[roll], sigma[pitch]):
        values = {"roll": roll, "pitch": pitch}
        out["mount_tilt"] = (
            {
                k: Quantity(float(solution.theta[i]), float(sigma[i]), "rad")
                for k, i in values.items()
            },
            "level the autopilot again, or set AHRS_TRIM",
            {
                "AHRS_TRIM_X": float(solution.theta[roll]),
                "AHRS_TRIM_Y": float(solution.theta[pitch]),
            },
        )
    heading = float(solution.theta[yaw])
    if abs(heading) > HEADING_RAD and abs(heading) > SURE * sigma[yaw]:
        out["heading_error"] = (
            {"yaw": Quantity(heading, float(sigma[yaw]), "rad")},
            "calibrate the compass; check COMPASS_DEC and COMPASS_ORIENT",
            {},
        )
    return out


def fault_effect(
    traces: Sequence[EpochTrace], chunks: Sequence[Chunk], calibrator: Calibrator, t0: float
) -> Effect | None:
    """GPS velocities that cannot be true: refused by the innovation gate or by plausibility."""
    bad = [(x.t, True) if "velocity" in x.refused else (x.t, False) for x in traces]
    if calibrator.trust.rejected.get("gps_glitch", 0):
        bad += [
            (float(t), True)
            for c in chunks
            for t, ok in zip(c.fixes.t, c.trusted, strict=True)
            if not ok
        ]
    bad.sort()
    intervals: list[tuple[float, float]] = []
    start = last = None
    count = 0
    for t, is_bad in [*bad, (np.inf, False)]:
        if is_bad:
            start, count = (t, 1) if start is None else (start, count + 1)
            last = t
        elif start is not None and last is not None and t - last > 2.0:
            if count >= 3 and last - start >= FAULT_S:
                intervals.append((start - t0, last - t0))
            start, count = None, 0
    if not intervals:
        return None
    inside = [x for x in traces if any(a <= x.t - t0 <= b for a, b in intervals)]
    return Effect(
        name="gps_fault",
        unknowns={
            "duration": Quantity(float(sum(b - a for a, b in intervals)), 0.5, "s"),
        },
        share_of_mismatch=len(inside) / max(len(traces), 1),
        delta_bic=0.0,
        held_out_before=float("nan"),
        held_out_after=float("nan"),
        parameters={},
        cure="look at the antenna's view of the sky, at jamming, at the receiver's power",
        intervals=tuple(intervals),
    )


def saturation_effect(chunks: Sequence[Chunk], t0: float) -> Effect | None:
    """Accelerometer samples that stay at one extreme value: the rail of its range."""
    if not chunks:
        return None
    raw = np.concatenate([c.stretch.raw_s for c in chunks])
    t = np.concatenate([c.stretch.t for c in chunks])
    best: tuple[int, float, NDArray[np.bool_]] | None = None
    for j in range(3):
        for sign in (1.0, -1.0):
            x = sign * raw[:, j]
            top = float(x.max())
            at = x >= top - 1e-9
            runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], at.astype(int), [0]]))))[::2]
            stuck = at.sum() >= RAIL_SAMPLES and runs.max() >= RAIL_RUN and at.mean() < 0.5
            if stuck and top > 12.0 and (best is None or at.sum() > best[0]):
                best = (int(at.sum()), sign * top, at)
    if best is None:
        return None
    where = t[best[2]]
    cuts = np.flatnonzero(np.diff(where) > 2.0)
    starts = np.concatenate([[where[0]], where[cuts + 1]])
    ends = np.concatenate([where[cuts], [where[-1]]])
    return Effect(
        name="saturation",
        unknowns={"limit": Quantity(abs(best[1]), 0.01, "m/s^2")},
        share_of_mismatch=best[0] / len(t),
        delta_bic=0.0,
        held_out_before=float("nan"),
        held_out_after=float("nan"),
        parameters={},
        cure="damp the mount; use a sensor with a wider range",
        intervals=tuple((float(a - t0), float(b - t0)) for a, b in zip(starts, ends, strict=True)),
    )
