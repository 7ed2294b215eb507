"""A pilot of any ArduPilot, real or built in: an independent MAVLink client (MAVSDK) that flies.

It arms, takes off, flies random manoeuvres that excite every axis, and lands; what it sees of the
vehicle is in :mod:`sitl.eyes`.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator

from mavsdk.asyncio import Configuration, Mavsdk, MavsdkConnectionError
from mavsdk.asyncio.plugins.mavlink_direct import MavlinkDirectAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.logging import log_subscribe
from mavsdk.plugins.param import ParamError

from sitl.course import Course
from sitl.errors import SitlError
from sitl.eyes import SILENCE, Eyes
from sitl.manoeuvres import GROUND_STATION, Manoeuvres, Plugin, mavlink_message

ACCEPTED = 0
MODES = {
    "copter": {"guided": 4, "land": 9},
    "plane": {"take off": 13, "fly by wire": 6, "land": 26},
}
ARM_DISARM, TAKE_OFF, SET_MODE, SET_INTERVAL, REBOOT = 400, 22, 176, 511, 246
INTERVALS = ((30, 50_000), (33, 100_000), (24, 200_000))
"""Messages that it needs, by number, us."""
REBOOT_TRIES, REBOOT_PAUSE = 60, 1.0
FORCED, UNBELIEVING_S = 21196, 15
"""What makes an autopilot disarm in any case, and after how many seconds on the ground."""


class Pilot:
    """Flies one vehicle.  Use :meth:`at` to get one."""

    def __init__(self, vehicle: str, system: Plugin, *, seed: int = 1) -> None:
        self.vehicle = vehicle
        self._direct = MavlinkDirectAsync(system)
        self._param = ParamAsync(system)
        self._eyes = Eyes(self._direct)
        self._manoeuvres = Manoeuvres(self._eyes, self._direct, seed=seed)

    @classmethod
    @contextlib.asynccontextmanager
    async def at(
        cls, url: str, vehicle: str, *, seed: int = 1, patience: float = SILENCE
    ) -> AsyncIterator[Pilot]:
        """A pilot connected to a MAVSDK connection string, such as ``tcpout://host:port``.

        Raises:
            SitlError: no autopilot there.
        """
        log_subscribe(_quiet)
        configuration = Configuration.create_manual(*GROUND_STATION, 1)
        async with Mavsdk(configuration) as mavsdk:
            try:
                await mavsdk.add_any_connection(url)
            except MavsdkConnectionError as error:
                raise SitlError(f"no connection to {url}: {error}") from error
            system = await mavsdk.first_autopilot(timeout_s=patience)
            if system is None:
                raise SitlError(f"no autopilot at {url}")
            pilot = cls(vehicle, system, seed=seed)
            await pilot._watch()
            try:
                yield pilot
            finally:
                await pilot._rest()

    async def _watch(self) -> None:
        self._eyes.open()
        for message, interval_us in INTERVALS:
            await self.command(SET_INTERVAL, message, interval_us)

    async def _rest(self) -> None:
        await self._eyes.close()
        self._direct.destroy()
        self._param.destroy()

    @property
    def time(self) -> float:
        """Boot time of the autopilot, s."""
        return self._eyes.time

    @property
    def height(self) -> float:
        """Above home, m."""
        return self._eyes.height

    @property
    def armed(self) -> bool:
        """As the last heartbeat said."""
        return self._eyes.armed

    async def wait(self, seconds: float) -> None:
        """Waits by the autopilot's clock."""
        await self._eyes.wait(seconds)

    async def parameter(self, name: str) -> float:
        """Reads a parameter.

        Raises:
            SitlError: it does not answer.
        """
        try:
            return float(await self._param.get_param_float(name))
        except ParamError:
            try:
                return float(await self._param.get_param_int(name))
            except ParamError as error:
                raise SitlError(f"parameter {name}: {error}") from error

    async def set_parameter(self, name: str, value: float) -> None:
        """Writes a float parameter.

        Raises:
            SitlError: it was not taken.
        """
        try:
            await self._param.set_param_float(name, value)
        except ParamError as error:
            raise SitlError(f"parameter {name}: {error}") from error

    async def command(self, number: int, *parameters: float) -> bool:
        """COMMAND_LONG; whether it was accepted."""
        padded = [*parameters, *[0.0] * (7 - len(parameters))]
        fields: dict[str, float] = {f"param{i}": p for i, p in enumerate(padded, start=1)}
        fields |= {"target_system": 1, "target_component": 1, "command": number, "confirmation": 0}
        message = mavlink_message("COMMAND_LONG", fields)
        acknowledged = await self._direct.send_command(message)
        return int(json.loads(acknowledged.fields_json).get("result", -1)) == ACCEPTED

    async def set_mode(self, mode: str) -> None:
        """Changes the mode, by the name in MODES."""
        await self.command(SET_MODE, 1, MODES[self.vehicle][mode])

    async def take_off(self, height: float = 25.0) -> None:
        """Waits until it may arm, arms and climbs to a safe height.

        Args:
            height: of a copter, m above the ground.

        Raises:
            SitlError: it refuses.
        """
        eyes = self._eyes
        await eyes.until(lambda: eyes.fixed, "a GPS fix")
        await self.set_mode("guided" if self.vehicle == "copter" else "take off")
        for _ in range(120):
            if await self.command(ARM_DISARM, 1):
                break
            await self.wait(1.0)
        else:
            raise SitlError(f"does not arm: {eyes.said}")
        if self.vehicle == "copter":
            await self.command(TAKE_OFF, 0, 0, 0, 0, 0, 0, height)
        safe = 0.8 * height if self.vehicle == "copter" else 45.0
        await eyes.until(lambda: eyes.height > safe, f"a height of {safe:.0f} m")

    async def manoeuvre(self, seconds: float) -> None:
        """Flies at random for so long."""
        end = self.time + seconds
        if self.vehicle == "plane":
            await self.set_mode("fly by wire")
        await self._manoeuvres.fly(self.vehicle, end)

    async def follow(self, course: Course) -> tuple[float, float]:
        """Flies a copter along a course, from its start, by the autopilot's clock.

        Returns:
            When that began and ended, s since the autopilot's boot.
        """
        return await self._manoeuvres.follow(course)

    async def land(self) -> None:
        """Comes down and waits until it has disarmed."""
        if self.vehicle == "copter":
            await self._manoeuvres.set_velocity((0.0, 0.0, 0.0), self._eyes.yaw)
            await self.wait(3.0)
        await self.set_mode("land")
        eyes = self._eyes
        await eyes.until(lambda: eyes.standing or not eyes.armed, "the landing")
        # Some versions of Plane leave the disarming to the pilot; and a copter with another frame
        # than the one that its landing detector is tuned for may stand there, and not believe it.
        for k in range(60):
            await self.wait(1.0)
            force = FORCED if k >= UNBELIEVING_S else 0
            if not eyes.armed or (eyes.standing and await self.command(ARM_DISARM, 0, force)):
                break
        await eyes.until(lambda: not eyes.armed, "disarming after the landing")

    async def reboot(self) -> None:
        """Reboots the autopilot and waits until its clock has begun anew.

        Raises:
            SitlError: it does not come back.
        """
        before = self.time
        fields = {f"param{i}": 1.0 if i == 1 else 0.0 for i in range(1, 8)}
        fields |= {"target_system": 1, "target_component": 1, "command": REBOOT, "confirmation": 0}
        # Not as a command that is waited for: it may be gone before its answer is.
        await self._direct.send_message(mavlink_message("COMMAND_LONG", fields))
        for _ in range(REBOOT_TRIES):
            await asyncio.sleep(REBOOT_PAUSE)
            if self.time < before:
                return
            # What was asked for before the reboot is forgotten: nothing tells the time.
            for message, interval_us in INTERVALS:
                fields |= {"command": SET_INTERVAL, "param1": message, "param2": interval_us}
                await self._direct.send_message(mavlink_message("COMMAND_LONG", fields))
        raise SitlError("waited in vain for the reboot")


def _quiet(level: object, message: str, file: str | None, line: int) -> bool:
    """Keeps MAVSDK's log off the terminal; what matters comes back as results."""
    del level, message, file, line
    return True
