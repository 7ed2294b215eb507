"""A daemon, a vehicle and ground stations around one router, all on loopback."""

import contextlib

import pytest

from onboard.daemon.pushing import pusher as pusher_module
from onboard.mavlink.parameters import ClientSettings
from onboard.push.course import TransactionSettings
from tests.daemon.daemons import calibration, convinced, running, until
from tests.daemon.standing_vehicle import Vehicle
from tests.gcs.router import Router


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    client = ClientSettings(first_timeout_s=0.2, longest_timeout_s=0.4)
    monkeypatch.setattr("onboard.daemon.process.limits.TICK_S", 0.05)
    monkeypatch.setattr("onboard.daemon.learning.limits.BATCH_S", 0.02)
    monkeypatch.setattr(pusher_module, "PATIENCE", TransactionSettings(client=client, settle_s=0.2))


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
                "push": {"approval": True, "disarmed_s": 0.0},
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
