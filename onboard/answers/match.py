"""What a real flight has that a simulation lacks: sensors and vehicle in one answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np

from onboard.answers.flown import FlownRecording, flown
from onboard.answers.sensor_level import (
    TIMING_NAMES,
    calibration_settings,
    sensor_differences,
)
from onboard.core.diagnosis.records import NotTestable, Verdict
from onboard.core.inputs.segments import Batch
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.contradiction import Contradiction, contradiction
from onboard.core.vehicle.copter import Outputs
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.effects.wind_profile import TOP_M
from onboard.core.vehicle.flight import Flight, flight_of
from onboard.core.vehicle.limits import APART, FEWEST_STEPS
from onboard.core.vehicle.plane import plane_commands
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.core.vehicle.plane_match import match_plane
from onboard.core.vehicle.records import Compared, Difference, VehicleMatch
from onboard.core.vehicle.several import joined
from onboard.core.vehicle.signals import Stream
from onboard.core.vehicle.trajectory import Motion, motions
from onboard.errors import RecordingError
from onboard.recordings.recording import Recording

PLANES = ("plane",)
COPTERS = ("copter",)
NAMES = {
    "copter": (
        *("wind", "wind_profile", "turbulence", "rotor_drag", "body_drag", "thrust_scale"),
        *("thrust_curve", "voltage_sag", "motor_lag", "thrust_tilt", "ground_effect"),
        *("air_density", "mass_change", "thrust_change"),
    ),
    "plane": (
        *("wind", "wind_profile", "turbulence", "lift", "drag", "side_force", "thrust_scale"),
        *("airspeed_scale", "air_density"),
    ),
}
"""Catalogue by vehicle."""
SAME: Final = 0.05
"""Share of a number within which two vehicles are the same [use]."""
DESCRIBING = ("lowest", "capacity", "rms_with_faster")
"""Numbers that tell of the flight, not of the vehicle."""
SLOW_M_S: Final = 3.0
FAST_M_S: Final = 7.0
"""Speed over ground that a tenth of the flight is slower than, m/s, of a copter and of a plane: the
one stops now and then, the other cannot [physics]."""
NOTHING = "no stretch of flight with trusted GPS, attitude and inertial data"


@dataclass(frozen=True, slots=True)
class Setting:
    """A parameter for the simulator (or for EKF3), its sigma, and what it is for."""

    name: str
    value: float
    sigma: float
    reason: str


@dataclass(frozen=True, slots=True)
class Match:
    """The answer of ``onboard match``, with everything that a report draws.

    ``vehicle`` is the real flight's vehicle level (its effects are those of the real recording
    against the airframe, or against the simulation's recording where there is one).  ``others`` are
    further flights of the vehicle, from which its airframe was found as well.
    """

    real: FlownRecording
    simulation: FlownRecording | None
    verdict: Verdict
    effects: tuple[Difference, ...]
    vehicle: VehicleMatch
    simulated: VehicleMatch | None
    settings: tuple[Setting, ...]
    not_testable: tuple[NotTestable, ...]
    frame: Mapping[str, float | list[float]] = field(default_factory=dict)
    others: tuple[FlownRecording, ...] = ()

    @property
    def damage(self) -> list[str]:
        """What was skipped of damaged files, in sentences."""
        every = (self.simulation, self.real, *self.others)
        return [note for flown in every if flown is not None for note in flown.source.damage]

    @property
    def silent(self) -> bool:
        """Whether the recording says nothing; the vehicle's note says why."""
        return self.vehicle.series is None and self.verdict is Verdict.INSUFFICIENT


