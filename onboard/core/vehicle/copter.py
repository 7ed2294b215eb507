"""The model of a copter: which effects, in which order, and what its outputs command."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onboard.core.inputs.limits import STILL_M_S
from onboard.core.maths.arrays import Array, Mask
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.effects.air_density import AirDensity
from onboard.core.vehicle.effects.beyond import Beyond
from onboard.core.vehicle.effects.beyond_rotors import COPTERS
from onboard.core.vehicle.effects.body_drag import BodyDrag
from onboard.core.vehicle.effects.charge import Charge
from onboard.core.vehicle.effects.effect import Effect
from onboard.core.vehicle.effects.ground_effect import GroundEffect
from onboard.core.vehicle.effects.gust_drag import GustDrag
from onboard.core.vehicle.effects.inflow import Inflow
from onboard.core.vehicle.effects.mass_change import Change, MassChange, ThrustChange
from onboard.core.vehicle.effects.motor_lag import MotorLag
from onboard.core.vehicle.effects.own import own
from onboard.core.vehicle.effects.own_motion import OwnMotion
from onboard.core.vehicle.effects.rising_air import RISING, RisingAir
from onboard.core.vehicle.effects.rotor_drag import RotorDrag
from onboard.core.vehicle.effects.rotor_wind import RotorWind
from onboard.core.vehicle.effects.sensor_offset import SensorOffset
from onboard.core.vehicle.effects.thrust_curve import ThrustCurve
from onboard.core.vehicle.effects.thrust_scale import ThrustScale
from onboard.core.vehicle.effects.thrust_tilt import ThrustTilt
from onboard.core.vehicle.effects.vertical_drag import VerticalDrag
from onboard.core.vehicle.effects.voltage_sag import VoltageSag
from onboard.core.vehicle.effects.wind import Wind
from onboard.core.vehicle.effects.wind_change import CHANGE, WindChange
from onboard.core.vehicle.effects.wind_profile import TOP_M, WindProfile
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.several import wind_sigmas
from onboard.core.vehicle.signals import Signals, Stream

FULL_RANGE = (0.85, 1.05)
"""The highest voltage, at rest or flown, over the frame's full one, between which the battery is
the frame's; else it is another battery, and that voltage is taken for full [physics]."""


CARRIED = 0.7
"""Of the command in moving flight [physics]."""
FEWEST_MOVING = 10
"""Fixes, to take a median of [probability]."""

DENSITY_RANGE_M = 500.0
"""Range of heights, m, over which the standard atmosphere loses 5 %: below, a density that is off
looks like another thrust and another drag [physics]."""


@dataclass(frozen=True, slots=True)
class Variant:
    """Which of the forms of a model that no number tells apart.

    Attributes:
        profile_top: height from which the wind is constant, m.
        by_components: whether rotors that lean drag as the simulator's do.
        gusts: RMS of those that are seen in turbulent air, where they act on the mean force and
            commands answer them, m/s; zero in calm air.
        change: when the mass or the thrust became another; None: never.
        moving: by how much several flights differ in the force that goes with their own motion,
            1/s; zero: not at all.
        through: by how much in the wind that their thrust shows, beside the drag's, m/s; likewise.
        among: whether there are other flights of the vehicle, though one alone is looked at.
        beyond: what repeats with the motion, or with time, and is no effect's
            (:mod:`onboard.core.vehicle.structure`).
        wind_from: when the wind of a single flight became another at once, s; None: never.
    """

    profile_top: float = TOP_M
    by_components: bool = False
    gusts: float = 0.0
    change: Change | None = None
    moving: float = 0.0
    through: float = 0.0
    among: bool = False
    beyond: tuple[str, ...] = ()
    wind_from: float | None = None


@dataclass(frozen=True, slots=True)
class Outputs:
    """How pulse widths become commands: motors' channels and the range between idle and full."""

    motors: tuple[int, ...]
    low: float
    high: float

    @classmethod
    def of(cls, signals: Signals, frame: CopterAirframe) -> Outputs:
        """By the vehicle's own MOT_ parameters, else by the frame's."""
        get = signals.parameters.get
        pwm = get("MOT_PWM_MIN", 0.0), get("MOT_PWM_MAX", 0.0)
        low, high = pwm if 0.0 < pwm[0] < pwm[1] else (frame.pwmMin, frame.pwmMax)
        least = get("MOT_SPIN_MIN", frame.spin_min)
        most = get("MOT_SPIN_MAX", frame.spin_max)
        if "PWM_MIN" in signals.parameters:  # PX4's: idle is within the curve
            low, high = get("PWM_MIN", frame.pwmMin), get("PWM_MAX", frame.pwmMax)
            least, most = 0.0, 1.0
        if signals.normalised or not least < most:
            low, high, least, most = 0.0, 1.0, 0.0, 1.0
        return cls(signals.motors, low + least * (high - low), low + most * (high - low))

    def commands(self, signals: Signals, expo: float) -> Stream:
        """Mean, mean square and evenness of the commands (j, 3); empty where nothing moved.

        Of the samples as they were logged: a mean of commands that were smoothed first would lose
        their scatter, and with it some of the square.

        Args:
            signals: of the vehicle.
            expo: of the thrust curve by which evenness is reckoned.
        """
        raw = signals.outputs.x
        if not self.motors or not len(signals.outputs) or raw.shape[1] <= max(self.motors):
            return Stream()
        raw = raw[:, list(self.motors)]
        known = np.isfinite(raw).all(axis=1)
        if np.count_nonzero(known) < 2 or float(np.max(np.std(raw[known], axis=0))) <= 0.0:
            return Stream()
        c = np.clip((raw[known] - self.low) / (self.high - self.low), 0.0, 1.0)
        power = (1.0 - expo) * c + expo * c * c
        mean = np.maximum(np.mean(power, axis=1), 1e-6)
        even = np.mean(np.sqrt(np.maximum(power, 0.0)), axis=1) / np.sqrt(mean)
        columns = np.mean(c, axis=1), np.mean(c * c, axis=1), np.maximum(even, 0.1)
        return Stream(signals.outputs.t[known], np.stack(columns, axis=1))


