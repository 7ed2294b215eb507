"""A recorded flight, flown again by a vehicle with a given airframe in given air."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sitl.builtin.airframe.air import Air
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.flight import Craft
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.airframe.wing import Wing
from sitl.builtin.truth import ImuTruth
from sitl.errors import SitlError
from sitl.recorded_motion import recorded_motion
from sitl.recording import LEAD, FlightSpec, write_tlog

AFTER_S = 2.0


def fly_again(
    recording: str | Path,
    airframe: Craft,
    wind: Air,
    out: str | Path,
    *,
    recorded_in: Air | None = None,
    imus: tuple[ImuTruth, ...] = (ImuTruth(),),
    seed: int = 0,
) -> dict[str, Any]:
    """Flies the velocity and heading of a recording again, and writes what that records.

    Args:
        recording: .tlog or DataFlash; the flight that is repeated.
        airframe: what flies it; load it from a frame or coefficient file.
        wind: in which.
        out: the .tlog that is written.
        recorded_in: wind of the recording; ``wind`` if nothing is said.
        imus: the sensors that it flies with.
        seed: of their noise.

    Returns:
        The truth record of the second flight.

    Raises:
        SitlError: the recording cannot be flown again, or by no such vehicle.
    """
    was = wind if recorded_in is None else recorded_in
    flown = recorded_motion(recording, (was.north, was.east))
    fitting = Airframe if flown.vehicle == "copter" else Wing
    if not isinstance(airframe, fitting):
        raise SitlError(f"a {flown.vehicle} flew it, and the airframe is none of a {flown.vehicle}")
    spec = FlightSpec(
        vehicle=flown.vehicle,
        seed=seed,
        duration=LEAD + flown.motion.n / 1000.0 + AFTER_S,
        imus=imus,
        environment=flown.environment,
        aircraft=Aircraft(craft=airframe, air=wind, motion=flown.motion),
    )
    return write_tlog(spec, out)
