"""What a publisher is fed with in tests: snapshots, notices, and somebody who obeys."""

import asyncio

import msgspec

from onboard.daemon.setup.configuration import MqttSettings
from onboard.daemon.view.notices import Notices
from onboard.daemon.view.snapshot import (
    CalibrationView,
    CoverageView,
    ImuView,
    JournalLine,
    LinkView,
    Number,
    PushView,
    Snapshot,
    StateView,
    TrustView,
)
from onboard.errors import RefusedError


def imu_view(number=1, scale=1.02):
    return ImuView(
        imu=number,
        status="calibrated",
        state=StateView(
            name="up_to_date", title="up to date", sentence="all known", severity="good"
        ),
        calibration=CalibrationView(
            scale=(scale, 0.99, None),
            offset=(0.2, -0.1, 0.15),
            scale_sigma=(0.001, 0.001, None),
            offset_sigma=(0.01, 0.01, 0.01),
            parameters={"INS_ACCSCAL_X": scale},
            observable=(True, True, False, True, True, True),
            known=("yes", "yes", "no", "yes", "yes", "yes"),
            worth=None,
            note="z scale and z offset cannot be told apart",
        ),
        in_force_scale=(1.0, 1.0, 1.0),
        in_force_offset=(0.0, 0.0, 0.0),
        parameters_known=True,
        timing={"gps_delay_s": Number(value=0.12, sigma=0.002)},
        trusted_s=100.0,
        rejected={"no_fix": 3},
        whitened_rms_before=4.0,
        whitened_rms_after=1.0,
        held_out_before=4.0,
        held_out_after=None,
        velocity_rms_before_m_s=1.0,
        velocity_rms_after_m_s=None,
        coverage=CoverageView(
            percent=80.0, per_parameter={"x scale": 80.0}, weakest="z scale", advice="turn"
        ),
        certificate={"window_s": 100.0, "uniform_bound_m_s": None},
        dead_reckoning=None,
        temperature=None,
    )


def journal_line(number):
    return JournalLine(
        at=1e9 + number, kind="writing", transaction="t1", imu=1, text=f"write {number}"
    )


IMU_1 = imu_view()


def snapshot(*, time=1e9, imus=(IMU_1,), journal=(), diagnosis=None, system_id=1):
    return Snapshot(
        version="0",
        time=time,
        uptime_s=1.0,
        phase="running",
        mode="active",
        mode_reason="",
        link=LinkView(
            state="present",
            endpoints=(),
            signed=False,
            system_id=system_id,
            component_id=1,
            autopilot="ardupilot",
            vehicle="copter",
            armed=False,
            landed=True,
            messages={},
            counters={},
        ),
        trust=TrustView(
            phase="open",
            open=True,
            reason=None,
            reasons=(),
            windows=1,
            trusted_s=100.0,
            rejected={},
        ),
        imus=tuple(imus),
        push=PushView(
            policy="landed",
            approval_required=True,
            approval_needed=False,
            state="idle",
            active_imu=None,
            proposals=(),
            last_outcome=None,
            can_roll_back=(),
        ),
        parameters={"INS_ACCSCAL_X": 1.0},
        journal=tuple(journal),
        notices=(),
        counters={},
        diagnosis=diagnosis,
    )


class Obedient:
    """Carries out everything but ``reset``, and remembers."""

    def __init__(self):
        self.asked = []

    def snapshot(self):
        return snapshot()

    async def approve(self, imus, *, despite_diagnosis=False):
        self.asked.append(("approve", imus))
        return "approved"

    async def reject(self, imus):
        self.asked.append(("reject", imus))
        return "rejected"

    async def rollback(self, imus):
        self.asked.append(("rollback", imus))
        return "rolling back"

    async def reset(self, imus):
        raise RefusedError("not while armed")


def settings(**changes):
    return msgspec.convert(
        {"enabled": True, "state_interval_s": 0.1} | changes, MqttSettings, strict=True
    )


def noticeboard():
    kept = []
    notices = Notices(lambda: 0.0)
    notices.listen(kept.append)
    return notices, kept


async def kinds(publisher, kind):
    """Wait for a notice of this kind, and give all of them."""
    async with asyncio.timeout(60.0):
        while not (found := [n for n in publisher.kept if n.kind == kind]):
            await asyncio.sleep(0.01)
    return found
