"""Snapshots of a service in whatever state a test wants."""

from onboard.daemon.view.snapshot import (
    CalibrationView,
    ChangeView,
    CoverageView,
    ImuView,
    LinkView,
    Number,
    ProposalView,
    PushView,
    Snapshot,
    StateView,
    TrustView,
)


def state(name):
    return StateView(name=name, title=name.replace("_", " "), sentence="so it is", severity="info")


def accelerometer(number, *, status="calibrated", stands=None):
    """One that is ``stands``; where that is not said, as its status."""
    return ImuView(
        imu=number,
        status=status,
        state=state(stands or status),
        calibration=CalibrationView(
            scale=(1.021234, 0.98, 1.01),
            offset=(0.21234, -0.1, 0.15),
            scale_sigma=(0.001, 0.002, 0.003),
            offset_sigma=(0.01, 0.02, 0.03),
            parameters={},
            observable=(True,) * 6,
            known=("yes",) * 6,
            worth=None,
            note="",
        ),
        in_force_scale=(1.0, 1.0, 1.0),
        in_force_offset=(0.0, 0.0, 0.0),
        parameters_known=True,
        timing={
            "gps_delay_s": Number(value=0.1212, sigma=0.002),
            "gps_smoothing_window_s": Number(value=0.2, sigma=0.01),
            "imu_delay_s": Number(value=None, sigma=None),
        },
        trusted_s=100.0,
        rejected={},
        whitened_rms_before=4.0,
        whitened_rms_after=1.0,
        held_out_before=4.0,
        held_out_after=1.0,
        velocity_rms_before_m_s=1.0,
        velocity_rms_after_m_s=0.1,
        coverage=CoverageView(
            percent=83.9, per_parameter={"x scale": 83.9}, weakest="x scale", advice="turn"
        ),
        certificate=None,
        dead_reckoning=None,
        temperature=None,
    )


def proposal(*held_back, imu=1):
    return ProposalView(
        imu=imu,
        changes=(ChangeView(name="INS_ACCSCAL_X", before=1.0, after=1.02, sigma=0.001),),
        held_back=dict.fromkeys(held_back, "because"),
        approved=False,
        rejected=False,
        approvable="approval" in held_back,
    )


def seen(
    *,
    phase="running",
    system_id=1,
    link_state="present",
    trusted=False,
    reason=None,
    imus=(),
    proposals=(),
    push_state="idle",
    diagnosis=None,
):
    return Snapshot(
        version="0",
        time=0.0,
        uptime_s=0.0,
        phase=phase,
        mode="active",
        mode_reason="",
        link=LinkView(
            state=link_state,
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
            phase="open" if trusted else "suspended",
            open=trusted,
            reason=reason,
            reasons=(reason,) if reason else (),
            windows=1,
            trusted_s=100.0,
            rejected={},
        ),
        imus=tuple(imus),
        push=PushView(
            policy="landed",
            approval_required=True,
            approval_needed=any(p.held_back.keys() == {"approval"} for p in proposals),
            state=push_state,
            active_imu=None,
            proposals=tuple(proposals),
            last_outcome=None,
            can_roll_back=(),
        ),
        parameters={},
        journal=(),
        notices=(),
        counters={},
        diagnosis=diagnosis,
    )
