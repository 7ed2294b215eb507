"""What a pilot sees of an autopilot: its last messages, and waiting until they say something.

All waiting is by the autopilot's own clock, so that the speed of the simulation does not matter; a
limit on the wall clock only catches a simulator that has died.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from typing import Any

from sitl.errors import SitlError
from sitl.manoeuvres import Plugin

ARMED = 128
SILENCE = 60.0
"""Wall-clock seconds without the wanted event after which a simulator counts as dead."""
WATCHED = ("HEARTBEAT", "ATTITUDE", "GLOBAL_POSITION_INT", "GPS_RAW_INT", "STATUSTEXT")
NO_AUTOPILOT = 8
"""MAV_AUTOPILOT_INVALID: who sends such a HEARTBEAT is none."""
STANDING_M, STANDING_M_S = 2.0, 0.5
FIX_3D = 3


class Eyes:
    """The vehicle as its messages show it."""

    def __init__(self, direct: Plugin) -> None:
        """Take MAVSDK's way to hear any message."""
        self._direct = direct
        self._state: dict[str, dict[str, Any]] = {}
        self._news = asyncio.Condition()
        self._tasks: list[asyncio.Task[None]] = []

    def open(self) -> None:
        """Begin to look."""
        for name in WATCHED:
            self._tasks.append(asyncio.create_task(self._follow(name), name=f"pilot: {name}"))

    async def close(self) -> None:
        """Look no more."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _follow(self, name: str) -> None:
        async for message in self._direct.subscribe_message(name):
            fields = json.loads(message.fields_json)
            if fields.get("autopilot") == NO_AUTOPILOT:
                continue  # a companion's heartbeat, which the vehicle passes on, has never armed
            async with self._news:
                self._state[name] = fields
                self._news.notify_all()

    async def until(self, condition: Callable[[], bool], what: str) -> None:
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
                said = self.said or "nothing"
                raise SitlError(f"waited in vain for {what}; it last said: {said}") from None

    async def wait(self, seconds: float) -> None:
        """Waits by the autopilot's clock."""
        end = self.time + seconds
        await self.until(lambda: self.time >= end, f"{seconds:.0f} s to pass")

    @property
    def said(self) -> str | None:
        """Its last text, if it said anything."""
        text = self._state.get("STATUSTEXT", {}).get("text")
        return None if text is None else str(text)

    @property
    def fixed(self) -> bool:
        """Whether it knows where it is."""
        return int(self._state.get("GPS_RAW_INT", {}).get("fix_type", 0)) >= FIX_3D

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
        return abs(self.height) < STANDING_M and speed < STANDING_M_S

    @property
    def yaw(self) -> float:
        """Heading, rad."""
        return float(self._state.get("ATTITUDE", {}).get("yaw", 0.0))
