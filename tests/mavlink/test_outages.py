"""Whoever is absent for long is told of once: one line when it begins, one when it is over."""

import asyncio
import logging
import re
from contextlib import asynccontextmanager
from itertools import cycle

import pytest

from onboard.daemon.process.service import Service
from onboard.daemon.setup.configuration import from_mapping
from onboard.mavlink import connection as connection_module
from onboard.mavlink.limits import BACKOFF_CAP_S
from onboard.outage import SETTLE_S, Outage
from tests.mavlink.mavlink_peer import FakeAir, heartbeat
from tests.mavlink.virtual_time import virtual_time

REFUSED = ConnectionRefusedError(111, "Connection refused")
ABSENT = FileNotFoundError(2, "No such file or directory")
UNREACHABLE = OSError(101, "Network is unreachable")
ENDPOINTS = {
    "tcp:127.0.0.1:5760": REFUSED,
    "serial:/dev/ttyACM0:57600": ABSENT,
    "udpout:192.168.1.2:14550": UNREACHABLE,
}
DURATIONS = [30.0, 600.0]


class Absence(FakeAir):
    """Nobody is there from one time to another; each try meets the next of the errors."""

    def __init__(self, *errors, begin=0.0, end=0.0):
        super().__init__()
        self._errors, self._begin, self._end = cycle(errors), begin, end

    async def open(self, endpoint, receive, lost, *, linger, first):
        if self._begin <= asyncio.get_running_loop().time() < self._end:
            self.failures = [next(self._errors)]
        return await super().open(endpoint, receive, lost, linger=linger, first=first)

    async def beat(self, seconds):
        """Whoever is there beats its heart."""
        for _ in range(round(seconds)):
            for transport in self.transports[-1:]:
                transport.say(heartbeat())
            await asyncio.sleep(1.0)


@asynccontextmanager
async def connecting(endpoint, air, directory, monkeypatch):
    """A service's link under way, telling the service what happens."""
    monkeypatch.setattr(connection_module, "open_transport", air.open)
    clock = asyncio.get_running_loop().time
    configuration = {"link": {"endpoints": [endpoint]}, "state": {"directory": str(directory)}}
    service = Service(from_mapping(configuration, source="test"), clock=clock, wall_clock=clock)
    service.link.subscribe_events(service.contact.on_link_event)
    task = asyncio.create_task(service.link.run())
    try:
        yield service
    finally:
        service.link.close()
        await task
        service.handover.let_go()


def lines(caplog, endpoint):
    """(is a warning, text) of what the log says of an endpoint."""
    said = [r for r in caplog.records if r.levelno >= logging.INFO]
    return [
        (r.levelno >= logging.WARNING, r.getMessage()) for r in said if endpoint in r.getMessage()
    ]


@pytest.mark.parametrize("seconds", DURATIONS)
@pytest.mark.parametrize("endpoint", ENDPOINTS)
@virtual_time
async def test_a_broken_start_is_one_warning_and_one_recovery(
    endpoint, seconds, tmp_path, monkeypatch, caplog
):
    caplog.set_level(logging.INFO)
    air = Absence(ENDPOINTS[endpoint], end=seconds)
    async with connecting(endpoint, air, tmp_path, monkeypatch) as service:
        await air.beat(seconds)
        view = service.snapshot().link
        assert view.endpoints[0].tries == len(air.opened_at) > 4
        assert view.counters["failures"] == view.endpoints[0].tries
        (begins,) = lines(caplog, endpoint)
        assert begins[0]
        assert ENDPOINTS[endpoint].strerror in begins[1]
        await air.beat(60.0)
        assert service.snapshot().link.endpoints[0].tries == 0
    begins, (warning, text) = lines(caplog, endpoint)
    assert not warning
    assert f"{view.endpoints[0].tries} tries" in text
    lasted, unit = re.search(r"after (\d+) (s|min)", text).groups()
    lasted = float(lasted) * (60.0 if unit == "min" else 1.0)
    assert seconds - 30.0 <= lasted <= seconds + BACKOFF_CAP_S + 30.0


@pytest.mark.parametrize("seconds", DURATIONS)
@virtual_time
async def test_who_goes_and_comes_back_is_one_warning_and_one_recovery(
    seconds, tmp_path, monkeypatch, caplog
):
    caplog.set_level(logging.INFO)
    endpoint = "tcp:127.0.0.1:5760"
    air = Absence(REFUSED, begin=20.0, end=20.0 + seconds)
    async with connecting(endpoint, air, tmp_path, monkeypatch):
        await air.beat(20.0)
        assert lines(caplog, endpoint) == []
        air.transports[0].lost("closed by the other side")
        await air.beat(seconds + 60.0)
    (lost, why), (still, text) = lines(caplog, endpoint)
    assert lost
    assert "closed by the other side" in why
    assert not still
    assert "back after" in text


