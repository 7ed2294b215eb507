"""A line, or the service itself, holds back what the vehicle says in the middle of a push."""

import asyncio
import json
import os
import signal
import subprocess
import sys

import pytest

from onboard.push.limits import ARMED_UNDO_S, FRESH_S
from tests.daemon.daemons import SIX, WANTED, convinced, in_force, until
from tests.daemon.standing_vehicle import Vehicle, float32
from tests.daemon.test_killed import CHILD

ARMS_S = 1.3
"""s after what it says is held back: it has said once more that it is disarmed."""
FLIES_S = ARMS_S + ARMED_UNDO_S
"""At the earliest.  What is held back for longer than a HEARTBEAT more has no time for anything."""


class Held(Vehicle):
    """What it says does not arrive from some moment of a push on, until it is let go."""

    def __init__(self, port, *, when):
        super().__init__(port)
        self.late = 0
        """Values that were set in the air, and new ones long after the last word."""
        self.holds = self._waiting = None
        self._when = when

    def send(self, message):
        if self._waiting is None:
            super().send(message)
        else:
            self._waiting.append(message)

    def hold(self):
        self.holds = asyncio.get_running_loop().time()
        self._waiting = []

    def let_go(self):
        waiting, self._waiting = self._waiting, None
        for message in waiting:
            self.send(message)

    def _set(self, message):
        new = float32(dict(zip(SIX, WANTED.scale + WANTED.offset, strict=True))[message.param_id])
        at = asyncio.get_running_loop().time()
        self.late += self.holds is not None and (
            not self.landed or (message.param_value == new and at > self.holds + FRESH_S)
        )
        super()._set(message)
        if self._when == "set" and len(self.sets) == 2 and self.holds is None:
            self.hold()

    def _tell(self, name):
        super()._tell(name)
        new = name in SIX and name not in dict(self.sets)
        if self._when == "read" and len(self.sets) == 2 and new and self.holds is None:
            self.hold()


async def takes_off(vehicle):
    """Armed, and in the air, while nothing of it is heard."""
    await asyncio.sleep(ARMS_S)
    vehicle.armed = True
    await asyncio.sleep(FLIES_S - ARMS_S)
    vehicle.landed = False


async def lands(vehicle):
    vehicle.landed, vehicle.armed = True, False


@pytest.mark.virtual_time
@pytest.mark.parametrize("held_s", [4.4, 4.8])
@pytest.mark.parametrize("when", ["set", "read"])
async def test_a_vehicle_that_took_off_while_the_line_stood_still_gets_nothing(
    when, held_s, document, daemon, port
):
    async with daemon(document) as service, Held(port, when=when) as vehicle:
        old = in_force(vehicle)
        convinced(service, WANTED)
        await until(lambda: vehicle.holds is not None)
        await takes_off(vehicle)
        await asyncio.sleep(held_s - FLIES_S)
        vehicle.let_go()
        await asyncio.sleep(10.0)
        assert not vehicle.late
        assert service.parts.journal.recover(), "it is undone on the ground"
        await lands(vehicle)
        await until(lambda: not service.parts.journal._open_transactions())
        assert in_force(vehicle) == pytest.approx(old, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("when", ["set", "read"])
async def test_a_service_that_stood_still_writes_nothing_to_who_has_taken_off(
    when, document, port, tmp_path
):
    """A real process that had neither disk nor core for seconds: all that was said waits for it."""
    document["http"] = {"enabled": False}
    async with Held(port, when=when) as vehicle:
        child = subprocess.Popen([sys.executable, "-c", CHILD, json.dumps(document)])  # noqa: S603, ASYNC220

        def stand_still():
            vehicle.holds = asyncio.get_running_loop().time()
            os.kill(child.pid, signal.SIGSTOP)

        vehicle.hold = stand_still
        try:
            await until(lambda: vehicle.holds is not None, limit=60.0)
            await takes_off(vehicle)
            await asyncio.sleep(1.2)
            os.kill(child.pid, signal.SIGCONT)
            await asyncio.sleep(3.0)
        finally:
            child.kill()
            child.wait()
        assert not vehicle.late