def carried_by_rotors(signals: Signals, t: Array, v_n: Array) -> Mask | None:
    """(n,) where the motors are commanded as in flight; None where nobody knows.

    Thrust goes with the command, or with its square: at :data:`CARRIED` of what moving flight takes
    the rotors hold no more than half, or seven tenths of the weight, and the vehicle would fall.

    Args:
        signals: of the vehicle.
        t: (n,) s.
        v_n: (n, 3) velocity, m/s; NaN where it is not measured.
    """
    frame = CopterAirframe.of({})
    if signals.kind != "copter":
        return None
    commands = Outputs.of(signals, frame).commands(signals, frame.propExpo)
    moving = np.linalg.norm(np.nan_to_num(v_n), axis=1) > STILL_M_S
    if not commands.covers(t) or np.count_nonzero(moving) < FEWEST_MOVING:
        return None
    given = commands.at(t)[:, 0]
    out: Mask = given > CARRIED * float(np.median(given[moving]))
    return out


def voltage_of(flight: Flight) -> Array | None:
    """(n,) V; None where the battery is not measured."""
    if flight.battery.shape[1] == 0:
        return None
    volts = flight.battery[:, 0]
    return volts if float(np.median(volts)) > 1.0 and np.isfinite(volts).all() else None


def full_voltage(flight: Flight, frame: CopterAirframe) -> float:
    """Voltage at which the frame's thrust is meant, V."""
    volts = voltage_of(flight)
    if volts is None:
        return frame.maxVoltage
    most = float(np.fmax(np.percentile(volts, 99), flight.rest_volts))
    ours = FULL_RANGE[0] < most / frame.maxVoltage < FULL_RANGE[1]
    return frame.maxVoltage if ours else most


def flown_high(flight: Flight) -> bool:
    """Whether heights differ by so much that density acts on its own."""
    return float(np.ptp(flight.height)) > DENSITY_RANGE_M


def copter_model(
    flight: Flight,
    frame: CopterAirframe,
    force_sigma: Array,
    variant: Variant = Variant(),
) -> ForceModel:
    """Every effect of a copter that this recording can speak of.

    Args:
        flight: of one recording, or of several.
        frame: to compare with.
        force_sigma: (3,) what the sensor level leaves unknown of the force, m/s^2; (parts, 3).
        variant: which of the forms.
    """
    parts, change = range(flight.parts), variant.change

    def start(of: Flight) -> Air:
        return Air(of, voltage_of(of))

    still = start(flight)
    everything: list[Effect] = [
        own([Wind(sigma) for sigma in wind_sigmas(flight)]),
        *([WindChange(flight, moment=variant.wind_from)] if CHANGE in variant.beyond else []),
        own([WindProfile(variant.profile_top) for _ in parts]),
        *([own([RisingAir() for _ in parts])] if RISING in variant.beyond else []),
        *([own([GustDrag(variant.gusts) for _ in parts])] if variant.gusts else []),
        *([AirDensity()] if flown_high(flight) else []),
        *([MassChange(change, flight)] if change else []),
        *([own([RotorWind(variant.through) for _ in parts])] if variant.through else []),
        VerticalDrag(frame),
        ThrustTilt(),
        RotorDrag(frame, by_components=variant.by_components),
        BodyDrag(frame),
        *([own([OwnMotion(variant.moving) for _ in parts])] if variant.moving else []),
        MotorLag(),
        ThrustCurve(frame),
        VoltageSag(full_voltage(flight, frame)),
        ThrustScale(frame),
        own([Charge(alone=flight.parts == 1 and not variant.among) for _ in parts]),
        *([ThrustChange(change, flight)] if change else []),
        GroundEffect(frame),
        Inflow(frame),
        *(Beyond(key, COPTERS[key]) for key in variant.beyond if key in COPTERS),
        own([SensorOffset(sigma) for sigma in np.atleast_2d(force_sigma)]),
    ]
    effects = tuple(e for e in everything if not e.missing(still))
    axes = (0, 1, 2) if still.commands is not None else (0, 1)
    return ForceModel(flight, effects, axes, start, instrumented=axes if variant.gusts else ())


def copter_missing(flight: Flight, frame: CopterAirframe) -> dict[str, str]:
    """What this recording cannot speak of, and why, by effect."""
    air = Air(flight, voltage_of(flight))
    asked: list[Effect] = [
        WindProfile(),
        MotorLag(),
        ThrustCurve(frame),
        VoltageSag(full_voltage(flight, frame)),
        ThrustScale(frame),
        GroundEffect(frame),
        *(kind(Change(0.0, 0.0), flight) for kind in (MassChange, ThrustChange)),
    ]
    absent = {e.name: why for e in asked if (why := e.missing(air))}
    if not flown_high(flight):
        absent["air_density"] = "acts on thrust and drag alike at one height"
    return absent
