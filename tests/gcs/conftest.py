"""A daemon, a vehicle and ground stations around one router, all on loopback."""

import contextlib

import pytest

from tests.daemon.daemons import calibration, convinced, hurried, running, until
from tests.daemon.standing_vehicle import Vehicle
from tests.gcs.router import Router


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    hurried(monkeypatch)


def waits(push):
    """For a person; or, where nobody is asked, for whatever else."""
    return push.approval_needed if push.approval_required else push.proposals


@pytest.fixture
def airfield(tmp_path):
    """``async with airfield({"parameters": ...}) as (service, vehicle, router)``.

    The daemon believes to have calibrated accelerometers 1 and 2, and waits for approval.
    """

    @contextlib.asynccontextmanager
    async def run(sections=None):
        async with Router() as router:
            document = {
                "link": {"endpoints": [f"udpout:127.0.0.1:{router.port}"]},
                "push": {"approval": True, "disarmed_s": 2.0},
                "state": {"directory": str(tmp_path / "state")},
                "http": {"enabled": False},
            }
            async with (
                running(document | (sections or {})) as service,
                Vehicle(router.port) as vehicle,
            ):
                convinced(service, calibration(1), calibration(2, offset=(0.1, 0.1, 0.1)))
                await until(lambda: waits(service.snapshot().push))
                yield service, vehicle, router

    return run
