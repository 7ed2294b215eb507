"""On either simulator: another board gets nothing, and what somebody else has set stays.

Runs with ``--sitl=builtin`` (the default) or ``--sitl=ardupilot``.
"""

import numpy as np
import pytest

from onboard.core.maths.accelerometer import parameter_names
from onboard.push.entries import Planned
from sitl import harness
from tests.daemon import daemons

pytestmark = pytest.mark.virtual_time
SCALE, OFFSET = (1.02, 0.98, 1.015), (0.2, -0.15, 0.25)
SIX = parameter_names(1).six
FLIGHT_S = {"builtin": 110.0, "ardupilot": 150.0}
LONG_S = 3600.0


@pytest.fixture(autouse=True)
def known_thread(monkeypatch):
    daemons.known(monkeypatch)


@pytest.fixture
def kind(request):
    chosen = request.config.getoption("--sitl")
    reason = harness.unavailable(chosen, "copter")
    if reason:
        pytest.skip(reason)
    return chosen


def document(sitl, tmp_path, *, disarmed_s):
    return {
        "link": {"endpoints": [sitl.endpoint]},
        "push": {"disarmed_s": disarmed_s},
        "state": {"directory": str(tmp_path / "state")},
        "http": {"enabled": False},
    }


async def six(sitl):
    return np.array([await sitl.parameter(name) for name in SIX])


def held_back(service):
    return {p.imu: p.held_back for p in service.snapshot().push.proposals}


@pytest.mark.slow
async def test_what_one_board_has_flown_another_does_not_get(kind, tmp_path):
    speedup = 15 if kind == "builtin" else 5
    async with harness.simulator(kind, "copter", speedup=speedup, imus=2) as sitl:
        await sitl.set_truth(1, scale=SCALE, offset=OFFSET)
        async with daemons.running(document(sitl, tmp_path, disarmed_s=LONG_S)) as service:
            await daemons.until(lambda: service.snapshot().parameters.keys() >= set(SIX))
            await sitl.fly(FLIGHT_S[kind])
            await sitl.land()
            await sitl.set_parameter("SIM_SPEEDUP", 1.0)  # nothing to see any more, much to compute
            await daemons.until(
                lambda: held_back(service).get(1, {}).keys() == {"disarmed_too_short"}, limit=600.0
            )
            flights = service.handover.learned.flight
            assert set(flights.imus) == {1, 2}, "judged together"
            before = await six(sitl)

        async with (
            harness.simulator(kind, "copter", speedup=1.0, imus=2, board="0d0e0f") as other,
            daemons.running(document(other, tmp_path, disarmed_s=2.0)) as service,
        ):
            await daemons.until(lambda: service.handover.identified)
            await daemons.until(lambda: service.snapshot().link.armed is False)
            await daemons.until(lambda: service.snapshot().uptime_s > 30.0)
            assert held_back(service) == {}
            assert not any(isinstance(entry, Planned) for _, entry in service.parts.journal.entries)

        # Back on the first board, which has not flown since: it waits, until a person approves.
        async with daemons.running(document(sitl, tmp_path, disarmed_s=2.0)) as service:
            await daemons.until(lambda: "unconfirmed" in held_back(service).get(1, {}))
            await daemons.until(lambda: service.snapshot().uptime_s > 20.0)
            assert np.array_equal(await six(sitl), before)
            await service.approve((1,))
            await daemons.until(lambda: 1 in service.snapshot().push.can_roll_back)


@pytest.mark.slow
async def test_what_a_station_sets_in_the_middle_of_a_push_stays(kind, tmp_path):
    speedup = 15 if kind == "builtin" else 5
    theirs = 0.625
    async with harness.simulator(kind, "copter", speedup=speedup) as sitl:
        await sitl.set_truth(1, scale=SCALE, offset=OFFSET)
        async with daemons.running(document(sitl, tmp_path, disarmed_s=2.0)) as service:
            await daemons.until(lambda: service.snapshot().parameters.keys() >= set(SIX))
            await sitl.fly(FLIGHT_S[kind])
            await sitl.land()
            await sitl.set_parameter("SIM_SPEEDUP", 1.0)
            states = {"writing", "settling", "verifying"}
            await daemons.until(
                lambda: (
                    service.snapshot().push.active_imu == 1
                    and service.snapshot().push.state in states
                ),
                limit=600.0,
            )
            await sitl.set_parameter("INS_ACCOFFS_Y", theirs)
            await daemons.until(lambda: "unconfirmed" in held_back(service).get(1, {}))
            service.parts.proposals.standing(
                1
            ).not_before = 0.0  # the pause after a failure is over
            end = service.snapshot().uptime_s + 40.0
            await daemons.until(lambda: service.snapshot().uptime_s > end)
            assert await sitl.parameter("INS_ACCOFFS_Y") == theirs
            assert "INS_ACCOFFS_Y" in held_back(service)[1]["unconfirmed"]
