"""The model of a plane: which effects, in which order, and what its outputs command."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.air_density import AirDensity
from onboard.core.vehicle.effects.airspeed_lag import AirspeedLag
from onboard.core.vehicle.effects.airspeed_scale import COLUMN, AirspeedScale
from onboard.core.vehicle.effects.attitude_error import AttitudeError
from onboard.core.vehicle.effects.beyond import Beyond
from onboard.core.vehicle.effects.beyond_wings import WINGS
from onboard.core.vehicle.effects.drag import Drag
from onboard.core.vehicle.effects.effect import Effect
from onboard.core.vehicle.effects.gust_lift import GustLift
from onboard.core.vehicle.effects.lift import Lift
from onboard.core.vehicle.effects.own import own
from onboard.core.vehicle.effects.propeller_inflow import PropellerInflow
from onboard.core.vehicle.effects.propulsion import Propulsion
from onboard.core.vehicle.effects.sensor_offset import SensorOffset
from onboard.core.vehicle.effects.servo_lag import ServoLag
from onboard.core.vehicle.effects.side_force import SideForce
from onboard.core.vehicle.effects.slip_drag import SlipDrag
from onboard.core.vehicle.effects.wind import Wind
from onboard.core.vehicle.effects.wind_change import CHANGE, WindChange
from onboard.core.vehicle.effects.wind_height import HEIGHT, WindByHeight
from onboard.core.vehicle.effects.wind_profile import WindProfile
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.limits import STALL_SHARE
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.core.vehicle.several import wind_sigmas
from onboard.core.vehicle.signals import (
    ELEVATOR_FUNCTION,
    ELEVON_FUNCTIONS,
    FLAP_FUNCTIONS,
    RUDDER_FUNCTION,
    THROTTLE_FUNCTION,
    VTAIL_FUNCTIONS,
    Signals,
    Stream,
)

MIDDLE_US, HALF_US = 1500.0, 500.0
"""Pulse width of a surface at rest, and to its end."""
FULL_S = 0.9
"""Share of the readings that an airspeed sensor must have [cost]."""
LEAST_AIRSPEED_M_S = 5.0
"""Airspeed that planes fly at at least, m/s [physics]."""


def plane_commands(signals: Signals) -> Stream:
    """Throttle (0 to 1), rudder, elevator and flap (-1 to 1) as (j, 4); empty without a throttle.

    Surfaces that the vehicle has not got are zero.
    """
    raw = signals.outputs.x
    throttle = signals.channels_of(THROTTLE_FUNCTION)
    if not throttle or not len(signals.outputs):
        return Stream()
    k = throttle[0]
    get = signals.parameters.get
    low, high = get(f"SERVO{k + 1}_MIN", 1000.0), get(f"SERVO{k + 1}_MAX", 2000.0)
    if not low < high or float(np.std(raw[:, k])) <= 0.0:
        return Stream()
    share = np.clip((raw[:, k] - low) / (high - low), 0.0, 1.0)
    # In the order of the commands, after the throttle.
    surfaces = [
        _turned(signals, (RUDDER_FUNCTION,), (VTAIL_FUNCTIONS, -1.0)),
        _turned(signals, (ELEVATOR_FUNCTION,), (VTAIL_FUNCTIONS, 1.0), (ELEVON_FUNCTIONS, 1.0)),
        _turned(signals, FLAP_FUNCTIONS),
    ]
    return Stream(signals.outputs.t, np.stack([share, *surfaces], axis=1))


def _turned(
    signals: Signals, functions: tuple[int, ...], *mixed: tuple[tuple[int, int], float]
) -> Array:
    """(j,) -1 to 1 of a surface; zero where there is none.

    Args:
        signals: with outputs.
        functions: of those that are a surface of their own; the first that there is.
        mixed: functions of a left and a right one, else, and the sign with which the right one
            goes into half of their sum.
    """
    channels = signals.channels_of(*functions)
    if channels:
        return _deflected(signals, channels[0])
    for pair, sign in mixed:
        both = signals.channels_of(*pair)
        if len(both) == len(pair):
            # Of surfaces of their own the sign is the linkage's, of these it says what is added.
            left, right = (_deflected(signals, k) * _way(signals, k) for k in both)
            out: Array = 0.5 * (left + sign * right)
            return out
    return np.zeros(len(signals.outputs))


def _deflected(signals: Signals, channel: int) -> Array:
    """(j,) -1 to 1, by the pulse width."""
    us = signals.outputs.x[:, channel]
    out: Array = np.where(us > 0.0, us - MIDDLE_US, 0.0) / HALF_US
    return out


def _way(signals: Signals, channel: int) -> float:
    """Minus one where the servo is mounted the other way round."""
    return -1.0 if signals.parameters.get(f"SERVO{channel + 1}_REVERSED", 0.0) > 0.0 else 1.0


def has_airspeed(flight: Flight) -> bool:
    """Whether there is an airspeed sensor that read something."""
    known = np.isfinite(flight.airspeed)
    return bool(
        np.mean(known) > FULL_S and float(np.median(flight.airspeed[known])) > LEAST_AIRSPEED_M_S
    )


def unstalled(flight: Flight, frame: PlaneAirframe, winds: Array) -> Flight:
    """The flight without what is near or past the stall, or too slow to be flight.

    Args:
        flight: of one recording, or of several.
        frame: the airframe.
        winds: (parts, 2) of each beyond what was measured, towards north and east, m/s.
    """
    air = Air(flight)
    air.wind_n[:, :2] += winds[flight.part]
    u = air.u_b
    speed = np.linalg.norm(u, axis=1)
    alpha = np.arctan2(u[:, 2], u[:, 0])
    good = (np.abs(alpha) < STALL_SHARE * frame.alpha_stall) & (speed > LEAST_AIRSPEED_M_S)
    return flight if good.all() else flight.cut(good)


def plane_model(
    flight: Flight,
    frame: PlaneAirframe,
    force_sigma: Array,
    beyond: Sequence[str] = (),
    *,
    held: bool = False,
    wind_from: float | None = None,
) -> ForceModel:
    """Every effect of a plane that this recording can speak of.

    Args:
        flight: with throttle and surfaces, if the recording has outputs; of one, or of several.
        frame: to compare with.
        force_sigma: (3,) what the sensor level leaves unknown of the force, m/s^2; (parts, 3).
        beyond: keys of what repeats with the motion, or with time, and is no effect's.
        held: whether the side force is the file's.
        wind_from: when the wind of a single flight became another at once, s; None: never.
    """
    sensor = has_airspeed(flight)

    def start(of: Flight) -> Air:
        return Air(of, columns=COLUMN + 1)

    still = start(flight)
    everything: list[Effect] = [
        own([Wind(sigma) for sigma in wind_sigmas(flight)]),
        *([WindChange(flight, moment=wind_from)] if CHANGE in beyond else []),
        *([WindByHeight(flight)] if HEIGHT in beyond else []),
        own([WindProfile() for _ in range(flight.parts)]),
        *([AirDensity()] if float(np.ptp(flight.height)) > DENSITY_RANGE_M else []),
        own([AttitudeError(flight.attitude_sigma, s) for s in np.atleast_2d(force_sigma)]),
        ServoLag(),
        own([GustLift() for _ in range(flight.parts)]),
        Lift(frame),
        Drag(frame),
        SlipDrag(),
        SideForce(frame, steered=still.commands is not None, held=held),
        Propulsion(frame),
        PropellerInflow(frame),
        *(Beyond(key, WINGS[key]) for key in beyond if key in WINGS),
        *([AirspeedScale(flight.rho)] if sensor else []),
        *([own([AirspeedLag() for _ in range(flight.parts)])] if sensor else []),
        own([SensorOffset(sigma) for sigma in np.atleast_2d(force_sigma)]),
    ]
    effects = tuple(e for e in everything if not e.missing(still))
    if still.commands is None:
        # Without the throttle nothing can be said along x.
        axes: tuple[int, ...] = (1, 2)
    else:
        axes = (0, 1, 2)
    axes = (*axes, COLUMN) if sensor else axes
    return ForceModel(flight, effects, axes, start)


DENSITY_RANGE_M = 500.0
"""As of a copter: range of heights over which density acts on its own, m [physics]."""


def plane_missing(flight: Flight) -> dict[str, str]:
    """What this recording cannot speak of, and why, by effect."""
    absent: dict[str, str] = {}
    air = Air(flight)
    if why := WindProfile().missing(air):
        absent["wind_profile"] = why
    if air.commands is None:
        absent["thrust_scale"] = absent["drag"] = "no throttle output in the recording"
        absent["side_force"] = "no rudder output in the recording"
    if not has_airspeed(flight):
        absent["airspeed_scale"] = "no airspeed sensor in the recording"
    if float(np.ptp(flight.height)) <= DENSITY_RANGE_M:
        absent["air_density"] = "acts on lift and drag alike at one height"
    return absent
