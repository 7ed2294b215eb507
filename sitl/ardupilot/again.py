"""A recorded flight of a multicopter, flown again by ArduPilot's SITL."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from pathlib import Path

from sitl.ardupilot.flight import CLOSED_S
from sitl.ardupilot.process import ArdupilotProcess
from sitl.course import Course
from sitl.errors import SitlError
from sitl.recorded_motion import Recorded, recorded_motion

TRACKING: Mapping[str, float] = {
    "ANGLE_MAX": 6000,
    "PSC_JERK_XY": 20,
    "PSC_JERK_Z": 20,
    "SIM_WIND_SPD": 0,
    "SIM_WIND_TURB": 0,
}
"""As quick as a recorded flight may have been: a course that the autopilot smooths is another one.
And still air, unless something else is told."""


def fly_again(
    recording: str | Path,
    out: str | Path,
    *,
    airframe: Mapping[str, object] | None = None,
    parameters: Mapping[str, float] | None = None,
    folder: str | Path | None = None,
    speedup: float = 5.0,
) -> tuple[float, float]:
    """Flies the place, velocity and heading of a recording again, and copies the log of that.

    Args:
        recording: .tlog or DataFlash of a multicopter.
        out: the DataFlash log that is written.
        airframe: keys of a frame file; ArduPilot's nominal one without.
        parameters: ``SIM_*`` and others, in force from the start.
        folder: of the binary; ARDUPILOT_SITL_DIR and PATH without.
        speedup: simulated seconds a second, as far as the machine can follow.

    Returns:
        From when to when it follows the recording, s on the clock of the log.

    Raises:
        NoBinaryError: there is no such binary.
        SitlError: the recording cannot be flown again, or it was not flown.
    """
    flown = recorded_motion(recording)
    if flown.vehicle != "copter":
        raise SitlError("ArduPilot's simulator flies no plane along a course")
    process = ArdupilotProcess(
        "copter",
        speedup=speedup,
        parameters={**TRACKING, **(parameters or {})},
        airframe=airframe,
        folder=folder,
        home=_home(flown),
    )
    return asyncio.run(_fly(process, Course.of(flown.motion), Path(out)))


def _home(flown: Recorded) -> str:
    place = flown.environment
    return f"{place.latitude_deg:.7f},{place.longitude_deg:.7f},{place.altitude:.2f},0"


async def _fly(process: ArdupilotProcess, course: Course, out: Path) -> tuple[float, float]:
    from sitl.pilot import Pilot  # noqa: PLC0415 - MAVSDK is an extra that only this needs

    try:
        await process.start()
        url = f"tcpout://127.0.0.1:{process.ports[0]}"
        async with Pilot.at(url, "copter") as pilot:
            await pilot.take_off(-course.start.position[2])
            followed = await pilot.follow(course)
            await pilot.land()
            await pilot.wait(CLOSED_S)
        process.keep_log(out)
        return followed
    finally:
        await process.stop()
