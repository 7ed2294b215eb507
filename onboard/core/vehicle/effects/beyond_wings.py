"""Forces on a plane of which no effect knows, and which repeat with its motion or its controls.

What bends a law that an effect has is taken without the part that the effect itself could have
made on this flight: the numbers that are told stay those of the law that is nearest to it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import AHEAD, SIDE, UP, Air
from onboard.core.vehicle.effects.airspeed_scale import COLUMN
from onboard.core.vehicle.effects.beyond import Law
from onboard.core.vehicle.plane_airframe import ELEVATOR, FLAP, THROTTLE

SLOWEST_M_S = 1.0
"""Airspeed below which nothing is by the airspeed [physics]."""


def _upwards(air: Air, coefficient: Array) -> Array:
    """(n, 3) specific force across the flow, by the pressure."""
    made = air.pressure * coefficient
    return np.stack([made * np.sin(air.alpha), 0.0 * made, -made * np.cos(air.alpha)], axis=1)


def _backwards(air: Air, coefficient: Array) -> Array:
    """(n, 3) along the flow."""
    made = air.pressure * coefficient
    return np.stack([-made * np.cos(air.alpha), 0.0 * made, -made * np.sin(air.alpha)], axis=1)


def _sideways(air: Air, coefficient: Array) -> Array:
    """(n, 3) along y."""
    made = air.pressure * coefficient
    return np.stack([0.0 * made, made, 0.0 * made], axis=1)


def _apart(shape: Array, weight: Array, *others: Array) -> Array:
    """(n,) what of a shape others (n,) do not make, by the squares of the force that it makes."""
    rows = weight[:, None] * np.stack(others, axis=1)
    made, *_ = np.linalg.lstsq(rows, weight * shape, rcond=None)
    out: Array = shape - np.stack(others, axis=1) @ made
    return out


def _speed(air: Air) -> Array:
    out: Array = np.maximum(np.linalg.norm(air.u_b, axis=1), SLOWEST_M_S)
    return out


def _slip(air: Air) -> Array:
    out: Array = np.arctan2(air.u_b[:, 1], np.maximum(np.abs(air.u_b[:, 0]), SLOWEST_M_S))
    return out


def _bent(air: Air) -> Array:
    one = np.ones(len(air.alpha))
    return _upwards(air, _apart(air.alpha**2, air.pressure, one, air.alpha))


def _polar(air: Air) -> Array:
    one = np.ones(len(air.alpha))
    return _backwards(air, _apart(air.lift, air.pressure, one, air.lift**2))


def _pitching(air: Air) -> Array:
    return _upwards(air, air.flight.w_b[:, 1] / _speed(air))


def _slipping(air: Air) -> Array:
    return _upwards(air, _slip(air) ** 2)


def _rolling(air: Air) -> Array:
    return _sideways(air, air.flight.w_b[:, 0] / _speed(air))


def _yawing(air: Air) -> Array:
    return _sideways(air, air.flight.w_b[:, 2] / _speed(air))


def _command(air: Air, column: int) -> Array:
    """(n,) of a control; none where it is not recorded."""
    if air.commands is None or air.commands.shape[1] <= column:
        return np.zeros(len(air.alpha))
    return air.commands[:, column]


def _pulled_up(air: Air) -> Array:
    thrust = np.zeros(len(air.alpha)) if air.thrust is None else air.thrust
    return np.stack([0.0 * thrust, 0.0 * thrust, -thrust], axis=1)


def _curved(air: Air) -> Array:
    if air.thrust is None:
        return np.zeros((len(air.alpha), 3))
    throttle = _command(air, THROTTLE)
    full = float(np.max(air.thrust)) / max(float(np.max(throttle)), 1e-9)
    bend = full * _apart(throttle**2, np.ones(len(throttle)), throttle)
    return np.stack([bend, 0.0 * bend, 0.0 * bend], axis=1)


def _by_elevator(air: Air) -> Array:
    return _upwards(air, _command(air, ELEVATOR))


def _by_flap(air: Air) -> Array:
    return _upwards(air, _command(air, FLAP))


def _flap_drag(air: Air) -> Array:
    return _backwards(air, _command(air, FLAP))


def _read_off(air: Air) -> Array:
    made = np.zeros((len(air.alpha), 4))
    made[:, COLUMN] = 1.0
    return made


READ_OFF = "the airspeed reads off by as much at every speed, and no setting makes that"
WINGS: Mapping[str, Law] = {
    "bent": Law(_bent, 10.0, "1/rad^2", "of lift that is no line over the angle of attack", (UP,)),
    "polar": Law(_polar, 0.1, "1", "of drag that is least at another lift than none", (AHEAD,)),
    "pitching": Law(
        _pitching, 1.0, "m", "along the lift that goes with the rate of pitch", (UP,), answers=True
    ),
    "slipping": Law(_slipping, 2.0, "1/rad^2", "along the lift that goes with sideslip", (UP,)),
    "rolling": Law(
        _rolling, 0.5, "m", "to the side that goes with the rate of roll", (SIDE,), answers=True
    ),
    "yawing": Law(
        _yawing, 0.5, "m", "to the side that goes with the rate of yaw", (SIDE,), answers=True
    ),
    "pulled_up": Law(_pulled_up, 0.1, "1", "upwards that goes with the throttle", (UP,)),
    "curved": Law(_curved, 1.0, "1", "of thrust that is no line over the throttle", (AHEAD,)),
    "by_elevator": Law(
        _by_elevator, 0.5, "1", "along the lift that goes with the elevator", (UP,), answers=True
    ),
    "by_flap": Law(_by_flap, 0.5, "1", "along the lift that goes with the flaps", (UP,)),
    "read_off": Law(_read_off, 1.0, "m/s", READ_OFF, (COLUMN,), sensed=True),
    "flap_drag": Law(_flap_drag, 0.1, "1", "along the flow that goes with the flaps", (AHEAD,)),
}
"""Of low order in angles, rates and controls, and no effect's of a plane."""
