"""``onboard match --verify``: a simulator flies it again, with what was found."""

from __future__ import annotations

import importlib.util
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from onboard.answers.flown_again import ARDUPILOT, BUILT_IN, FlownAgain, Part, flown_again
from onboard.answers.match import Match
from onboard.answers.match import match as match_recordings
from onboard.core.vehicle.atmosphere import SEA_LEVEL_DENSITY, density
from onboard.core.vehicle.lift_rotors import turning
from onboard.core.vehicle.records import VehicleMatch
from onboard.core.vehicle.signals import airspeed_ratio
from onboard.errors import RecordingError, UsageError

if TYPE_CHECKING:
    from sitl.builtin.airframe.air import Air
    from sitl.builtin.airframe.frame import Airframe
    from sitl.builtin.airframe.wing import Wing

PROFILE_TOP_M = 60.0
LEAST_HEIGHT_M = 0.5
KINDS = ("tlog", "dataflash")
"""Recordings that the simulator can fly again."""


def verify(result: Match, recording: Path, ardupilot: Path | None = None) -> FlownAgain:
    """Fly the recording's motion again, nominally and with what was found, and compare.

    Args:
        result: what was found.
        recording: of which.
        ardupilot: folder of ArduPilot's SITL.  Without it ARDUPILOT_SITL_DIR and PATH are looked
            at, and the built-in simulator flies where there is none.

    Raises:
        UsageError: the recording cannot be flown again.
    """
    kind = result.real.source.recordings[0].kind
    if kind not in KINDS:
        raise UsageError(
            f"--verify: {recording} is no .tlog or DataFlash, and cannot be flown again"
        )
    if result.vehicle.series is None:
        raise UsageError(f"--verify: {recording}: there is nothing to verify")
    if result.vehicle.vehicle == "plane" and len(turning(result.real.signals)):
        raise UsageError(f"--verify: {recording}: no simulator's plane has upright rotors")
    fly = _by_ardupilot if _has_ardupilot(result, ardupilot) else _by_built_in
    with tempfile.TemporaryDirectory() as folder:
        flown = fly(result, recording, Path(folder), ardupilot)
        try:
            second = match_recordings(flown.found, frame=dict(result.frame))
            return flown_again(
                result,
                second,
                recording,
                flown.nominal,
                flown.found,
                simulator=flown.simulator,
                parts=flown.parts,
            )
        except RecordingError as error:
            raise UsageError(f"--verify: {error}") from None


@dataclass(frozen=True, slots=True)
class Flights:
    """Two recordings of a simulator, by the nominal airframe and by what was found."""

    nominal: Path
    found: Path
    simulator: str
    parts: tuple[Part | None, Part | None] = (None, None)


def _has_ardupilot(result: Match, folder: Path | None) -> bool:
    """Whether ArduPilot's simulator flies it.

    Raises:
        UsageError: it was asked for and cannot.
    """
    from sitl.ardupilot.process import find_binary
    from sitl.errors import NoBinaryError

    if result.vehicle.vehicle == "plane":
        if folder is not None:
            raise UsageError(
                "--ardupilot: planes are flown again by the built-in simulator alone, leave it out"
            )
        return False
    try:
        find_binary("copter", folder)
    except NoBinaryError as error:
        if folder is not None:
            raise UsageError(f"--ardupilot: {error}") from None
        return False
    if importlib.util.find_spec("mavsdk") is not None:
        return True
    if folder is not None:
        raise UsageError("--ardupilot: MAVSDK is not installed, the extra sitl")
    return False


def _by_ardupilot(result: Match, recording: Path, folder: Path, binary: Path | None) -> Flights:
    from sitl.ardupilot.again import fly_again
    from sitl.errors import SitlError

    nominal, found = folder / "nominal.BIN", folder / "again.BIN"
    told = {s.name: s.value for s in result.settings}
    try:
        before = fly_again(recording, nominal, folder=binary)
        after = fly_again(recording, found, airframe=result.frame, parameters=told, folder=binary)
    except (SitlError, ValueError) as error:
        raise UsageError(f"--verify: {error}") from None
    return Flights(nominal, found, ARDUPILOT, (before, after))


