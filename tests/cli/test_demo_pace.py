"""The pace of the demonstration's flights: as fast as is wanted, if everything is heard."""

import asyncio

import pytest

from onboard.cli import demo_pace
from onboard.cli.demo_pace import FASTER, SLOWEST, Pace, keep


def test_losses_halve_it_and_it_comes_back():
    pace = Pace(12.0)
    assert pace.seen(1000, 5) == 12.0
    assert pace.seen(1000, 100) == 6.0
    assert pace.seen(1000, 0) == pytest.approx(6.0 * FASTER)
    for _ in range(30):
        pace.seen(1000, 0)
    assert pace.now == 12.0
    for _ in range(30):
        pace.seen(0, 100)
    assert pace.now == SLOWEST


def test_silence_is_no_loss():
    assert Pace(12.0).seen(0, 0) == 12.0


@pytest.mark.virtual_time
async def test_it_settles_where_the_line_is_not_full():
    """A reader that takes 1,500 messages a second of a vehicle that says 300 a simulated second."""
    loop, takes, says = asyncio.get_running_loop(), 1500.0, 300.0

    class Line:
        pace, at, came, lost = 1.0, loop.time(), 0.0, 0.0

        def set_pace(self, speedup):
            self.received()
            self.pace = speedup

        def received(self):
            now = loop.time()
            sent = says * self.pace * (now - self.at)
            heard = min(sent, takes * (now - self.at))
            self.came, self.lost, self.at = self.came + heard, self.lost + sent - heard, now
            return int(self.came), int(self.lost)

    line = Line()
    flying = asyncio.create_task(keep(line, line, 20.0))
    await asyncio.sleep(10.0)
    _, before = line.received()
    came, lost = 0, 0
    came_before = line.came
    for _ in range(120):
        await asyncio.sleep(demo_pace.LOOK_S)
        assert line.pace <= 1.2 * takes / says
        came, lost = line.received()
    flying.cancel()
    assert (lost - before) < 0.05 * (came - came_before)
    assert (came - came_before) > 0.6 * takes * 120 * demo_pace.LOOK_S
