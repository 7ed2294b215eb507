"""Nothing that the demonstration waits for fails to come: the stages against the real service."""

from __future__ import annotations

import io
import json

import pytest
from rich.console import Console

from onboard.cli import demo
from onboard.cli.demo_show import Show
from onboard.cli.main import run
from sitl import harness
from tests.daemon.daemons import running

HOPELESS_S = 120.0
"""Wall-clock seconds; only ends a test that waits in vain."""


class TakesOffError(Exception):
    """The first flight would begin now."""


async def test_a_vehicle_that_stands_gives_all_that_the_first_flight_waits_for(
    tmp_path, monkeypatch
):
    """No accelerometer has a segment of flight before it flies: waiting for one would never end."""

    async def flight(_, station, *__):
        assert not station.armed
        raise TakesOffError

    monkeypatch.setattr(demo, "_flight", flight)
    monkeypatch.setattr(demo, "PATIENCE_S", HOPELESS_S)
    options = demo.Options(duration=120.0, port=0, speedup=10.0, seed=1, stays=False)
    said = io.StringIO()
    async with harness.simulator("builtin", demo.VEHICLE, speedup=10.0, imus=2) as sitl:
        document = {
            "link": {"endpoints": [sitl.endpoint]},
            "state": {"directory": str(tmp_path / "state")},
            "http": {"enabled": False},
        }
        port = int(sitl.endpoint.rpartition(":")[2])
        async with running(document) as service:
            with Show(Console(file=said, width=200)) as show, pytest.raises(TakesOffError):
                await demo._fly_twice(service, port, options, show)
            assert service.snapshot().trust.open
            assert not service.snapshot().push.can_roll_back
    assert said.getvalue().splitlines()[-1].endswith("first flight: 120 s of random manoeuvres")


@pytest.mark.slow
def test_every_stage_comes_and_the_end_is_right(tmp_path, capsys):
    """The whole of it: its status is 0 only if all was estimated rightly, written and proved."""
    result = tmp_path / "result.json"
    assert run(["demo", "--once", "--json", str(result)]) == 0, capsys.readouterr()
    said = capsys.readouterr().out
    stages = ("first flight", "landed", "written and read back", "second flight", "done")
    assert [said.count(stage) >= 1 for stage in stages] == [True] * len(stages)
    places = [said.index(stage) for stage in stages]
    assert places == sorted(places)
    assert json.loads(result.read_text())
