"""A second signal ends the service at once, in good order."""

import asyncio
import os
import signal

import pytest

from onboard.cli.run import _serve
from onboard.daemon.process.service import Service
from onboard.daemon.process.starts import Starts
from onboard.daemon.setup.configuration import from_mapping
from tests.daemon.daemons import until


@pytest.mark.parametrize("first", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
@pytest.mark.parametrize("second", [signal.SIGTERM, signal.SIGINT])
async def test_it_leaves_what_was_under_way_and_frees_everything(
    document, monkeypatch, first, second
):
    waiting = asyncio.Event()
    services = []

    async def unfinished(self):
        services.append(self)
        waiting.set()
        await asyncio.Event().wait()

    monkeypatch.setattr(Service, "_finish_push", unfinished)
    serving = asyncio.create_task(_serve(from_mapping(document, source="test"), Starts(None)))
    await until(lambda: serving.done() or signal.getsignal(first) is not signal.SIG_DFL)
    await asyncio.sleep(0.2)
    os.kill(os.getpid(), first)
    async with asyncio.timeout(30.0):
        await waiting.wait()
        os.kill(os.getpid(), second)
        assert await serving is second
    (service,) = services
    assert service.phase == "stopped"
    # The journal's lock and the ports are free: the next start finds nothing in its way.
    again = Service(from_mapping(document, source="test"))
    again.parts.journal.close()


@pytest.mark.parametrize("number", [signal.SIGUSR1, signal.SIGUSR2])
async def test_a_signal_that_asks_for_nothing_ends_nothing(document, number):
    service = Service(from_mapping(document, source="test"))
    serving = asyncio.create_task(service.run(handle_signals=True))
    await service.ready.wait()
    os.kill(os.getpid(), number)
    await asyncio.sleep(0.3)
    assert not serving.done()
    assert service.phase == "searching"
    os.kill(os.getpid(), signal.SIGHUP)  # the terminal is closed: in good order, sums are saved
    async with asyncio.timeout(30.0):
        await serving
    assert service.phase == "stopped"
    assert service.stopped_by is signal.SIGHUP
