"""The main job on either simulator: fly, learn, land, write, read back, and a reboot keeps it.

Runs with ``--sitl=builtin`` (the default) or ``--sitl=ardupilot``.
"""

import numpy as np
import pytest

from onboard.core.maths.accelerometer import parameter_names
from sitl import harness
from tests.daemon.daemons import known, running, until

pytestmark = pytest.mark.virtual_time
SCALE, OFFSET = (1.02, 0.98, 1.015), (0.2, -0.15, 0.25)
TRUTH = np.array(SCALE + OFFSET)
SIX = parameter_names(1).six
FLIGHT_S = 200.0
"""Its largest sigma is then a third of the bound that the numbers are held to."""


@pytest.fixture(autouse=True)
def known_thread(monkeypatch):
    known(monkeypatch)


@pytest.fixture(params=["copter", "plane"])
def vehicle(request):
    return request.param


@pytest.fixture
def kind(request, vehicle):
    chosen = request.config.getoption("--sitl")
    reason = harness.unavailable(chosen, vehicle)
    if reason:
        pytest.skip(reason)
    return chosen


@pytest.fixture
def document(tmp_path):
    """A flight of minutes need not show everything as well as the default policy asks for."""
    return {
        "state": {"directory": str(tmp_path / "state")},
        "http": {"enabled": False},
    }


def first(service):
    return next((p for p in service.snapshot().push.proposals if p.imu == 1), None)


def told(service, kind):
    return [n.text for n in service.snapshot().notices if n.kind == kind and "IMU 1" in n.text]


@pytest.mark.slow
async def test_what_was_pushed_is_right_and_survives_a_reboot(kind, vehicle, document):
    speedup = 15 if kind == "builtin" else 6
    async with harness.simulator(kind, vehicle, speedup=speedup) as sitl:
        await sitl.set_truth(1, scale=SCALE, offset=OFFSET)
        document["link"] = {"endpoints": [sitl.endpoint]}
        async with running(document) as service:
            await until(lambda: service.snapshot().parameters.keys() >= set(SIX))
            before = [await sitl.parameter(name) for name in SIX]
            await sitl.fly(FLIGHT_S)
            assert [await sitl.parameter(name) for name in SIX] == before, "not in flight"
            await sitl.land()
            await sitl.set_parameter("SIM_SPEEDUP", 1.0)  # nothing to see any more, much to compute
            await until(lambda: 1 in service.snapshot().push.can_roll_back)

            planned = service.parts.journal.last_completed(1).plan
            now = np.array([await sitl.parameter(name) for name in SIX])
            assert now == pytest.approx(list(planned.wanted.values()), abs=1e-6)
            for change, truth in zip(planned.changes, TRUTH, strict=True):
                if not change.kept:
                    assert abs(change.wanted - truth) < 4.0 * change.sigma
                    bound = 0.01 if "SCAL" in change.name else 0.06
                    assert abs(change.wanted - truth) < bound
            assert sum(not change.kept for change in planned.changes) >= 5

            await until(lambda: service.snapshot().push.state == "idle")
            await sitl.reboot()
            await until(lambda: service.snapshot().counters.get("autopilot_rebooted"))
            await until(lambda: told(service, "push_stored"))
            assert not told(service, "push_not_stored")
            after = np.array([await sitl.parameter(name) for name in SIX])
            assert np.array_equal(after, now)
