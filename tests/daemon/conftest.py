"""A daemon in the test's own loop, and calibrations to give it."""

import asyncio
import math
import socket
from contextlib import asynccontextmanager

import pytest

from onboard.core.result import Calibration, Coverage, Status
from onboard.daemon import learning
from onboard.daemon import pusher as pusher_module
from onboard.daemon import service as service_module
from onboard.daemon.configuration import from_mapping
from onboard.daemon.service import Service
from onboard.mavlink.parameters import ClientSettings
from onboard.push.transaction import TransactionSettings


@pytest.fixture
def port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def document(tmp_path, port):
    """A configuration for this test alone; change it before starting a daemon."""
    return {
        "link": {"endpoints": [f"udpin:127.0.0.1:{port}"], "heartbeat_limit_s": 30.0},
        "push": {"disarmed_s": 0.0},
        "state": {"directory": str(tmp_path / "state")},
        "http": {"port": 0},
    }


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    """What real vehicles need seconds for takes none on loopback."""
    client = ClientSettings(first_timeout_s=0.2, longest_timeout_s=0.4)
    monkeypatch.setattr(service_module, "TICK_S", 0.05)
    monkeypatch.setattr(learning, "BATCH_S", 0.02)
    monkeypatch.setattr(pusher_module, "PATIENCE", TransactionSettings(client=client, settle_s=0.2))


@asynccontextmanager
async def running(document):
    service = Service(from_mapping(document, source="test"))
    task = asyncio.create_task(service.run(), name="service")
    try:
        await until(lambda: service.ready.is_set() or task.done())
        yield service
    finally:
        service.stop()
        await task


@pytest.fixture
def daemon():
    """``async with daemon(document) as service``."""
    return running


async def until(condition, *, limit=60.0):
    """Wait until it holds; the limit only ends a hopeless test."""
    async with asyncio.timeout(limit):
        while not condition():
            await asyncio.sleep(0.01)


def calibration(imu=1, *, scale=(1.02, 0.99, 1.01), offset=(0.2, -0.1, 0.15), **changes):
    """A confident answer for an accelerometer whose parameters are still (1, about 0)."""
    sigma_scale, sigma_offset = (0.001,) * 3, (0.01,) * 3
    sigmas = sigma_scale + sigma_offset
    fields = {
        "imu": imu,
        "status": Status.CALIBRATED,
        "scale": scale,
        "offset": offset,
        "scale_sigma": sigma_scale,
        "offset_sigma": sigma_offset,
        "covariance": tuple(
            tuple(sigmas[i] ** 2 if i == j else 0.0 for j in range(6)) for i in range(6)
        ),
        "observable": (True,) * 6,
        "note": "",
        "in_force_scale": (1.0, 1.0, 1.0),
        "in_force_offset": (0.05, 0.06, 0.07),
        "parameters_known": True,
        "timing": {},
        "trusted_s": 200.0,
        "rejected": {},
        "whitened_rms_before": 4.0,
        "whitened_rms_after": 1.0,
        "held_out_before": 4.0,
        "held_out_after": 1.0,
        "velocity_rms_before": 1.0,
        "velocity_rms_after": math.nan,
        "coverage": Coverage(90.0, (90.0,) * 6, "x scale", ""),
    }
    return Calibration(**(fields | changes))


def convinced(service, *calibrations):
    """Have the daemon believe that it has learned these."""
    learner = service.learning._learner
    learner._solve = lambda: None
    learner._answers = {c.imu: c for c in calibrations}
