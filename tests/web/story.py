"""A flight as snapshots: the estimates converge from the prior to the truth, second by second."""

import math

import msgspec

from onboard.core.estimate.result import SIX_NAMES
from onboard.daemon.view.snapshot import (
    AccountView,
    CalibrationView,
    ChangeView,
    CoverageView,
    EndpointView,
    ImuView,
    JournalLine,
    LinkView,
    MessageRate,
    Notice,
    Number,
    ProposalView,
    PushView,
    Snapshot,
    StateView,
    TrustView,
    WrittenValue,
    WrittenView,
)
from onboard.daemon.view.state import next_step

T0 = 1_780_000_000.0
SCALE = ((1.0243, 0.9871, 1.0112), (0.9912, 1.0178, 0.9954))
OFFSET = ((0.2214, -0.1482, 0.3071), (-0.0921, 0.1143, -0.2215))
APPROVAL = StateView(
    name="approval",
    title="waits for your approval",
    sentence="all six numbers are known; a person has to approve it",
    severity="warning",
    next="look at the values, then approve or reject them",
)
IN_FORCE_OFFSET = (0.0412, 0.0231, -0.0312)


def story(second, *, imus=2):
    """What the service would show after so many seconds of trusted flight."""
    done = second >= 150
    views = tuple(_imu(number, second, done=done) for number in range(1, imus + 1))
    return Snapshot(
        version="0.1.0",
        time=T0 + second,
        uptime_s=12.0 + second,
        phase="running",
        mode="active",
        mode_reason="",
        link=_link(second),
        trust=TrustView(
            phase="open",
            open=True,
            reason=None,
            reasons=(),
            windows=1,
            trusted_s=float(second),
            rejected={"gps_glitch": 3},
        ),
        imus=views,
        push=PushView(
            policy="landed",
            approval_required=True,
            approval_needed=done,
            state="idle",
            active_imu=None,
            proposals=tuple(_proposal(view) for view in views) if done else (),
            last_outcome=None,
            can_roll_back=(),
        ),
        next_step=next_step(views),
        parameters={},
        journal=(
            JournalLine(
                at=T0 - 900.0, kind="closed", transaction="a", imu=1, text="completed: 6 values"
            ),
        ),
        notices=(
            Notice(at=T0 - 12.0, kind="autopilot_found", text="ArduPilot copter, system 1"),
            Notice(at=T0, kind="window_opened", text="GPS is trusted: the window is open"),
        ),
        counters={"loop_stalls": 3, "loop_stall_worst_ms": 120},
    )


def _imu(number, second, *, done):
    shrink = math.exp(-second / 25.0)
    wobble = math.sin(second / 9.0) * shrink
    scale = tuple(1.0 + (s - 1.0) * (1.0 - shrink) + 0.01 * wobble for s in SCALE[number - 1])
    offset = tuple(
        o * (1.0 - shrink) + h * shrink + 0.08 * wobble
        for o, h in zip(OFFSET[number - 1], IN_FORCE_OFFSET, strict=True)
    )
    covered = tuple(min(100.0, 110.0 * (1 - math.exp(-second / (30.0 + 12 * i)))) for i in range(6))
    weakest = min(range(6), key=lambda i: covered[i])
    advice = "" if done else "fly banked turns both ways, so that the load factor varies"
    return ImuView(
        imu=number,
        status="calibrated" if done else "collecting",
        state=APPROVAL
        if done
        else StateView(
            name="collecting",
            title="learning",
            sentence=f"least is known of the {SIX_NAMES[weakest]}",
            severity="info",
            next=advice,
        ),
        calibration=CalibrationView(
            scale=scale,
            offset=offset,
            scale_sigma=tuple(0.0008 + 0.024 * shrink for _ in range(3)),
            offset_sigma=tuple(0.006 + 0.4 * shrink for _ in range(3)),
            parameters={},
            observable=tuple(c > 30.0 for c in covered),
            known=tuple("yes" if c > 30.0 else "no" for c in covered),
            worth=None,
            note="" if done else "z scale and z offset are seen only as their sum so far",
        ),
        in_force_scale=(1.0, 1.0, 1.0),
        in_force_offset=IN_FORCE_OFFSET,
        parameters_known=True,
        timing={"gps_delay_s": Number(value=0.081, sigma=0.002)},
        trusted_s=float(second),
        rejected={},
        whitened_rms_before=4.1,
        whitened_rms_after=1.0 + 2.0 * shrink,
        held_out_before=4.2,
        held_out_after=1.1 + 2.2 * shrink,
        velocity_rms_before_m_s=0.61,
        velocity_rms_after_m_s=0.05 + 0.3 * shrink,
        coverage=CoverageView(
            percent=min(covered),
            per_parameter=dict(zip(SIX_NAMES, covered, strict=True)),
            weakest=SIX_NAMES[weakest],
            advice=advice,
        ),
        certificate={
            "window_s": float(second),
            "residual_l2": 0.4,
            "acceleration_bound_m_s2": 1.1,
            "uniform_bound_m_s": 0.91,
            "observed_max_m_s": 0.31,
        },
        dead_reckoning={
            "horizon_s": 60.0,
            "drift_before_m_s": 12.1,
            "drift_after_m_s": 0.42,
            "windows": 3,
        },
        temperature=None,
    )