@virtual_time
async def test_a_line_that_falls_silent_was_lost_when_the_last_byte_had_come(
    tmp_path, monkeypatch, caplog
):
    caplog.set_level(logging.INFO)
    endpoint = "tcp:127.0.0.1:5760"
    async with connecting(endpoint, air := Absence(), tmp_path, monkeypatch):
        await air.beat(20.0)
        await asyncio.sleep(25.0)
        await air.beat(30.0)
    (_, _), (_, text) = lines(caplog, endpoint)
    assert 24.0 <= float(re.search(r"after (\d+) s", text).group(1)) <= 28.0


@virtual_time
async def test_another_reason_is_told_and_the_same_ones_by_turns_are_not(
    tmp_path, monkeypatch, caplog
):
    caplog.set_level(logging.INFO)
    endpoint = "tcp:127.0.0.1:5760"
    air = Absence(REFUSED, UNREACHABLE, TimeoutError(), end=600.0)
    async with connecting(endpoint, air, tmp_path, monkeypatch):
        await air.beat(660.0)
    said = lines(caplog, endpoint)
    assert [warning for warning, _ in said] == [True, True, True, False]
    for (_, text), reason in zip(said, ("refused", "unreachable", "timed out"), strict=False):
        assert reason in text


@virtual_time
async def test_who_comes_and_goes_at_once_has_not_come_back(tmp_path, monkeypatch, caplog):
    caplog.set_level(logging.INFO)
    endpoint = "tcp:127.0.0.1:5760"
    air = Absence()
    async with connecting(endpoint, air, tmp_path, monkeypatch):
        while asyncio.get_running_loop().time() < 600.0:
            await air.beat(2.0)
            air.transports[-1].lost("closed by the other side")
        assert len(lines(caplog, endpoint)) == 1
        await air.beat(60.0)
    assert [warning for warning, _ in lines(caplog, endpoint)] == [True, False]


@virtual_time
async def test_a_line_that_opens_and_stays_dumb_is_told_of_once(tmp_path, monkeypatch, caplog):
    caplog.set_level(logging.INFO)
    endpoint = "serial:/dev/ttyACM0:57600"
    async with connecting(endpoint, Absence(), tmp_path, monkeypatch):
        await asyncio.sleep(600.0)
    ((warning, text),) = lines(caplog, endpoint)
    assert warning
    assert "nothing received" in text


@virtual_time
async def test_heartbeats_that_come_and_go_are_told_of_once(tmp_path, monkeypatch, caplog):
    """A poor radio: the link is there, the autopilot is heard for some seconds now and then."""
    caplog.set_level(logging.INFO)
    air = Absence()
    async with connecting("udpin:127.0.0.1:14550", air, tmp_path, monkeypatch) as service:
        for _ in range(30):
            await air.beat(3.0)
            await asyncio.sleep(9.0)
            service.contact.tell_of_recovery(asyncio.get_running_loop().time())
        for _ in range(30):
            await air.beat(1.0)
            service.contact.tell_of_recovery(asyncio.get_running_loop().time())
    assert service.counters["autopilot_silent"] == 30
    said = [r.getMessage() for r in caplog.records if "heartbeat" in r.getMessage()]
    assert len(said) == 2
    assert "back after" in said[1]


# The rule itself.


def test_what_the_first_try_after_a_loss_meets_is_the_same_trouble():
    outage = Outage()
    assert outage.lost("closed", 0.0)
    assert not outage.failed("refused", 1.0)
    assert outage.failed("no route", 2.0)
    assert not outage.failed("refused", 3.0)


def test_it_is_over_when_it_has_worked_for_long_enough_and_begins_anew():
    outage = Outage()
    assert outage.over(0.0) is None
    assert outage.failed("refused", 0.0)
    outage.works(30.0)
    assert outage.over(30.0 + SETTLE_S - 0.1) is None
    over = outage.over(30.0 + SETTLE_S)
    assert (over.seconds, over.tries) == (30.0, 1)
    assert str(over) == "30 s and 1 try"
    assert outage.over(60.0) is None
    assert outage.failed("refused", 100.0)
