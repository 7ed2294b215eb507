"""What a real flight has that a simulation lacks: sensors and vehicle in one answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np

from onboard.answers.flown import FlownRecording, flown
from onboard.answers.match_left_out import of_a_sensor, of_outages, of_rotors, of_velocity
from onboard.answers.match_settings import Setting, settings_of
from onboard.answers.same_flight import refuse_copies, refuse_one_flight_twice, refuse_other_boards
from onboard.answers.sensor_level import TIMING_NAMES, sensor_differences
from onboard.core.diagnosis.records import NotTestable, Verdict
from onboard.core.inputs.segments import Batch
from onboard.core.physics.effects.gps_fault import GpsFault
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.contradiction import Contradiction, contradiction
from onboard.core.vehicle.copter import Outputs
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.effects.voltage_sag import HELD
from onboard.core.vehicle.flight import Flight, flight_of
from onboard.core.vehicle.kind import kind_by_motion
from onboard.core.vehicle.lift_rotors import on_wings, unseen
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
CARRIED = (
    "upright rotors turn nearly all the time, and of a plane that they carry there is no model"
)
UNSEEN = "the outputs of its upright rotors are not recorded: nobody knows when wings carry it"


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
        RecordingError: a file that cannot be used, or another flight that is of another vehicle.
        UsageError: another flight that is the same flight.
        ValueError: a frame that makes no sense.
    """
    recording = flown(real, progress=progress)
    further = tuple(flown(path, progress=progress) for path in others)
    _refuse_strangers(recording, further)
    vehicle = vehicle_level(recording, frame or {}, further)
    other, simulated = None, None
    if simulation is not None:
        other = flown(simulation, progress=progress)
        simulated = vehicle_level(other, frame or {})
        _refuse_incomparable(other, simulated, vehicle)
    sensors = sensor_differences(recording.diagnosis, other.diagnosis if other else None)
    if recording.derived:
        sensors = ()
    elif recording.disagreement is not None:
        # A receiver's faults are seen by itself; all else is told from what contradicts itself.
        sensors = tuple(d for d in sensors if d.name == GpsFault.effect)
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
        _not_testable(vehicle, simulated),
        vehicle.frame,
        further,
    )


def _refuse_strangers(first: FlownRecording, others: Sequence[FlownRecording]) -> None:
    """See that further flights are flights of their own, of the same vehicle."""
    for other in others:
        first.source.vehicle.refuse(other.source.vehicle)
    every = (first, *others)
    recordings = [r for flown_ in every for r in flown_.source.recordings]
    refuse_copies(recordings)
    refuse_other_boards(recordings)
    refuse_one_flight_twice([track for flown_ in every for track in flown_.source.vehicle.tracks])


def _refuse_incomparable(
    other: FlownRecording, simulated: VehicleMatch, real: VehicleMatch
) -> None:
    """See that the simulation's recording is of such a vehicle, and says something of it.

    Raises:
        RecordingError: it does not; what nobody knows of it would pass for nominal.
    """
    kinds = {simulated.vehicle, real.vehicle}
    if len(kinds) > 1 and kinds <= {*COPTERS, *PLANES}:
        raise RecordingError(
            f"{other.name}: is of a {simulated.vehicle}, not of a {real.vehicle}: there is nothing "
            "to compare"
        )
    if real.series is not None and simulated.series is None:
        raise RecordingError(f"{other.name}: {simulated.note}")


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
    flight, carried_s = _flight(recording, kind, airframe, pieces)
    doubt = _doubt(recording, pieces)
    names = NAMES.get(kind, NAMES["copter"])
    why = ""
    if kind and kind not in (*COPTERS, *PLANES):
        why = f"there is no model of the airframe of a {kind}"
    elif recording.disagreement is not None:
        why = str(recording.disagreement)
    elif doubt.hopeless:
        why = str(doubt)
    elif kind in PLANES and unseen(recording.signals):
        why = UNSEEN
    elif flight is None or len(flight) < FEWEST_STEPS:
        why = CARRIED if carried_s > 0.0 else recording.without_flight
    elif not kind:
        why = "the recording does not say what kind of vehicle it is"
    if why or flight is None:
        absent = tuple(NotTestable(n, why) for n in names)
        return VehicleMatch(kind or "unknown", not_testable=absent, note=why)
    sigma = np.stack([r.sensors.force_sigma for r in (recording, *others)])
    said = (
        of_rotors(carried_s),
        of_outages(flight, plane=kind in PLANES),
        of_velocity(flight),
        of_a_sensor(flight, plane=kind in PLANES),
        str(doubt),
    )
    flight = joined([flight, *(_further(other, kind, airframe) for other in others)])
    try:
        if kind in COPTERS:
            return _noted(match_copter(flight, recording.signals, airframe, sigma), *said)
        found = match_plane(flight, plane, sigma)
        if found is not None:
            return _noted(found, *said)
        why = "it never flew faster than a plane stalls"
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        why = f"its numbers fit no model ({error})"
    return VehicleMatch(kind, not_testable=tuple(NotTestable(n, why) for n in names), note=why)