def _proposal(view):
    names = ("INS_ACC" if view.imu == 1 else f"INS_ACC{view.imu}",)
    prefix = names[0]
    changes = []
    for quantity, before, after, sigma in (
        ("SCAL", view.in_force_scale, view.calibration.scale, view.calibration.scale_sigma),
        ("OFFS", view.in_force_offset, view.calibration.offset, view.calibration.offset_sigma),
    ):
        changes += [
            ChangeView(
                name=f"{prefix}{quantity}_{axis}",
                before=before[i],
                after=after[i],
                sigma=sigma[i],
                kept=quantity == "SCAL" and axis == "Z" and view.imu == 2,
            )
            for i, axis in enumerate("XYZ")
        ]
    return ProposalView(
        imu=view.imu,
        changes=tuple(changes),
        held_back={"approval": "a person has to approve"},
        approved=False,
        rejected=False,
        approvable=True,
    )


def _link(second):
    asked = {
        "RAW_IMU": 50.0,
        "SCALED_IMU2": 50.0,
        "ATTITUDE": 50.0,
        "GPS_RAW_INT": 10.0,
        "EKF_STATUS_REPORT": 2.0,
    }
    rates = {
        name: MessageRate(
            count=int(second * hz),
            rate_hz=hz if name != "SCALED_IMU2" else 24.8,
            wanted_hz=hz,
            granted_hz=hz,
            stream="granted",
        )
        for name, hz in asked.items()
    }
    rates["HEARTBEAT"] = MessageRate(count=second, rate_hz=1.0)
    return LinkView(
        state="present",
        endpoints=(EndpointView(endpoint="udpin:127.0.0.1:14550", state="open", reason=""),),
        signed=False,
        system_id=1,
        component_id=1,
        autopilot="ardupilot",
        vehicle="copter",
        armed=True,
        landed=False,
        messages=rates,
        counters={"frames": second * 170, "lost": second // 5, "bad_frames": 0, "reboots": 0},
    )


def holding(held_back, *, approvable=False):
    """The push at the end of the story, held back for these reasons."""
    push = story(160).push
    proposals = tuple(
        msgspec.structs.replace(p, held_back=held_back, approvable=approvable)
        for p in push.proposals
    )
    return msgspec.structs.replace(push, approval_needed=False, proposals=proposals)


def wrote(push):
    """Accelerometer 1 was written, and flown since."""
    values = (WrittenValue(name="INS_ACCSCAL_X", before=1.001, written=1.024, read_back=1.024),)
    written = WrittenView(
        imu=1,
        at=T0,
        values=values,
        in_force=True,
        held_out_before=4.2,
        held_out_after=1.1,
        velocity_rms_before_m_s=0.61,
        velocity_rms_after_m_s=0.051,
        verdict="kept",
        verdict_sentence="the residual has not grown",
        next_held_out=1.05,
        next_velocity_rms_m_s=0.055,
        account=AccountView(
            wrong="The x scale was off by 2.3 %.",
            written="6 values, each read back from the autopilot.",
            improved="After 10 s without GPS the velocity was off by 0.61 m/s.",
            next="Nothing: the next flight confirms it (the residual has not grown).",
        ),
    )
    return msgspec.structs.replace(push, can_roll_back=(1,), written=(written,))


DIAGNOSIS = {
    "schema": "onboard.explain/1",
    "verdict": "partly_explained",
    "headline": "The flight shows errors beyond the six numbers, and some were identified.",
    "severity": "warning",
    "recording": {"imu": 1},
    "mismatch": {
        "held_out_velocity_rms_before_m_s": 0.65,
        "held_out_velocity_rms_after_m_s": 0.055,
    },
    "effects": [
        {
            "name": "gps_latency",
            "unknowns": {"delay": {"value": 0.21, "sigma": 0.004, "unit": "s"}},
            "share_of_mismatch": 0.83,
            "parameters": {"GPS1_DELAY_MS": 210},
            "cure": "",
        }
    ],
    "ambiguous": [
        {"names": ["cross_axis", "mount_tilt"], "tell_apart": "fly banked turns both ways"}
    ],
    "not_testable": [{"name": "temperature_drift", "why": "no temperature in the recording"}],
}
