"""A snapshot of a service that has heard nothing yet, for tests that only need some snapshot."""

from onboard.daemon.view.snapshot import LinkView, PushView, Snapshot, TrustView


def blank_snapshot(*, uptime_s: float = 0.0) -> Snapshot:
    return Snapshot(
        version="0",
        time=0.0,
        uptime_s=uptime_s,
        phase="connecting",
        mode="active",
        mode_reason="",
        link=LinkView(
            state="connecting",
            endpoints=(),
            signed=False,
            system_id=None,
            component_id=None,
            autopilot=None,
            vehicle=None,
            armed=None,
            landed=None,
            messages={},
            counters={},
        ),
        trust=TrustView(
            phase="waiting",
            open=False,
            reason=None,
            reasons=(),
            windows=0,
            trusted_s=0.0,
            rejected={},
        ),
        imus=(),
        push=PushView(
            policy="landed",
            approval_required=False,
            approval_needed=False,
            state="idle",
            active_imu=None,
            proposals=(),
            last_outcome=None,
            can_roll_back=(),
        ),
        parameters={},
        journal=(),
        notices=(),
        counters={},
    )
