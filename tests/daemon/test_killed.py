"""A service that hangs in the middle of a push and is killed for it, as by the watchdog."""

import asyncio
import json
import os
import signal
import subprocess
import sys

import pytest

from tests.daemon.daemons import WANTED, in_force, until
from tests.daemon.standing_vehicle import Vehicle

CHILD = """
import asyncio, json, sys
from tests.daemon.daemons import WANTED, convinced, made
async def main():
    service = made(json.loads(sys.argv[1]))
    convinced(service, WANTED)
    await service.run()
asyncio.run(main())
"""
NEW = WANTED.scale + WANTED.offset


@pytest.mark.slow
@pytest.mark.parametrize("after_sets", [1, 4, 6])
async def test_a_service_killed_in_a_push_leaves_all_old_or_all_new_after_the_next_start(
    after_sets, document, daemon, port, tmp_path
):
    """A real process, real time, a real disk: stopped, then killed, then another in its place."""
    document["http"] = {"enabled": False}
    async with Vehicle(port) as vehicle:
        old = in_force(vehicle)
        child = subprocess.Popen([sys.executable, "-c", CHILD, json.dumps(document)])  # noqa: S603, ASYNC220
        taken = vehicle._set

        def set_and_hang(message):
            taken(message)
            if len(vehicle.sets) == after_sets:
                os.kill(child.pid, signal.SIGSTOP)

        vehicle._set = set_and_hang
        try:
            await until(lambda: len(vehicle.sets) >= after_sets, limit=60.0)
            await asyncio.sleep(0.5)
            assert len(vehicle.sets) == after_sets  # it hangs
        finally:
            child.kill()
            child.wait()
        vehicle._set = taken
        async with daemon(document) as service:
            assert service.parts.journal.damaged == 0
            assert service.parts.journal._open_transactions()
            await until(lambda: not service.parts.journal._open_transactions(), limit=60.0)
            assert in_force(vehicle) in (pytest.approx(old, rel=1e-6), pytest.approx(NEW, rel=1e-6))
            whole = service.parts.journal.last_completed(1)
            is_new = in_force(vehicle) == pytest.approx(NEW, rel=1e-6)
            assert (whole is not None) is is_new
