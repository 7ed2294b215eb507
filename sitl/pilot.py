"""A pilot of any ArduPilot, real or built in: an independent MAVLink client (MAVSDK) that flies.

It arms, takes off, flies random manoeuvres that excite every axis, and lands.  All waiting is
by the autopilot's own clock, so that the speed of the simulation does not matter; a limit on
the wall clock only catches a simulator that has died.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable
from typing import Any

from mavsdk.asyncio import Configuration, Mavsdk, MavsdkConnectionError
from mavsdk.asyncio.plugins.mavlink_direct import MavlinkDirectAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.logging import log_subscribe
from mavsdk.plugins.param import ParamError

from sitl.course import Course
from sitl.errors import SitlError
from sitl.manoeuvres import GROUND_STATION, Manoeuvres, Plugin, mavlink_message

ARMED = 128
ACCEPTED = 0
SILENCE = 60.0
"""Wall-clock seconds without the wanted event after which a simulator counts as dead."""
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
        self._manoeuvres = Manoeuvres(self, self._direct, seed=seed)
        self._state: dict[str, dict[str, Any]] = {}
        self._news = asyncio.Condition()
        self._tasks: list[asyncio.Task[None]] = []

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

    # -- what it sees ----------------------------------------------------------------------

    async def _watch(self) -> None:
        for name in ("HEARTBEAT", "ATTITUDE", "GLOBAL_POSITION_INT", "GPS_RAW_INT", "STATUSTEXT"):
            self._tasks.append(asyncio.create_task(self._follow(name), name=f"pilot: {name}"))
        for message, interval_us in INTERVALS:
            await self.command(SET_INTERVAL, message, interval_us)

    async def _follow(self, name: str) -> None:
        async for message in self._direct.subscribe_message(name):
            async with self._news:
                self._state[name] = json.loads(message.fields_json)
                self._news.notify_all()

    async def _rest(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._direct.destroy()
        self._param.destroy()

    async def _until(self, condition: Callable[[], bool], what: str) -> None:
        """Waits for something to be seen.

        Raises:
            SitlError: the simulator has fallen silent, or it took far too long.
        """
        async with self._news:
            try:
                async with asyncio.timeout(SILENCE * 5):
                    while not condition():
                        await asyncio.wait_for(self._news.wait(), SILENCE)
            except TimeoutError:
                said = self._state.get("STATUSTEXT", {}).get("text", "nothing")
                raise SitlError(f"waited in vain for {what}; it last said: {said}") from None

    @property
    def time(self) -> float:
        """Boot time of the autopilot, s."""
        return float(self._state.get("ATTITUDE", {}).get("time_boot_ms", 0)) * 1e-3

    @property
    def armed(self) -> bool:
        """As the last heartbeat said."""
        return bool(int(self._state.get("HEARTBEAT", {}).get("base_mode", 0)) & ARMED)

    @property
    def height(self) -> float:
        """Above home, m."""
        return float(self._state.get("GLOBAL_POSITION_INT", {}).get("relative_alt", 0)) * 1e-3

    @property
    def standing(self) -> bool:
        """On the ground and not moving."""
        speed = float(self._state.get("GPS_RAW_INT", {}).get("vel", 0)) * 1e-2
        return abs(self.height) < 2.0 and speed < 0.5

    @property
    def yaw(self) -> float:
        """Heading, rad."""
        return float(self._state.get("ATTITUDE", {}).get("yaw", 0.0))

    async def wait(self, seconds: float) -> None:
        """Waits by the autopilot's clock."""
        end = self.time + seconds
        await self._until(lambda: self.time >= end, f"{seconds:.0f} s to pass")

    # -- what it does ----------------------------------------------------------------------

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
        await self._until(
            lambda: int(self._state.get("GPS_RAW_INT", {}).get("fix_type", 0)) >= 3, "a GPS fix"
        )
        await self.set_mode("guided" if self.vehicle == "copter" else "take off")
        for _ in range(120):
            if await self.command(ARM_DISARM, 1):
                break
            await self.wait(1.0)
        else:
            raise SitlError(f"does not arm: {self._state.get('STATUSTEXT', {}).get('text')}")
        if self.vehicle == "copter":
            await self.command(TAKE_OFF, 0, 0, 0, 0, 0, 0, height)
        safe = 0.8 * height if self.vehicle == "copter" else 45.0
        await self._until(lambda: self.height > safe, f"a height of {safe:.0f} m")

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
            await self._manoeuvres.set_velocity((0.0, 0.0, 0.0), self.yaw)
            await self.wait(3.0)
        await self.set_mode("land")
        await self._until(lambda: not self.armed or self.standing, "the landing")
        # Some versions of Plane leave the disarming to the pilot; and a copter with another frame
        # than the one that its landing detector is tuned for may stand there, and not believe it.
        for k in range(60):
            await self.wait(1.0)
            force = FORCED if k >= UNBELIEVING_S else 0
            if not self.armed or (self.standing and await self.command(ARM_DISARM, 0, force)):
                break
        await self._until(lambda: not self.armed, "disarming after the landing")

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
