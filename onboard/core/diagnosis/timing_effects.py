"""Effects that are always in the model: when they count as found.

Timing is always estimated; it becomes an effect past the sizes that contracts.md names.  Constant
errors of the recorded attitude likewise: an EKF is never exact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from onboard.core.estimate.gps_clock import FixClock
from onboard.core.estimate.result import Estimate
from onboard.core.estimate.solution import Solution
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.maths.arrays import Array
from onboard.core.model.linearisation import Linearisation
from onboard.core.physics.finding import Quantity
from onboard.core.physics.mount import attitude_advice

LATENCY_S, WINDOW_S, IMU_DELAY_S = 0.05, 0.15, 0.03
TILT_RAD, HEADING_RAD = np.deg2rad(1.0), np.deg2rad(2.5)
SURE = 4.0
EKF_FLOOR = {"tilt_roll": 0.003, "tilt_pitch": 0.006, "heading": 0.005}
"""What an EKF's mean attitude is off by without anything being wrong, rad: ArduPlane's mean pitch
was off by up to 0.011 (0.007 RMS) in ten simulated flights, its roll by up to 0.0025."""

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
    parameters: ParametersInForce,
    imu: int,
    clock: FixClock,
) -> Standing:
    """Timing and constant attitude errors that are large enough and sure enough to report."""
    out = _timing(timing, clock)
    sigma = np.sqrt(np.diag(solution.covariance)).copy()
    for name, floor in EKF_FLOOR.items():
        sigma[index[name]] = np.hypot(sigma[index[name]], floor)
    tilt = [index["tilt_roll"], index["tilt_pitch"]]
    extra = solution.theta[tilt]
    # As it is reported: a trim that makes it right again is its cure, whatever was meant by it.
    reported = extra - np.array(parameters.trim[:2])
    if min(np.hypot(*extra), np.hypot(*reported)) > TILT_RAD and (
        float(np.max(np.abs(extra) / sigma[tilt])) > SURE
    ):
        out["mount_tilt"] = (
            {
                key: Quantity(float(solution.theta[i]), float(sigma[i]), "rad")
                for key, i in zip(("roll", "pitch"), tilt, strict=True)
            },
            *attitude_advice(extra, solution.theta[:6], parameters, imu),
        )
    yaw = index["heading"]
    heading = point.heading + float(solution.theta[yaw])
    if abs(heading) > HEADING_RAD and abs(heading) > SURE * sigma[yaw]:
        out["heading_error"] = (
            {"yaw": Quantity(heading, float(sigma[yaw]), "rad")},
            "calibrate the compass; check COMPASS_DEC and COMPASS_ORIENT",
            {},
        )
    return out


def _timing(timing: Mapping[str, Estimate], clock: FixClock) -> Standing:
    out: Standing = {}
    delay = timing["gps_delay_s"]
    off = abs(delay.value - clock.configured_on_stamp)
    if off > LATENCY_S and off > SURE * delay.sigma:
        out["gps_latency"] = (
            {"delay": Quantity(delay.value, delay.sigma, "s")},
            *_of_latency(delay.value, clock),
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
    return out


def _of_latency(delay: float, clock: FixClock) -> tuple[str, dict[str, float]]:
    """What to do about a latency against the recording's stamps, and the parameter to set."""
    if clock.off(delay) < LATENCY_S:
        taken = " or ".join(f"{1e3 * lag:.0f}" for lag in clock.assumed)
        return f"none: {clock.name} is 0, for which this receiver's driver takes {taken} ms", {}
    cure = "tell the autopilot the receiver's latency"
    if not clock.configured and clock.assumed:
        taken = " or ".join(f"{1e3 * lag:.0f}" for lag in clock.assumed)
        cure += f" (0 stands for {taken} ms, by its driver)"
    if round(1e3 * clock.late):
        cure += (
            f"; the log stamps fixes {1e3 * clock.late:.0f} ms later than the time that the EKF "
            "counts from"
        )
    return cure, {clock.name: clock.setting(delay)}


def without(
    names: Sequence[str],
    index: Mapping[str, int],
    point: Linearisation,
    absent: Array,
    told: float,
) -> Array:
    """(m,) values at which the unknowns ``names`` are not in the model."""
    at = absent.copy()
    taken = {
        "gps_delay": told - point.delay,
        "window_squared": -(point.window**2),
        "attitude_delay": -point.attitude_delay,
        "heading": -point.heading,
    }
    for name in names:
        at[index[name]] = taken.get(name, 0.0)
    return at
