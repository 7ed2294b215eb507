"""A small ground station: one more MAVLink client over UDP, to command flights with.

It sends its heartbeat and sees the vehicle's: enough to arm, take off, land and wait.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from typing import cast

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.builtin.messages import Message, packed
from sitl.errors import SitlError

IDENTITY = (255, 190)
ARMED = 128
AUTOPILOT = 1
"""Component id of the autopilot."""
BEAT = 1.0
RETRY = 0.5
PATIENCE = 60.0
"""Seconds after which a command that is still refused, or unanswered, has failed."""


class Station(asyncio.DatagramProtocol):
    """Use :meth:`at`.  ``armed`` and ``time`` (boot clock, s) are as last seen."""

    def __init__(self) -> None:
        self.armed = False
        self.time = 0.0
        self.last_text = ""
        self._results: dict[int, int] = {}
        self._news = asyncio.Event()
        self._transport: asyncio.DatagramTransport | None = None
        self._packer = mav.MAVLink(None, srcSystem=IDENTITY[0], srcComponent=IDENTITY[1])
        self._parser = mav.MAVLink(None)
        self._parser.robust_parsing = True

    @classmethod
    @contextlib.asynccontextmanager
    async def at(cls, host: str, port: int) -> AsyncIterator[Station]:
        """A station that speaks to an autopilot that listens on UDP."""
        loop = asyncio.get_running_loop()
        transport, station = await loop.create_datagram_endpoint(cls, remote_addr=(host, port))
        beating = asyncio.create_task(station.beat(), name="ground station: heartbeat")
        try:
            yield station
        finally:
            beating.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await beating
            transport.close()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keeps the transport."""
        self._transport = cast("asyncio.DatagramTransport", transport)

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Takes note of what is needed."""
        del addr
        for message in self._parser.parse_buffer(data) or []:
            if message.get_srcComponent() != AUTOPILOT:
                continue  # forwarded: a companion's heartbeat says nothing of the vehicle
            match message.get_type():
                case "HEARTBEAT":
                    self.armed = bool(message.base_mode & ARMED)
                case "ATTITUDE":
                    self.time = message.time_boot_ms * 1e-3
                case "COMMAND_ACK":
                    self._results[message.command] = message.result
                case "STATUSTEXT":
                    self.last_text = message.text
                case _:
                    continue
            self._news.set()

    def error_received(self, exc: Exception) -> None:
        """Nobody there yet."""
        del exc

    async def take_off(self) -> None:
        """Arms and takes off, as soon as the autopilot allows it.

        Raises:
            SitlError: it never does.
        """
        # It disarms again when the take-off comes late, as on a busy machine at a quick pace.
        await self._insist((mav.MAV_CMD_COMPONENT_ARM_DISARM, 1.0), (mav.MAV_CMD_NAV_TAKEOFF, 0.0))

    async def land(self) -> None:
        """Tells it to land."""
        await self._insist((mav.MAV_CMD_NAV_LAND, 0.0))

    def set_pace(self, speedup: float) -> None:
        """Asks a simulation to run at so many times real time (SIM_SPEEDUP)."""
        self._send(mav.MAVLink_param_set_message(1, 1, b"SIM_SPEEDUP", speedup, 9))

    async def until_disarmed(self) -> None:
        """Waits for the end of a flight."""
        while self.armed:
            await self._wait()

    async def until_time(self, time: float) -> None:
        """Waits for the boot clock."""
        while self.time < time:
            await self._wait()

    async def _insist(self, *steps: tuple[int, float]) -> None:
        """Sends commands in order, again from the first, until the last is accepted."""
        self._results.clear()
        try:
            async with asyncio.timeout(PATIENCE):
                while not await self._all(steps):
                    pass
        except TimeoutError:
            said = self.last_text or "nothing"
            commands = ", ".join(str(command) for command, _ in steps)
            raise SitlError(
                f"command {commands} is not accepted; the autopilot said: {said}"
            ) from None

    async def _all(self, steps: tuple[tuple[int, float], ...]) -> bool:
        """True if every command was accepted at once, in order."""
        for command, parameter in steps:
            parameters = (parameter, 0, 0, 0, 0, 0, 0)
            self._send(mav.MAVLink_command_long_message(1, 1, command, 0, *parameters))
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(RETRY):
                    while command not in self._results:
                        await self._wait()
            # An acceptance that comes late still counts: sent again, a command of a flight that
            # has begun is refused.
            if self._results.get(command) != mav.MAV_RESULT_ACCEPTED:
                self._results.pop(command, None)
                await asyncio.sleep(RETRY / 10)
                return False
        return True

    async def _wait(self) -> None:
        self._news.clear()
        await self._news.wait()

    async def beat(self) -> None:
        """Says once a second that it is there."""
        while True:
            self._send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
            await asyncio.sleep(BEAT)

    def _send(self, message: Message) -> None:
        if self._transport is not None:
            self._transport.sendto(packed(message, self._packer))
