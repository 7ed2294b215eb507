"""One flight of ArduPilot's SITL with an airframe and a wind, and its log."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from sitl.ardupilot.process import ArdupilotProcess
from sitl.builtin.world import Vehicle

CLOSED_S = 3.0
"""After it has disarmed, until the log is on the disk."""


async def fly(
    vehicle: Vehicle,
    out: str | Path,
    *,
    airframe: Mapping[str, object] | None = None,
    parameters: Mapping[str, float] | None = None,
    seconds: float = 180.0,
    speedup: float = 5.0,
    seed: int = 1,
    changes: Mapping[float, Mapping[str, float]] | None = None,
) -> dict[float, float]:
    """Take off, fly manoeuvres, land, and copy the DataFlash log.

    Args:
        vehicle: ``copter`` or ``plane``.
        out: where the log goes.
        airframe: keys of a frame or coefficient file; the nominal one without.
        parameters: ``SIM_*`` and others, in force from the start.
        seconds: of manoeuvres.
        speedup: simulated seconds a second, as far as the machine can follow.
        seed: of the manoeuvres.
        changes: parameters that change in flight, by how many seconds of manoeuvres before.

    Returns:
        When they did, s since the autopilot's boot.

    Raises:
        NoBinaryError: there is no such binary here.
        SitlError: it does not start, fly or land.
    """
    from sitl.pilot import Pilot  # noqa: PLC0415 - MAVSDK is an extra that only this needs

    process = ArdupilotProcess(vehicle, speedup=speedup, parameters=parameters, airframe=airframe)
    try:
        await process.start()
        url = f"tcpout://127.0.0.1:{process.ports[0]}"
        async with Pilot.at(url, vehicle, seed=seed) as pilot:
            await pilot.take_off()
            changed, flown = {}, 0.0
            for at, values in sorted((changes or {}).items()):
                await pilot.manoeuvre(at - flown)
                for name, value in values.items():
                    await pilot.set_parameter(name, value)
                changed[at], flown = pilot.time, at
            await pilot.manoeuvre(seconds - flown)
            await pilot.land()
            await pilot.wait(CLOSED_S)
        process.keep_log(out)
        return changed
    finally:
        await process.stop()
