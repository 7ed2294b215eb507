"""One interface over both simulators: the same test flies the built-in one or a real ArduPilot.

::

    async with simulator("builtin", "copter", speedup=10) as sitl:
        await sitl.set_truth(1, scale=(1.02, 0.98, 1.01), offset=(0.2, -0.1, 0.3))
        ...  # connect to sitl.endpoint
        await sitl.fly(120.0)
        await sitl.land()
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Mapping
from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias

from sitl.ardupilot.process import ArdupilotProcess, find_binary
from sitl.builtin.autopilot import Autopilot
from sitl.builtin.effects import Vector3
from sitl.builtin.impairment import Impairment
from sitl.builtin.server import Server
from sitl.builtin.truth import BOARD, ImuTruth, Truth
from sitl.builtin.world import Vehicle
from sitl.errors import SitlError

if TYPE_CHECKING:
    from sitl.pilot import Pilot

Kind: TypeAlias = Literal["builtin", "ardupilot"]
LANDING = 250.0
"""Simulated seconds that a flight of the built-in autopilot goes on unless it is told to land."""
POLL = 0.02
DEAD = 120.0
"""Wall-clock seconds without progress after which a simulation counts as dead."""
AXES = "XYZ"


class Simulator(Protocol):
    """A simulated vehicle, standing, disarmed, ready to be connected to at ``endpoint``."""

    vehicle: Vehicle
    endpoint: str

    async def set_truth(self, imu: int, *, scale: Vector3, offset: Vector3) -> None:
        """Makes accelerometer ``imu`` (from 1) read ``f / scale + offset``."""

    async def fly(self, seconds: float) -> None:
        """Arms, takes off and manoeuvres for about so long (its own clock); returns aloft."""

    async def land(self) -> None:
        """Lands; returns when it has disarmed."""

    async def reboot(self) -> None:
        """Reboots the autopilot, disarmed; returns when it runs again."""

    async def parameter(self, name: str) -> float:
        """The value of a parameter."""

    async def set_parameter(self, name: str, value: float) -> None:
        """Somebody else sets a parameter."""


@contextlib.asynccontextmanager
async def simulator(
    kind: Kind,
    vehicle: Vehicle,
    *,
    speedup: float = 5.0,
    seed: int = 1,
    imus: int = 1,
    impairment: Impairment | None = None,
    parameters: Mapping[str, float] | None = None,
    board: str = BOARD,
) -> AsyncIterator[Simulator]:
    """Starts a simulator and stops it in the end.

    Args:
        kind: ``builtin`` or ``ardupilot``.
        vehicle: ``plane`` or ``copter``.
        speedup: simulated seconds a second.
        seed: of manoeuvres and noise.
        imus: accelerometers of the built-in autopilot; ArduPilot SITL has two.
        impairment: of the built-in autopilot's links.
        parameters: what it is switched on with, beside its defaults.
        board: unique id of the built-in autopilot; each of ArduPilot SITL has another one.

    Raises:
        NoBinaryError: no ArduPilot binary is to be found.
        SitlError: it does not start.
    """
    if kind == "builtin":
        hardware = Truth(imus=(ImuTruth(),) * imus, seed=seed, board=board)
        autopilot = Autopilot(vehicle, hardware, parameters=parameters)
        server = Server(autopilot, speedup=speedup, impairment=impairment)
        port = await server.listen_udp()
        task = asyncio.create_task(server.run(), name="built-in autopilot")
        try:
            yield _Builtin(server, task, vehicle, f"udpout:127.0.0.1:{port}")
        finally:
            task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await task
        return
    from sitl.pilot import Pilot  # noqa: PLC0415 - MAVSDK is an extra that only this needs

    process = ArdupilotProcess(vehicle, speedup=speedup, parameters=parameters)
    try:
        await process.start()
        url = f"tcpout://127.0.0.1:{process.ports[0]}"
        async with Pilot.at(url, vehicle, seed=seed) as pilot:
            yield _Ardupilot(pilot, vehicle, f"tcp:127.0.0.1:{process.ports[1]}")
    finally:
        await process.stop()


def unavailable(kind: Kind, vehicle: Vehicle) -> str | None:
    """Why this kind of simulator cannot be had here; None when it can."""
    if kind == "builtin":
        return None
    try:
        find_binary(vehicle)
        import mavsdk  # noqa: F401, PLC0415 - an extra
    except (SitlError, ImportError) as error:
        return str(error)
    return None


class _Builtin:
    """The built-in autopilot in a task of this process."""

    def __init__(
        self, server: Server, task: asyncio.Task[None], vehicle: Vehicle, endpoint: str
    ) -> None:
        self.vehicle = vehicle
        self.endpoint = endpoint
        self._server = server
        self._task = task

    @property
    def autopilot(self) -> Autopilot:
        """The machine, for a look behind the scenes; only between its steps."""
        return self._server.autopilot

    async def set_truth(self, imu: int, *, scale: Vector3, offset: Vector3) -> None:
        def change(autopilot: Autopilot) -> None:
            for axis, s, o in zip(AXES, scale, offset, strict=True):
                autopilot.parameters.set(autopilot.now, f"SIM_ACC{imu}_SCAL_{axis}", s)
                autopilot.parameters.set(autopilot.now, f"SIM_ACC{imu}_BIAS_{axis}", o)

        await self._do(change)

    async def fly(self, seconds: float) -> None:
        refused: list[str] = ["not asked yet"]

        def launch(autopilot: Autopilot) -> None:
            refused[:] = autopilot.arm()
            if not refused:
                autopilot.take_off(seconds + LANDING)

        async with asyncio.timeout(DEAD):
            while refused:
                await self._do(launch)
        end = self.autopilot.clock + seconds
        while self.autopilot.clock < end:
            await self._step()

    async def land(self) -> None:
        await self._do(lambda autopilot: autopilot.control.land())
        while self.autopilot.armed or self.autopilot.flying:
            await self._step()

    async def reboot(self) -> None:
        before = self.autopilot.parameters["STAT_BOOTCNT"]
        await self._do(lambda autopilot: autopilot.request_reboot())
        while self.autopilot.parameters["STAT_BOOTCNT"] == before:
            await self._step()

    async def parameter(self, name: str) -> float:
        return self.autopilot.parameters[name]

    async def set_parameter(self, name: str, value: float) -> None:
        def change(autopilot: Autopilot) -> None:
            for answer in autopilot.parameters.set(autopilot.now, name, value):
                autopilot.say(answer)

        await self._do(change)

    async def _do(self, action: Callable[[Autopilot], object]) -> None:
        done = asyncio.Event()
        loop = asyncio.get_running_loop()

        def act(autopilot: Autopilot) -> None:
            action(autopilot)
            loop.call_soon_threadsafe(done.set)

        self._server.request(act)
        async with asyncio.timeout(DEAD):
            await done.wait()

    async def _step(self) -> None:
        if self._task.done():
            raise SitlError("the built-in autopilot has ended")
        await asyncio.sleep(POLL)


class _Ardupilot:
    """A real binary, flown through MAVSDK."""

    def __init__(self, pilot: Pilot, vehicle: Vehicle, endpoint: str) -> None:
        self.vehicle = vehicle
        self.endpoint = endpoint
        self._pilot = pilot

    async def set_truth(self, imu: int, *, scale: Vector3, offset: Vector3) -> None:
        for axis, s, o in zip(AXES, scale, offset, strict=True):
            await self._pilot.set_parameter(f"SIM_ACC{imu}_SCAL_{axis}", s)
            await self._pilot.set_parameter(f"SIM_ACC{imu}_BIAS_{axis}", o)

    async def fly(self, seconds: float) -> None:
        await self._pilot.take_off()
        await self._pilot.manoeuvre(seconds)

    async def land(self) -> None:
        await self._pilot.land()

    async def reboot(self) -> None:
        await self._pilot.reboot()

    async def parameter(self, name: str) -> float:
        return await self._pilot.parameter(name)

    async def set_parameter(self, name: str, value: float) -> None:
        await self._pilot.set_parameter(name, value)
