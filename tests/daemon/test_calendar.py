"""What time it is on a companion whose clock nobody has set."""

import asyncio
import re
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.cli.panel import clock as shown_clock
from onboard.daemon.process.calendar import Calendar
from onboard.daemon.process.service import Service
from onboard.daemon.setup.configuration import from_mapping
from onboard.daemon.view.snapshot import DATED_FROM
from onboard.push.journal import Journal
from tests.daemon.daemons import EPOCH, WANTED, convinced, pushed, until
from tests.daemon.standing_vehicle import Vehicle

DAY = 86400.0


class Clocks:
    """A computer's two clocks and the vehicle's; ``rate`` is how much faster that one runs."""

    def __init__(self, wall, gps=EPOCH, rate=1.0):
        self.t, self.wall, self.gps, self.rate = 100.0, wall, gps, rate
        self.calendar = Calendar(lambda: self.wall + self.t - 100.0, lambda: self.t)

    def listen(self, seconds, *, gps=True, late=lambda _: 0.0):
        for i in range(int(seconds)):
            self.t += 1.0
            told = self.gps + self.rate * (self.t - 100.0) - late(i)
            unix = int(1e6 * told) if gps else 0
            self.calendar.feed(mavlink.MAVLink_system_time_message(unix, int(1e3 * self.t)))
        return self.calendar()


@pytest.mark.parametrize("wall", [0.0, EPOCH - 400 * DAY, EPOCH - 3600.0])
def test_a_clock_that_stood_still_is_put_right(wall):
    clocks = Clocks(wall)
    assert clocks.calendar() == wall
    told = clocks.listen(60, late=lambda i: 2.0 * (i % 3 == 1))
    assert told == pytest.approx(EPOCH + 60.0, abs=2.0)
    clocks.t += 3600.0  # the autopilot has gone
    assert clocks.calendar() == pytest.approx(EPOCH + 3660.0, abs=2.0)


@pytest.mark.parametrize(
    "clocks",
    [
        Clocks(EPOCH, gps=EPOCH - 1024 * 7 * DAY),  # a receiver that has lost 1024 weeks
        Clocks(EPOCH, gps=EPOCH + 1024 * 7 * DAY),  # or counted them twice
        Clocks(EPOCH, gps=EPOCH - 5.0),
        Clocks(EPOCH, gps=EPOCH + 5.0),
        Clocks(EPOCH, rate=10.0),  # a simulator in a hurry
        Clocks(EPOCH, rate=1.2),
    ],
)
def test_one_that_runs_is_believed(clocks):
    assert clocks.listen(300) == EPOCH + 300.0


def test_without_gps_it_is_what_it_is():
    assert Clocks(0.0).listen(60, gps=False) == 60.0


def test_a_clock_that_is_set_meanwhile_is_ours_again():
    clocks = Clocks(0.0)
    clocks.listen(60)
    clocks.wall = EPOCH + 0.25
    assert clocks.listen(10) == EPOCH + 70.25


class TimedVehicle(Vehicle):
    """It has the time from GPS."""

    async def _stream(self):
        begun = self.boot_ms
        send = self.send

        def with_time(message):
            send(message)
            if message.get_type() == "HEARTBEAT":
                unix = EPOCH + 1e-3 * (self.boot_ms - begun)
                send(mavlink.MAVLink_system_time_message(int(1e6 * unix), int(self.boot_ms)))

        self.send = with_time
        await super()._stream()


@pytest.mark.virtual_time
async def test_a_push_in_1970_is_dated_by_gps(document, port, tmp_path):
    loop = asyncio.get_running_loop()
    service = Service(from_mapping(document, source="test"), clock=loop.time, wall_clock=loop.time)
    task = asyncio.create_task(service.run())
    async with TimedVehicle(port) as vehicle:
        await until(lambda: service.snapshot().time > EPOCH)
        convinced(service, WANTED)
        await until(lambda: pushed(vehicle) and not service.parts.pusher.busy)
        assert service.snapshot().push.written[0].at > EPOCH
        service.stop()
        await task
    with Journal(tmp_path / "state" / "journal.jsonl") as journal:
        assert all(at > EPOCH for at, _ in journal.entries)


def test_a_date_that_nobody_knows_is_not_shown_as_1970():
    assert shown_clock(60.0) == "--:--:--"
    assert re.fullmatch(r"\d\d:\d\d:\d\d", shown_clock(EPOCH))
    words = Path(__file__).parents[2] / "onboard" / "web" / "static" / "words.js"
    (number,) = re.findall(r"DATED_FROM = (\d+);", words.read_text(encoding="utf-8"))
    assert float(number) == DATED_FROM
