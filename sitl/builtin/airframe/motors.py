"""Motors: from thrust to command to pulse width and back.

``T = (rho/2) A (v_out^2 - v_in^2)`` with ``v_out = (V / V_max) v_max sqrt((1 - e) c + e c^2)``,
``c`` the command between spin_min and spin_max, ``v_in`` the air that comes from above.
"""

from __future__ import annotations

import numpy as np

from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.smoothing import Array

QUAD_X_DEG = (45.0, -135.0, -45.0, 135.0)
"""Angles from the nose of motors 1 ... 4, ArduPilot's frame X."""
QUAD_X_SPIN = (1.0, 1.0, -1.0, -1.0)
SHARE_LEFT = 0.9
"""No torque may take more of a motor's thrust than this."""
YAW_ARM = 0.025
"""Torque about z per thrust of a propeller, m."""
DAMPING_DEG = 400.0


def curve(command: Array, expo: float) -> Array:
    """Share of full thrust at a command of 0 ... 1."""
    return (1.0 - expo) * command + expo * command**2


def inverse_curve(share: Array, expo: float) -> Array:
    """Command that gives a share of full thrust; may be past 1, which no motor can do."""
    share = np.maximum(share, 0.0)
    if abs(expo) < 1e-9:
        return share
    root = np.sqrt(np.maximum((1.0 - expo) ** 2 + 4.0 * expo * share, 0.0))
    # This form does not lose digits at small commands.
    out: Array = 2.0 * share / ((1.0 - expo) + root)
    return out


def thrust(
    frame: Airframe, command: Array, *, density: Array, inflow: Array, voltage: Array
) -> Array:
    """(n, k) N of each motor at (n, k) commands; the other arrays are (n,)."""
    outflow = frame.outflow_max * voltage / frame.maxVoltage
    squares = outflow[:, None] ** 2 * curve(command, frame.propExpo) - inflow[:, None] ** 2
    return 0.5 * density[:, None] * (frame.effective_area / frame.num_motors) * squares


def command(
    frame: Airframe, force: Array, *, density: Array, inflow: Array, voltage: Array
) -> Array:
    """(n, k) commands at which the motors make (n, k) N: :func:`thrust` the other way round."""
    area = frame.effective_area / frame.num_motors
    squares = force / (0.5 * density[:, None] * area) + inflow[:, None] ** 2
    outflow = frame.outflow_max * voltage / frame.maxVoltage
    return inverse_curve(squares / outflow[:, None] ** 2, frame.propExpo)


def pulse(frame: Airframe, command: Array) -> Array:
    """Pulse width at a command, us."""
    spin = frame.spin_min + command * (frame.spin_max - frame.spin_min)
    return frame.pwmMin + spin * (frame.pwmMax - frame.pwmMin)


def command_of_pulse(frame: Airframe, pwm: Array) -> Array:
    """Command of 0 ... 1 at a pulse width (us)."""
    spin = (pwm - frame.pwmMin) / (frame.pwmMax - frame.pwmMin)
    return np.clip((spin - frame.spin_min) / (frame.spin_max - frame.spin_min), 0.0, 1.0)


def arms(frame: Airframe) -> tuple[Array, Array, Array]:
    """Places of the motors and how they spin: (k,) x, y in m, and signs."""
    if frame.num_motors == len(QUAD_X_DEG):
        angle, spin = np.radians(QUAD_X_DEG), np.array(QUAD_X_SPIN)
    else:
        angle = (np.arange(frame.num_motors) + 0.5) * (2.0 * np.pi / frame.num_motors)
        spin = np.where(np.arange(frame.num_motors) % 2, -1.0, 1.0)
    return frame.diagonal_size * np.cos(angle), frame.diagonal_size * np.sin(angle), spin


def shared(frame: Airframe, total: Array, w_b: Array, turning: Array) -> Array:
    """(n, k) thrust of each motor: ``total`` (n,) N and what turns the body as it turns.

    Args:
        frame: whose motors.
        total: sum over the motors, N; kept exactly.
        w_b: (n, 3) body rates, rad/s.
        turning: (n, 3) their derivative, rad/s^2.
    """
    x, y, spin = arms(frame)
    inertia = np.array(frame.inertia)
    damping = np.radians(DAMPING_DEG) / frame.refRotRate if frame.refRotRate > 0.0 else 0.0
    torque = inertia * (turning + damping * w_b) + np.cross(w_b, w_b * inertia)
    each = (
        np.outer(torque[:, 0], -y / np.sum(y**2))
        + np.outer(torque[:, 1], x / np.sum(x**2))
        + np.outer(torque[:, 2], spin / (frame.num_motors * YAW_ARM))
    )
    each -= np.mean(each, axis=1)[:, None]
    mean = np.maximum(total, 0.0) / frame.num_motors
    largest = np.max(np.abs(each), axis=1)
    # Turning yields to lift, as in a mixer.
    keep = np.minimum(1.0, SHARE_LEFT * mean / np.maximum(largest, 1e-9))
    out: Array = mean[:, None] + each * keep[:, None]
    return out
