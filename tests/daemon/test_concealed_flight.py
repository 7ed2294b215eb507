"""What nobody told the daemon: it flies, finds out, and does not write what would be wrong."""

import asyncio

import numpy as np
import pytest
from click.testing import CliRunner
from daemons import until
from flights import TRUE_SIX, GroundStation, flying, six

from onboard.cli.main import cli
from onboard.daemon.parameter_view import FINDINGS

ANTENNA = (0.3, 0.2, -0.2)
FLIGHT_S = 240.0
SPEEDUP = 15.0
WRONG = 3.0
"""Claimed sigmas: more is a number that should not have been claimed."""


@pytest.fixture
def only_physics(document):
    """A policy so wide that nothing but the diagnosis stands against a push."""
    document["push"] |= {"scale_sigma_max": 0.05, "offset_sigma_max": 0.5}
    return document


def held_back(service):
    proposals = service.snapshot().push.proposals
    return proposals[0].held_back if proposals else {}


def antenna_known(service):
    known = service.snapshot().parameters
    return tuple(known.get(f"GPS1_POS_{axis}") for axis in "XYZ")


def errors_in_sigmas(proposal):
    """How far what would be written is off, in what is claimed for it."""
    return [
        abs(change.after - truth) / change.sigma
        for change, truth in zip(proposal.changes, TRUE_SIX, strict=True)
        if not change.kept
    ]


@pytest.mark.slow
async def test_an_antenna_that_nobody_told_of_is_found_said_cured_and_only_then_written(
    only_physics, daemon, port
):
    async with (
        daemon(only_physics) as service,
        flying(port, flight_s=FLIGHT_S, antenna=ANTENNA, speedup=SPEEDUP) as (
            autopilot,
            mission,
            station_port,
        ),
    ):
        station = GroundStation(station_port)
        await until(lambda: autopilot.flying)
        before = six(autopilot)
        await until(lambda: not autopilot.flying)
        autopilot.parameters.load({"SIM_SPEEDUP": 1.0})
        await until(lambda: held_back(service).keys() == {"physics_missing"}, limit=400.0)

        # The plain model is wrong by more than it claims: writing it would be a mistake.
        plain = service.learning.learned.calibrations[1]
        sigmas = np.array(plain.scale_sigma + plain.offset_sigma)
        assert np.max(np.abs(np.array(plain.scale + plain.offset) - TRUE_SIX) / sigmas) > WRONG
        # What a person may have written all the same is the fuller model's, and right.
        (proposal,) = service.snapshot().push.proposals
        assert max(errors_in_sigmas(proposal)) < WRONG

        snapshot = service.snapshot()
        assert "gps_lever_arm" in held_back(service)["physics_missing"]
        found = {effect["name"]: effect for effect in snapshot.diagnosis["effects"]}
        told = found["gps_lever_arm"]["parameters"]
        assert told == pytest.approx(
            {f"GPS1_POS_{axis}": x for axis, x in zip("XYZ", ANTENNA, strict=True)}, abs=0.08
        )
        assert [line.kind for line in snapshot.journal] == ["found"]
        assert "gps lever arm" in snapshot.journal[0].text
        finding = await asyncio.wait_for(station.read(191, "OBC_FINDING"), 60.0)
        assert finding == FINDINGS["gps_lever_arm"]
        notices = {notice.kind: notice.text for notice in snapshot.notices}
        assert "gps lever arm" in notices["physics_missing"]
        shown = await asyncio.to_thread(
            CliRunner(env={"COLUMNS": "80"}).invoke, cli, ["status", "--url", service.server.url]
        )
        assert "GPS antenna" in shown.output
        assert max(len(line) for line in shown.output.splitlines()) <= 80
        assert np.array_equal(six(autopilot), before)

        # The cure that it names: measure, set these, fly again.
        for name, value in zip(told, ANTENNA, strict=True):
            station.set(name, value)
        await until(lambda: antenna_known(service) == pytest.approx(ANTENNA))
        autopilot.parameters.load({"SIM_SPEEDUP": SPEEDUP})
        mission.flights = 2
        await until(lambda: autopilot.flying)
        assert np.array_equal(six(autopilot), before)
        await until(lambda: not autopilot.flying)
        autopilot.parameters.load({"SIM_SPEEDUP": 1.0})
        await until(lambda: service.snapshot().push.can_roll_back == (1,), limit=400.0)
        planned = service._journal.last_completed(1).plan
        assert six(autopilot) == pytest.approx(list(planned.wanted.values()), abs=1e-7)
        for change, truth in zip(planned.changes, TRUE_SIX, strict=True):
            assert abs(change.wanted - truth) < 4.0 * change.sigma
            assert abs(change.wanted - truth) < (0.01 if "SCAL" in change.name else 0.05)
        station.close()
