"""A daemon in the test's own loop, and calibrations to make it believe."""

import asyncio
import math
import os
from contextlib import asynccontextmanager

import pytest

from onboard.core.estimate.result import Calibration, Coverage, Status
from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.learning.flight import Judged, JudgedFlight
from onboard.daemon.learning.worker import Worker
from onboard.daemon.process.service import Service
from onboard.daemon.pushing import pusher as pusher_module
from onboard.daemon.setup.configuration import from_mapping
from onboard.mavlink.parameter_messages import to_float32
from onboard.mavlink.parameters import ClientSettings
from onboard.push.course import TransactionSettings
from onboard.push.diagnosed import Diagnosed
from onboard.push.entries import Support
from sitl.virtual_time import VirtualTimeLoop

EPOCH = 1_800_000_000.0
"""Unix time at which virtual time begins, s."""
POLL_S = 0.01
"""Between two looks at what is waited for."""
SIX = parameter_names(1).six


class KnownWorker(Worker):
    """The learner's thread, of whose work a loop in virtual time is told."""

    async def call(self, function, *args, **kwargs):
        with self._loop.thread():
            return await super().call(function, *args, **kwargs)

    async def close(self):
        with self._loop.thread():
            await super().close()


def employed(name):
    """A worker that suits the loop."""
    virtual = isinstance(asyncio.get_running_loop(), VirtualTimeLoop)
    return KnownWorker(name) if virtual else Worker(name)


def known(monkeypatch):
    """Have every learner in virtual time tell the loop when its thread is at work."""
    monkeypatch.setattr("onboard.daemon.learning.handover.Worker", employed)


def hurried(monkeypatch, *, virtual=False):
    """What real vehicles and real disks need seconds for takes none here.

    In ``virtual`` time seconds cost nothing, and rounds are what is paid for: they are as far
    apart as the patience with a parameter allows.
    """
    known(monkeypatch)
    monkeypatch.setattr(os, "fsync", lambda _: None)  # no power is cut, but tasks are
    client = ClientSettings(first_timeout_s=0.2, longest_timeout_s=0.4)
    tick_s, batch_s, poll_s = (0.12, 0.05, 0.05) if virtual else (0.05, 0.02, POLL_S)
    monkeypatch.setattr("tests.daemon.daemons.POLL_S", poll_s)
    monkeypatch.setattr("onboard.daemon.process.limits.TICK_S", tick_s)
    monkeypatch.setattr("onboard.daemon.learning.limits.BATCH_S", batch_s)
    monkeypatch.setattr(pusher_module, "PATIENCE", TransactionSettings(client=client, settle_s=0.2))


def made(document):
    """A service with the clock of the loop it will run in."""
    loop = asyncio.get_running_loop()
    clocks = {}
    if isinstance(loop, VirtualTimeLoop):
        clocks = {"clock": loop.time, "wall_clock": lambda: EPOCH + loop.time()}
    return Service(from_mapping(document, source="test"), **clocks)


@asynccontextmanager
async def running(document):
    service = made(document)
    task = asyncio.create_task(service.run(), name="service")
    try:
        await until(lambda: service.ready.is_set() or task.done())
        yield service
    finally:
        service.stop()
        await task


async def until(condition, *, limit=300.0):
    """Wait until it holds; the limit only ends a hopeless test."""
    async with asyncio.timeout(limit):
        while not condition():
            await asyncio.sleep(POLL_S)


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
        "predictive_gain": 3000.0,
        "velocity_rms_before": 1.0,
        "velocity_rms_after": math.nan,
        "coverage": Coverage(90.0, (90.0,) * 6, "x scale", ""),
    }
    return Calibration(**(fields | changes))


def convinced(service, *calibrations, missing="", modelled=False, effects=(), unused=()):
    """Have the daemon believe that it has learned these from the flight that has just ended."""
    learner = service.handover._learner
    learner._solve = lambda: None
    learner._answers = {c.imu: c for c in calibrations}
    verdict = "explained" if effects else "clean"
    document = {
        "schema": "onboard.explain/1",
        "verdict": verdict,
        "effects": [{"name": name} for name in effects],
        "unused": list(unused),
    }
    judged = {
        c.imu: Judged(
            device_id=2_700_000.0 + c.imu,
            in_force=tuple(to_float32(x) for x in (*c.in_force_scale, *c.in_force_offset)),
            diagnosed=Diagnosed(
                imu=c.imu,
                verdict=verdict,
                effects=tuple(effects),
                calibration=c,
                missing=missing,
                modelled=modelled,
                document=document,
            ),
        )
        for c in calibrations
    }
    support = Support("flight", service.handover._wall_clock(), learner._examiner.board, 200.0)

    def believe():
        learner._flight = JudgedFlight(support, judged)
        learner._answers = {c.imu: c for c in calibrations}

    believe()
    if learner._identity is not None:
        return
    identify = learner.identify

    def first(*args):
        learner.identify = identify
        identify(*args)
        believe()

    learner.identify = first


WANTED = calibration()
"""A confident answer of the first accelerometer."""


def in_force(vehicle):
    """The six of the first accelerometer, as the vehicle holds them."""
    return tuple(vehicle.parameters[name] for name in SIX)


def pushed(vehicle):
    """Whether it holds the confident answer."""
    return in_force(vehicle) == pytest.approx(WANTED.scale + WANTED.offset, rel=1e-6)


def held_back(service):
    """Why the first proposal is not written, by objection."""
    proposals = service.snapshot().push.proposals
    return proposals[0].held_back if proposals else {}


async def push_done(service, vehicle):
    """Have the confident answer written; what was in force before it."""
    before = in_force(vehicle)
    convinced(service, WANTED)
    await until(lambda: service.snapshot().push.can_roll_back == (1,))
    assert pushed(vehicle)
    return before


def notices(service, kind):
    return [notice.text for notice in service.snapshot().notices if notice.kind == kind]


async def ticks(service, number):
    """Let the service judge so many times."""
    count = 0
    judged = service.parts.pusher.consider

    def counted(*args, **kwargs):
        nonlocal count
        count += 1
        return judged(*args, **kwargs)

    service.parts.pusher.consider = counted
    await until(lambda: count >= number)
    service.parts.pusher.consider = judged