def guessed_kind(batches: Sequence[Batch]) -> str:
    """Which kind of vehicle flies like this; empty where that is not clear."""
    if not batches:
        return ""
    t = np.concatenate([b.fixes.t for b in batches])
    v_n = np.concatenate([b.fixes.v_n for b in batches])
    return kind_by_motion(t, v_n, np.concatenate([b.fixes.height for b in batches]))


def _further(recording: FlownRecording, kind: str, airframe: CopterAirframe) -> Flight:
    """Another flight of the vehicle.

    Raises:
        RecordingError: it is of another kind of vehicle, or none.
    """
    if recording.disagreement is not None:
        raise RecordingError(f"{recording.name}: {recording.disagreement}")
    its = recording.signals.kind or kind
    pieces = motions(recording.batches, recording.sensors)
    if its != kind:
        raise RecordingError(f"{recording.name}: is of a {its}, not of a {kind}")
    if kind in PLANES and unseen(recording.signals):
        raise RecordingError(f"{recording.name}: {UNSEEN}")
    flight, carried_s = _flight(recording, kind, airframe, pieces)
    if flight is None or len(flight) < FEWEST_STEPS:
        raise RecordingError(
            f"{recording.name}: {CARRIED if carried_s > 0.0 else recording.without_flight}"
        )
    doubt = _doubt(recording, pieces)
    if doubt.hopeless:
        raise RecordingError(f"{recording.name}: {doubt}")
    return flight


def _doubt(recording: FlownRecording, pieces: Sequence[Motion]) -> Contradiction:
    """A force that is the slope of the velocity contradicts nothing."""
    return Contradiction() if recording.derived else contradiction([m.fixed for m in pieces])


def _noted(found: VehicleMatch, *said: str) -> VehicleMatch:
    """With what else there is to say of the recording in the note."""
    return replace(found, note="; ".join(filter(None, (found.note, *said))))


def _flight(
    recording: FlownRecording, kind: str, airframe: CopterAirframe, pieces: Sequence[Motion]
) -> tuple[Flight | None, float]:
    """What of it the models can speak of; how long rotors carried a plane beside that, s."""
    commands = Stream()
    if kind in COPTERS:
        outputs = Outputs.of(recording.signals, airframe)
        commands = outputs.commands(recording.signals, airframe.propExpo)
    elif kind in PLANES:
        commands = plane_commands(recording.signals)
    if not pieces:
        return None, 0.0
    grounded = list(recording.grounded)
    flight = flight_of(pieces, recording.signals, commands, grounded, recording.ground)
    if flight is None or kind not in PLANES:
        return flight, 0.0
    return on_wings(flight, recording.signals)


def _apart(real: VehicleMatch, simulated: VehicleMatch) -> tuple[Difference, ...]:
    """Effects of either that differ between the two by more than both uncertainties.

    What one of the two cannot speak of is no difference.
    """
    out = []
    for name in dict.fromkeys(d.name for d in (*real.effects, *simulated.effects)):
        ours = next((d for d in real.effects if d.name == name), None)
        theirs = next((d for d in simulated.effects if d.name == name), None)
        shown = ours or theirs
        if shown is None or _unknown(real, name) or _unknown(simulated, name):
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


def _not_testable(real: VehicleMatch, simulated: VehicleMatch | None) -> tuple[NotTestable, ...]:
    """What the recording could not have told, and what the simulation's could not."""
    ours = {n.name for n in real.not_testable}
    if simulated is None:
        return real.not_testable
    more = (n for n in simulated.not_testable if n.name not in ours and _unknown(simulated, n.name))
    return (*real.not_testable, *(replace(n, why=f"in the simulation's: {n.why}") for n in more))


def _unknown(match_: VehicleMatch, name: str) -> bool:
    """Whether a recording could not have told this effect; a battery that holds is nominal."""
    why = next((n.why for n in match_.not_testable if n.name == name), "")
    told = any(key.startswith(f"{name}.") for key in match_.numbers)
    return bool(why) and not told and not why.startswith(HELD)


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
    if vehicle.series is None or not vehicle.shown:
        return Verdict.INSUFFICIENT if not effects else Verdict.PARTLY_EXPLAINED
    explained = vehicle.explained and (simulated is None or simulated.explained)
    if not effects:
        return Verdict.CLEAN if explained else Verdict.UNEXPLAINED
    return Verdict.EXPLAINED if explained else Verdict.PARTLY_EXPLAINED