def _by_built_in(result: Match, recording: Path, folder: Path, binary: Path | None) -> Flights:
    # The simulator only when it is wanted: it is no part of what runs on a vehicle.
    from sitl.again import fly_again
    from sitl.builtin.airframe.air import Air
    from sitl.builtin.airframe.frame import Airframe
    from sitl.builtin.airframe.wing import Wing
    from sitl.errors import SitlError

    del binary
    nominal, found = folder / "nominal.tlog", folder / "again.tlog"
    plane = result.vehicle.vehicle == "plane"
    plain = as_sitl(Wing(), altitude_of(result)) if plane else Airframe()
    air = air_of(result)
    try:
        fly_again(recording, plain, Air(), nominal, recorded_in=air)
        fly_again(recording, craft_of(result), air, found)
    except (SitlError, ValueError) as error:
        raise UsageError(f"--verify: {error}") from None
    return Flights(nominal, found, BUILT_IN)


def craft_of(result: Match) -> Airframe | Wing:
    """The airframe that was found, for the built-in simulator."""
    from sitl.builtin.airframe.frame import Airframe
    from sitl.builtin.airframe.wing import Wing

    v = result.vehicle
    names = {d.name for d in v.effects}
    keys: dict[str, float | list[float]] = dict(result.frame)
    if v.vehicle == "plane":
        if "thrust_scale" in names:
            ratio = next(d for d in v.effects if d.name == "thrust_scale").values["ratio"].real
            keys["hover_throttle"] = Wing().hover_throttle / ratio
        keys["c_n_deltar"] = turning_rudder(result.vehicle)
        values = result.real.signals.parameters
        own = airspeed_ratio(values)
        ratios = [s.value for s in result.settings if s.name == f"SIM_{own}"]
        if ratios:
            # The autopilot of the recording may have another ratio set than the built-in one has.
            usual = Wing().airspeed_ratio
            told = values.get(own, usual)
            keys["airspeed_ratio"] = ratios[0] * usual / told
        return as_sitl(Wing.from_dict(keys), altitude_of(result))
    for effect, unknown, key in (
        ("motor_lag", "motor_lag.time_constant", "motor_lag"),
        ("ground_effect", "ground_effect.gain", "ground_effect"),
    ):
        if effect in names and unknown in v.numbers:
            keys[key] = max(v.numbers[unknown].real, 0.0)
    return Airframe.from_dict(keys)


def turning_rudder(vehicle: VehicleMatch) -> float:
    """Yawing moment of the rudder that goes with its side force, for the built-in simulator.

    The force attacks at the tail, so that one turns as much more as it pushes more.  A force tells
    no moment, and one that pushes less has turned the plane all the same as it was flown.
    """
    from sitl.builtin.airframe.wing import Wing

    usual = Wing()
    if "side_force" not in {d.name for d in vehicle.effects}:
        return usual.c_n_deltar
    force = vehicle.numbers["side_force.c_y_deltar"].real
    return usual.c_n_deltar * max(1.0, force / usual.c_y_deltar)


def as_sitl(wing: Wing, altitude: float) -> Wing:
    """The wing on which the air presses as on ArduPilot's at this altitude, m.

    ArduPilot's plane takes the density twice: coefficients that are handed back are meant for that
    (:mod:`onboard.core.vehicle.plane_airframe`), and the built-in plane takes it once.  So its area
    is as much smaller as the air is thinner; induced drag by lift stays what it is.
    """
    once = float(density(altitude)) / SEA_LEVEL_DENSITY
    return replace(wing, s=wing.s * once, oswald=wing.oswald * once)


def altitude_of(result: Match) -> float:
    """Mean altitude of the flight above mean sea level, m."""
    wind = result.vehicle.wind
    return result.real.ground + (0.0 if wind is None else wind.height)


def air_of(result: Match) -> Air:
    """The air that was found: its wind from 60 m on, where a profile is."""
    from sitl.builtin.airframe.air import Air

    v, wind = result.vehicle, result.vehicle.wind
    names = {d.name for d in v.effects}
    excess = v.numbers["air_density.excess"].real if "air_density" in names else 0.0
    if wind is None or "wind" not in names:
        return Air(density_ratio=1.0 + excess)
    exponent = wind.profile_exponent or 0.0
    gain = (PROFILE_TOP_M / min(max(wind.height, LEAST_HEIGHT_M), PROFILE_TOP_M)) ** exponent
    return Air(
        north=gain * wind.north,
        east=gain * wind.east,
        exponent=exponent,
        turbulence=wind.turbulence_rms or 0.0,
        density_ratio=1.0 + excess,
    )