def match(
    real: str | Path | Recording,
    simulation: str | Path | Recording | None = None,
    *,
    others: Sequence[str | Path | Recording] = (),
    frame: Mapping[str, object] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Match:
    """Compare a real recording with a simulation's, or with an airframe.

    Args:
        real: the recording of the real flight, a file or opened already.
        simulation: a recording of the simulation's like flight; None: the nominal airframe.
        others: recordings of further flights of the real vehicle: its airframe is found from all,
            wind and sensors of each are its own.
        frame: keys of a frame or coefficient file to compare with; ArduPilot's default without.
        progress: told the share of the reading that is done.

    Raises:
        RecordingError: a file that cannot be used.
        ValueError: a frame that makes no sense.
    """
    recording = flown(real, progress=progress)
    further = tuple(flown(path, progress=progress) for path in others)
    vehicle = vehicle_level(recording, frame or {}, further)
    other, simulated = None, None
    if simulation is not None:
        other = flown(simulation, progress=progress)
        simulated = vehicle_level(other, frame or {})
    sensors = sensor_differences(recording.diagnosis, other.diagnosis if other else None)
    if recording.derived:
        sensors = ()
    elif any(r.kind == "table" for r in recording.source.recordings):
        # Its velocity is not a receiver's: it has no latency to compare with the simulator's.
        sensors = tuple(d for d in sensors if d.name not in TIMING_NAMES)
    effects = vehicle.effects
    if simulated is not None:
        effects = _apart(vehicle, simulated)
    every = (*sensors, *effects)
    return Match(
        recording,
        other,
        _verdict(vehicle, simulated, every),
        every,
        vehicle,
        simulated,
        settings_of(vehicle, sensors, effects, recording),
        vehicle.not_testable,
        vehicle.frame,
        further,
    )


def vehicle_level(
    recording: FlownRecording,
    frame: Mapping[str, object],
    others: Sequence[FlownRecording] = (),
) -> VehicleMatch:
    """The vehicle level of one recording, or of several of one vehicle, against an airframe.

    Raises:
        RecordingError: another flight that is of another kind of vehicle, or none.
        ValueError: a frame that makes no sense.
    """
    kind = recording.signals.kind or guessed_kind(recording.batches)
    airframe, plane = CopterAirframe.of(frame), PlaneAirframe.of(frame)
    pieces = motions(recording.batches, recording.sensors)
    flight = _flight(recording, kind, airframe, pieces)
    doubt = _doubt(recording, pieces)
    names = NAMES.get(kind, NAMES["copter"])
    why = ""
    if kind and kind not in (*COPTERS, *PLANES):
        why = f"there is no model of the airframe of a {kind}"
    elif doubt.hopeless:
        why = str(doubt)
    elif flight is None or len(flight) < FEWEST_STEPS:
        why = NOTHING
    elif not kind:
        why = "the recording does not say what kind of vehicle it is"
    if why or flight is None:
        absent = tuple(NotTestable(n, why) for n in names)
        return VehicleMatch(kind or "unknown", not_testable=absent, note=why)
    sigma = np.stack([r.sensors.force_sigma for r in (recording, *others)])
    flight = joined([flight, *(_further(other, kind, airframe) for other in others)])
    try:
        if kind in COPTERS:
            return _doubted(match_copter(flight, recording.signals, airframe, sigma), doubt)
        found = match_plane(flight, plane, sigma)
        if found is not None:
            return _doubted(found, doubt)
        why = "it never flew faster than a plane stalls"
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        why = f"its numbers fit no model ({error})"
    return VehicleMatch(kind, not_testable=tuple(NotTestable(n, why) for n in names), note=why)


def guessed_kind(batches: Sequence[Batch]) -> str:
    """A copter stops in the air, a plane does not; empty where neither is clear."""
    v_n = [b.fixes.v_n for b in batches]
    if not v_n:
        return ""
    speed = np.linalg.norm(np.nan_to_num(np.concatenate(v_n))[:, :2], axis=1)
    slow = float(np.percentile(speed, 10))
    if slow < SLOW_M_S:
        return "copter"
    return "plane" if slow > FAST_M_S else ""


def _further(recording: FlownRecording, kind: str, airframe: CopterAirframe) -> Flight:
    """Another flight of the vehicle.

    Raises:
        RecordingError: it is of another kind of vehicle, or none.
    """
    its = recording.signals.kind or kind
    pieces = motions(recording.batches, recording.sensors)
    flight = None if its != kind else _flight(recording, kind, airframe, pieces)
    if flight is None or len(flight) < FEWEST_STEPS:
        why = NOTHING if its == kind else f"is of a {its}, not of a {kind}"
        raise RecordingError(f"{recording.name}: {why}")
    doubt = _doubt(recording, pieces)
    if doubt.hopeless:
        raise RecordingError(f"{recording.name}: {doubt}")
    return flight


def _doubt(recording: FlownRecording, pieces: Sequence[Motion]) -> Contradiction:
    """A force that is the slope of the velocity contradicts nothing."""
    return Contradiction() if recording.derived else contradiction([m.fixed for m in pieces])


def _doubted(found: VehicleMatch, doubt: Contradiction) -> VehicleMatch:
    """With what it says of itself in the note."""
    note = "; ".join(s for s in (found.note, str(doubt)) if s)
    return replace(found, note=note)


def _flight(
    recording: FlownRecording, kind: str, airframe: CopterAirframe, pieces: Sequence[Motion]
) -> Flight | None:
    commands = Stream()
    if kind in COPTERS:
        outputs = Outputs.of(recording.signals, airframe)
        commands = outputs.commands(recording.signals, airframe.propExpo)
    elif kind in PLANES:
        commands = plane_commands(recording.signals)
    if not pieces:
        return None
    grounded = list(recording.grounded)
    return flight_of(pieces, recording.signals, commands, grounded, recording.ground)


def _apart(real: VehicleMatch, simulated: VehicleMatch) -> tuple[Difference, ...]:
    """Effects of either that differ between the two by more than both uncertainties."""
    out = []
    for name in dict.fromkeys(d.name for d in (*real.effects, *simulated.effects)):
        ours = next((d for d in real.effects if d.name == name), None)
        theirs = next((d for d in simulated.effects if d.name == name), None)
        shown = ours or theirs
        if shown is None:
            continue
        values: dict[str, Compared] = {}
        differs = False
        for key, value in shown.values.items():
            a = _value(real, ours, name, key, value)
            b = _value(simulated, theirs, name, key, value)
            sigma = math.hypot(
                a.sigma if math.isfinite(a.sigma) else 0.0,
                b.sigma if math.isfinite(b.sigma) else 0.0,
            )
            values[key] = Compared(b.real, a.real, sigma, value.unit)
            if key in DESCRIBING or not math.isfinite(a.real + b.real):
                continue
            floor = max(a.floor, b.floor, SAME * abs(b.real))
            differs = differs or abs(a.real - b.real) > floor + APART * sigma
        if differs:
            base = ours or Difference(name, "vehicle", {})
            out.append(
                Difference(
                    name,
                    "vehicle",
                    values,
                    base.share,
                    base.where,
                    base.rivals,
                    base.held_out_before,
                    base.held_out_after,
                )
            )
    return tuple(out)


def _value(
    match_: VehicleMatch, found: Difference | None, name: str, key: str, shown: Compared
) -> Compared:
    """A number as this recording has it: found, or the model's own estimate, or nominal."""
    known = match_.numbers.get(f"{name}.{key}")
    if known is not None:
        return known
    if found is not None and key in found.values:
        return found.values[key]
    return Compared(shown.simulation, shown.simulation, 0.0, shown.unit)


def _verdict(
    vehicle: VehicleMatch, simulated: VehicleMatch | None, effects: tuple[Difference, ...]
) -> Verdict:
    if vehicle.series is None:
        return Verdict.INSUFFICIENT if not effects else Verdict.PARTLY_EXPLAINED
    explained = vehicle.explained and (simulated is None or simulated.explained)
    if not effects:
        return Verdict.CLEAN if explained else Verdict.UNEXPLAINED
    return Verdict.EXPLAINED if explained else Verdict.PARTLY_EXPLAINED


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
    if "wind" in named and wind is not None:
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
        lag = max(1e3 * value.real, 0.0)
        out.append(Setting("SIM_GPS1_LAG_MS", float(round(lag)), 1e3 * value.sigma, "gps_latency"))
    if "airspeed_scale" in named:
        value = named["airspeed_scale"].values["over_equivalent"]
        told = recording.signals.parameters.get("ARSPD_RATIO", 2.0)
        ratio = told * (value.simulation / value.real) ** 2
        sigma = 2.0 * ratio * value.sigma / value.real
        out.append(Setting("SIM_ARSPD_RATIO", ratio, sigma, "airspeed_scale"))
    if "gps_lever_arm" in named:
        for axis in "xyz":
            value = named["gps_lever_arm"].values[axis]
            name = f"SIM_GPS1_POS_{axis.upper()}"
            out.append(Setting(name, value.real, value.sigma, "gps_lever_arm"))
    if not recording.derived:
        for name, (number, sigma) in calibration_settings(recording.diagnosis).items():
            out.append(Setting(name, number, sigma, "accelerometer"))
    return tuple(out)


def _wind_settings(vehicle: VehicleMatch) -> list[Setting]:
    """SIM_WIND_*: where it comes from, and its speed from 60 m on."""
    wind = vehicle.wind
    if wind is None:
        return []
    speed = math.hypot(wind.north, wind.east)
    direction = math.degrees(math.atan2(-wind.east, -wind.north)) % 360.0
    unit = np.array([wind.north, wind.east]) / max(speed, 1e-9)
    sigma = float(np.hypot(unit[0] * wind.sigma_north, unit[1] * wind.sigma_east))
    across = float(np.hypot(unit[1] * wind.sigma_north, unit[0] * wind.sigma_east))
    kind = 1.0
    if wind.profile_exponent is not None:
        # The simulator has a square root and a straight line up to 60 m.
        kind = 0.0 if abs(wind.profile_exponent - 0.5) < abs(wind.profile_exponent - 1.0) else 2.0
        power = 0.5 if kind == 0.0 else 1.0
        gain = (TOP_M / min(max(wind.height, 0.5), TOP_M)) ** power
        speed, sigma = speed * gain, sigma * gain
    turn = math.degrees(across / max(speed, 1e-9))
    return [
        Setting("SIM_WIND_SPD", speed, sigma, "wind"),
        Setting("SIM_WIND_DIR", direction, turn, "wind, where it comes from"),
        Setting("SIM_WIND_T", kind, 0.0, "wind_profile" if kind != 1.0 else "wind, uniform"),
    ]


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
