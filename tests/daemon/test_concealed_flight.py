"""What nobody told the daemon: it finds out, says so, and writes what is right or nothing."""

import asyncio

import numpy as np
import pytest
from click.testing import CliRunner

from onboard.cli.main import cli
from onboard.daemon.outlets.parameter_view import FINDINGS
from sitl.builtin.effects import TemperatureDrift
from tests.daemon.daemons import held_back, until
from tests.daemon.flights import TRUE_SIX, GroundStation, flying, six

pytestmark = pytest.mark.virtual_time
ANTENNA = (0.3, 0.2, -0.2)
FLIGHT_S = 160.0
SPEEDUP = 15.0
WARMING = TemperatureDrift(x=0.01, y=-0.008, z=0.01)
"""By as much as makes a ramp of 160 s look alike, but for how the warming slows down."""


@pytest.fixture
def only_physics(document):
    """A policy so wide that nothing but the diagnosis stands against a push."""
    return document


def antenna_known(service):
    known = service.snapshot().parameters
    return tuple(known.get(f"GPS1_POS_{axis}") for axis in "XYZ")


async def landed(autopilot):
    """Wait for the flight to end, and for the pace of real life after it."""
    await until(lambda: autopilot.flying)
    await until(lambda: not autopilot.flying)
    autopilot.parameters.load({"SIM_SPEEDUP": 1.0})


@pytest.mark.slow
async def test_an_antenna_that_nobody_told_of_is_found_and_said_and_spoils_nothing(
    only_physics, daemon, port
):
    async with (
        daemon(only_physics) as service,
        flying(port, flight_s=FLIGHT_S, antenna=ANTENNA, speedup=SPEEDUP) as (
            autopilot,
            _,
            station_port,
        ),
    ):
        station = GroundStation(station_port)
        await landed(autopilot)
        await until(lambda: service.snapshot().push.can_roll_back == (1,), limit=400.0)

        snapshot = service.snapshot()
        found = {effect["name"]: effect for effect in snapshot.diagnosis["effects"]}
        told = found["gps_lever_arm"]["parameters"]
        assert told == pytest.approx(
            {f"GPS1_POS_{axis}": x for axis, x in zip("XYZ", ANTENNA, strict=True)}, abs=0.08
        )
        finding = await asyncio.wait_for(station.read(191, "OBC_FINDING"), 60.0)
        assert finding == FINDINGS["gps_lever_arm"]
        planned = service.parts.journal.last_completed(1).plan
        assert six(autopilot) == pytest.approx(list(planned.wanted.values()), abs=1e-7)
        for change, truth in zip(planned.changes, TRUE_SIX, strict=True):
            assert abs(change.wanted - truth) < 4.0 * change.sigma
            assert abs(change.wanted - truth) < (0.01 if "SCAL" in change.name else 0.05)

        # The cure that it names is heard of at once.
        for name, value in zip(told, ANTENNA, strict=True):
            station.set(name, value)
        await until(lambda: antenna_known(service) == pytest.approx(ANTENNA))
        station.close()


@pytest.mark.slow
async def test_numbers_that_are_not_the_same_for_all_of_a_flight_are_not_written(
    only_physics, daemon, port
):
    async with (
        daemon(only_physics) as service,
        flying(port, flight_s=FLIGHT_S, effects=(WARMING,), speedup=SPEEDUP) as (autopilot, _, _),
    ):
        await until(lambda: autopilot.flying)
        before = six(autopilot)
        await landed(autopilot)
        await until(lambda: "physics_missing" in held_back(service), limit=400.0)
        assert "temperature_drift" in held_back(service)["physics_missing"]
        snapshot = service.snapshot()
        assert [line.kind for line in snapshot.journal] == ["found"]
        assert "temperature drift" in snapshot.journal[0].text
        notices = {notice.kind: notice.text for notice in snapshot.notices}
        assert "temperature drift" in notices["physics_missing"]
        shown = await asyncio.to_thread(
            CliRunner(env={"COLUMNS": "80"}).invoke, cli, ["status", "--url", service.server.url]
        )
        assert "offset follows the temperature" in " ".join(shown.output.split())
        assert max(len(line) for line in shown.output.splitlines()) <= 80
        assert np.array_equal(six(autopilot), before)
