"""Parameters with which ArduPilot's simulator flies and senses like a recording."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from onboard.answers.flown import FlownRecording
from onboard.answers.sensor_level import DRIVER_LAG_S, calibration_settings
from onboard.core.vehicle.effects.rising_air import RISING
from onboard.core.vehicle.effects.wind import FLOOR_M_S
from onboard.core.vehicle.effects.wind_profile import TOP_M
from onboard.core.vehicle.limits import APART
from onboard.core.vehicle.records import Difference, VehicleMatch
from onboard.core.vehicle.signals import airspeed_ratio

ANYWHERE_DEG: Final = 360.0 / math.sqrt(12.0)
"""Sigma of a direction of which nothing is known: a calm has none [probability]."""


@dataclass(frozen=True, slots=True)
class Setting:
    """A parameter for the simulator (or for EKF3), its sigma, and what it is for."""

    name: str
    value: float
    sigma: float
    reason: str


def settings_of(
    vehicle: VehicleMatch,
    sensors: tuple[Difference, ...],
    effects: tuple[Difference, ...],
    recording: FlownRecording,
) -> tuple[Setting, ...]:
    """Parameters with which the simulator flies and senses like the recording; only the proven."""
    named = {d.name: d for d in (*sensors, *effects)}
    out: list[Setting] = []
    wind = vehicle.wind
    # No constant wind flies like one that becomes another.
    if "wind" in named and wind is not None and wind.change < FLOOR_M_S:
        out += _wind_settings(vehicle)
    if "turbulence" in named and "rms_with_faster" in named["turbulence"].values:
        # The simulator's gusts change with each of its steps, and point anywhere: the setting is
        # their length, not a component, and slow gusts alone do not tell it.
        value = named["turbulence"].values["rms_with_faster"]
        gain = math.sqrt(2.0)
        if value.sigma < 0.5 * value.real:
            length, its = gain * value.real, gain * value.sigma
            out.append(Setting("SIM_WIND_TURB", length, its, "turbulence"))
    if {"rotor_drag", "body_drag"} & set(named):
        out += _drag_settings(vehicle)
    if "gps_latency" in named:
        value = named["gps_latency"].values["delay"]
        lag, its = max(1e3 * value.real, 0.0), 1e3 * math.hypot(value.sigma, DRIVER_LAG_S)
        out.append(Setting("SIM_GPS1_LAG_MS", float(round(lag)), its, "gps_latency"))
    if "airspeed_scale" in named:
        value = named["airspeed_scale"].values["over_equivalent"]
        values = recording.signals.parameters
        own = airspeed_ratio(values)
        told = values.get(own, 2.0)
        ratio = told * (value.simulation / value.real) ** 2
        sigma = 2.0 * ratio * value.sigma / value.real
        out.append(Setting(f"SIM_{own}", ratio, sigma, "airspeed_scale"))
    if "gps_lever_arm" in named:
        for axis in "xyz":
            value = named["gps_lever_arm"].values[axis]
            name = f"SIM_GPS1_POS_{axis.upper()}"
            out.append(Setting(name, value.real, value.sigma, "gps_lever_arm"))
    if not recording.derived:
        values = recording.signals.parameters
        for name, (number, sigma) in calibration_settings(recording.diagnosis, values).items():
            sensor = "accelerometer" if name.startswith("SIM_ACC") else "gyroscope"
            out.append(Setting(name, number, sigma, sensor))
    return tuple(out)


def _wind_settings(vehicle: VehicleMatch) -> list[Setting]:
    """SIM_WIND_*: where it comes from, and its speed from 60 m on."""
    wind = vehicle.wind
    if wind is None:
        return []
    speed, sigma = wind.speed, wind.sigma_along
    direction = math.degrees(math.atan2(-wind.east, -wind.north)) % 360.0
    turn = math.degrees(wind.sigma_across / max(speed, 1e-9))
    kind = 1.0
    if wind.profile_exponent is not None:
        # The simulator has a square root and a straight line up to 60 m.
        kind = 0.0 if abs(wind.profile_exponent - 0.5) < abs(wind.profile_exponent - 1.0) else 2.0
        power = 0.5 if kind == 0.0 else 1.0
        gain = (TOP_M / min(max(wind.height, 0.5), TOP_M)) ** power
        speed, sigma = speed * gain, sigma * gain
    out = [Setting("SIM_WIND_T", kind, 0.0, "wind_profile" if kind != 1.0 else "wind, uniform")]
    if turn < ANYWHERE_DEG:
        out.insert(0, Setting("SIM_WIND_DIR", direction, turn, "wind, where it comes from"))
    rising = vehicle.numbers.get(RISING)
    if rising is not None and abs(rising.real) > rising.floor + APART * rising.sigma:
        # The simulator turns the wind upwards: its speed is that along the slope.
        slope = math.atan2(rising.real, speed)
        across = math.hypot(rising.sigma * math.cos(slope), sigma * math.sin(slope))
        sigma = math.hypot(sigma * math.cos(slope), rising.sigma * math.sin(slope))
        speed = math.hypot(speed, rising.real)
        turned = math.degrees(across / speed)
        out.append(Setting("SIM_WIND_DIR_Z", math.degrees(slope), turned, "air that rises"))
    return [Setting("SIM_WIND_SPD", speed, sigma, "wind"), *out]


def _drag_settings(vehicle: VehicleMatch) -> list[Setting]:
    """EK3_DRAG_*: what EKF3 needs to find the wind of this vehicle."""
    out = []
    c = vehicle.numbers.get("rotor_drag.mcoef")
    if c is not None and c.real > APART * c.sigma:
        out.append(Setting("EK3_DRAG_MCOEF", c.real, c.sigma, "rotor_drag"))
    for axis in "xy":
        k = vehicle.numbers.get(f"body_drag.{axis}")
        if k is not None and k.real > APART * k.sigma:
            name = f"EK3_DRAG_BCOEF_{axis.upper()}"
            out.append(Setting(name, 1.0 / k.real, k.sigma / k.real**2, "body_drag"))
    return out
