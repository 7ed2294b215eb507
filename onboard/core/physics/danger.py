"""When a finding is a danger to the vehicle, beyond what it does to a calibration.

The bounds are ArduPilot's own: what its EKF3 can learn, or believes, with the parameters that it
has by default.  What is beyond them is not made up for in flight by anybody.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.core.physics.finding import Finding

BIAS_M_S2 = 1.0
"""An accelerometer's bias up to which EKF3 learns it (EK3_ACC_BIAS_LIM)."""
HEADING_RAD = math.radians(45.0)
"""From here on EKF3 takes the compass for false, if GPS disagrees as well (controlMagYawReset)."""
ASTRAY_M = 25.0
"""A position further off than this is a glitch to EKF3 (EK3_GLITCH_RAD)."""


def of_response(found: Finding) -> str:
    """Of an effect that shifts the offset, or the heading, with a signal, over what was flown."""
    curve = found.response_curve
    if curve is None or not curve.y:
        return ""
    every = np.abs(np.concatenate([np.ravel(y) for y in curve.y.values()]))
    most = float(np.max(every, initial=0.0, where=np.isfinite(every)))
    if curve.quantity_unit == "m/s^2" and most > BIAS_M_S2:
        return (
            f"the offset was wrong by up to {most:.1f} m/s², and ArduPilot's EKF makes up for "
            f"{BIAS_M_S2:.0f} m/s² at most (EK3_ACC_BIAS_LIM)"
        )
    if curve.quantity == "heading error":
        return of_heading(math.radians(most))
    return ""


def of_heading(error_rad: float) -> str:
    """Of a heading that is off by so much."""
    if not abs(error_rad) > HEADING_RAD:
        return ""
    return (
        f"the heading was wrong by up to {math.degrees(abs(error_rad)):.0f}°, and a vehicle that "
        f"holds its position with more than {math.degrees(HEADING_RAD):.0f}° circles and runs away"
    )


def of_false_velocity(speed_m_s: float, duration_s: float) -> str:
    """Of a receiver that reported a velocity that was not there."""
    astray = abs(speed_m_s) * duration_s
    if not astray > ASTRAY_M:
        return ""
    return f"an autopilot that believes this velocity is led {astray:.0f} m astray"
