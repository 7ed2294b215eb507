"""Forces along a copter's rotors of which no effect knows, and which repeat with its motion.

Commands, voltage, density, climb and drag along the axis are effects; so are numbers beside them
for all that is linear or square in the climb.  What is left are laws of the flow across the rotors,
of what lasts (motors that get warm), and of turning.  Each is taken without the part that effects
could have made on this flight (a constant, the voltage's course, drag along the axis): the numbers
that are told stay those of the effects that are nearest to it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.vehicle.air import UP, Air
from onboard.core.vehicle.effects.beyond import LAWS, Law

INDUCED_M_S = 5.5
"""Flow that rotors make in a hover: of 75 N/m^2, as multicopters carry, m/s [data sheet]."""
WARM_S = 60.0
"""In which windings and magnets get as warm as they become, s [data sheet]."""


def _up(force: Array) -> Array:
    """(n, 3) of a force (n,) upwards."""
    return np.stack([0.0 * force, 0.0 * force, -force], axis=1)


def _of_thrust(air: Air, share: Array) -> Array:
    """(n, 3) of a share (n,) of what the rotors pull; none where nobody knows the commands."""
    return _up(np.zeros(len(share)) if air.thrust is None else air.thrust * share)


def _apart(air: Air, x: Array, *others: Array) -> Array:
    """(n,) what of it others (n,), and a constant of each flight, do not make."""
    part = air.flight.part
    count = np.maximum(np.bincount(part), 1)

    def about_its_mean(y: Array) -> Array:
        out: Array = y - (np.bincount(part, y) / count)[part]
        return out

    left = about_its_mean(x)
    if not others:
        return left
    made = np.column_stack([about_its_mean(y) for y in others])
    out: Array = left - made @ np.linalg.lstsq(made, left, rcond=None)[0]
    return out


def _lasting(air: Air, x: Array) -> Array:
    """(n, 3) of what goes with time, but for what a voltage that falls with it makes."""
    volts = () if air.volts is None else (np.log(np.maximum(air.volts, 0.1)),)
    return _of_thrust(air, _apart(air, x, *volts))


def _across(air: Air) -> Array:
    out: Array = np.hypot(air.u_b[:, 0], air.u_b[:, 1])
    return out


def _forward(air: Air) -> Array:
    """What of the flow that they make is gone: ``v_i = v_h^2 / sqrt(V^2 + v_i^2)``.

    H. Glauert, ARC R&M 1111 (1926), in level flight.
    """
    half = 0.5 * (_across(air) / INDUCED_M_S) ** 2
    return _of_thrust(air, 1.0 - np.sqrt(np.sqrt(half**2 + 1.0) - half))


def _lifting(air: Air) -> Array:
    return _up(_across(air) ** 2)


def _ahead(air: Air) -> Array:
    return _up(air.u_b[:, 0])


def _inclined(air: Air) -> Array:
    u = air.u_b[:, 2]
    return _up(_apart(air, _across(air) * u, u, u * np.abs(u)))


def _sinking(air: Air) -> Array:
    u = air.u_b[:, 2]
    return _up(_apart(air, u**3, u, u * u, u * np.abs(u)))


def _yawing(air: Air) -> Array:
    return _up(STANDARD_GRAVITY * air.flight.w_b[:, 2])


def _spinning(air: Air) -> Array:
    return _up(np.sum(air.flight.w_b[:, :2] ** 2, axis=1))


def _tiring(air: Air) -> Array:
    return _lasting(air, air.flight.since_start / WARM_S)


def _warming(air: Air) -> Array:
    return _lasting(air, np.exp(-air.flight.since_start / WARM_S))


def _higher(air: Air) -> Array:
    return _of_thrust(air, _apart(air, air.flight.height))


AXIS = "along the rotors' axis that"
ROTORS: Mapping[str, Law] = {
    "forward": Law(_forward, 0.3, "1", f"{AXIS} grows with the speed across them", (UP,)),
    "lifting": Law(_lifting, 0.03, "1/m", f"{AXIS} goes with the square of the speed", (UP,)),
    "ahead": Law(_ahead, 0.2, "1/s", f"{AXIS} goes with the speed ahead", (UP,)),
    "inclined": Law(_inclined, 0.1, "1/m", f"{AXIS} goes with the speed times the climb", (UP,)),
    "sinking": Law(_sinking, 0.03, "s/m^2", f"{AXIS} is bent over the climb", (UP,)),
    "yawing": Law(_yawing, 0.1, "s", f"{AXIS} goes with the rate of yaw", (UP,)),
    "spinning": Law(_spinning, 0.3, "m", f"{AXIS} goes with rates of roll and pitch", (UP,)),
    "tiring": Law(_tiring, 0.05, "1", f"{AXIS} changes with time", (UP,)),
    "warming": Law(_warming, 0.1, "1", f"{AXIS} was another in the first minutes", (UP,)),
    "higher": Law(_higher, 0.003, "1/m", f"{AXIS} goes with the height", (UP,)),
}
"""Of low order in speed, rates, time and height, and no effect's of a copter."""
COPTERS: Mapping[str, Law] = {**LAWS, **ROTORS}
"""All that a copter is asked for, at one level of chance."""
