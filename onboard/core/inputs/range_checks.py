"""What no sensor can have measured: a damaged record, refused at the door and counted by name.

DataFlash and ULog records carry no checksum, so that a flipped bit arrives here as a number.
Only what is physically impossible is refused; what is merely unlikely is judged later.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample, ParameterValue, Sample
from onboard.core.maths.arrays import Array

LONGEST_UPTIME_S = 1e9
MOST_FORCE = 1000.0
"""m/s^2; the widest ranges of the accelerometers that autopilots carry end near 320."""
MOST_RATE = 100.0
"""rad/s; gyroscopes end near 70."""
MOST_ANGLE = 10.0
MOST_SPEED = 1000.0
"""m/s; receivers stop at 515 by regulation."""
MOST_HEIGHT = 1e5
"""m"""
LATEST_S = 1.0
"""s; between the arrival of a fix and its record: an autopilot that is five fixes behind flies by
none of them [physics]."""
MOST_PARAMETER = 1e30
PARAMETER_LIMITS = (("SCAL_", 10.0), ("OFFS_", 1000.0), ("AHRS_TRIM_", 10.0), ("POS", 1000.0))
"""Part of a name that begins with INS, AHRS or GPS, and what its magnitude stays below by far:
places of antennas and sensors, m, are within a vehicle [physics]."""
ACCELEROMETERS = range(1, 6)


def measured(sample: Sample) -> Sample:
    """The sample without what it says is no number, or cannot be.

    A receiver may have no vertical velocity; and a damaged record may have a moment of arrival that
    is nowhere near the fix.
    """
    if not isinstance(sample, GpsFix):
        return sample
    if sample.v_d is not None and math.isnan(sample.v_d):
        sample = replace(sample, v_d=None)
    if sample.t_message is not None and not abs(sample.t_message - sample.t) < LATEST_S:
        sample = replace(sample, t_message=None)
    return sample


def impossible(sample: Sample) -> str | None:
    """Name under which a sample is refused; None if it can be true.  Never raises."""
    # Comparisons are written so that NaN fails them; squares by * do not raise on overflow.
    if isinstance(sample, ImuSample):
        x, y, z = sample.f_b
        if not x * x + y * y + z * z < MOST_FORCE * MOST_FORCE:
            return "imu_impossible"
        if sample.w_b is not None:
            x, y, z = sample.w_b
            if not x * x + y * y + z * z < MOST_RATE * MOST_RATE:
                return "imu_impossible"
        if sample.imu not in ACCELEROMETERS or not -LONGEST_UPTIME_S < sample.t < LONGEST_UPTIME_S:
            return "imu_impossible"
    elif isinstance(sample, AttitudeSample):
        x, y, z = sample.roll, sample.pitch, sample.yaw
        if not x * x + y * y + z * z < MOST_ANGLE * MOST_ANGLE or not _is_time(sample.t):
            return "attitude_impossible"
    elif isinstance(sample, GpsFix):
        x, y, z = sample.v_n, sample.v_e, sample.v_d or 0.0
        if not (
            x * x + y * y + z * z < MOST_SPEED * MOST_SPEED
            and abs(sample.altitude) < MOST_HEIGHT
            and math.isfinite(sample.latitude + sample.longitude)
            and _is_time(sample.t)
        ):
            return "gps_impossible"
    elif isinstance(sample, ParameterValue):
        limit = MOST_PARAMETER
        if sample.name.startswith(("INS", "AHRS", "GPS")):
            limit = next((most for part, most in PARAMETER_LIMITS if part in sample.name), limit)
        if not abs(sample.value) < limit:
            return "parameter_impossible"
    elif not _is_time(sample.t):
        return "impossible"
    return None


def imu_possible(imu: int, t: Array, rows: Array) -> bool:
    """Whether :func:`impossible` has nothing against any of many inertial samples.

    Args:
        imu: number of the accelerometer.
        t: (n,) s.
        rows: (n, 6) rate, rad/s, and force, m/s^2.
    """
    return (
        imu in ACCELEROMETERS
        and _all_below(LONGEST_UPTIME_S, t[:, None])
        and _all_below(MOST_RATE, rows[:, :3])
        and _all_below(MOST_FORCE, rows[:, 3:])
    )


def attitudes_possible(t: Array, angles: Array) -> bool:
    """The same of attitudes: times (n,), s; roll, pitch and yaw (n, 3), rad."""
    return _all_below(LONGEST_UPTIME_S, t[:, None]) and _all_below(MOST_ANGLE, angles)


def _all_below(most: float, x: Array) -> bool:
    """Whether rows of ``x`` (n, d) are shorter than ``most``."""
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.all((x * x).sum(axis=1) < most * most))


def _is_time(t: float) -> bool:
    return -LONGEST_UPTIME_S < t < LONGEST_UPTIME_S
