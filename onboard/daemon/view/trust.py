"""The GPS trust window as the snapshot shows it."""

from __future__ import annotations

from onboard.core.gps.trust import Phase, TrustWindow
from onboard.daemon.view.snapshot import (
    TrustView,
)

NO_TRUST = TrustView(
    phase="waiting", open=False, reason=None, reasons=(), windows=0, trusted_s=0.0, rejected={}
)


FILTER_UNKNOWN = "ekf_unknown"
"""Why a window that is open is not shown as open: the autopilot's filter has yet to be heard."""


def trust_view(window: TrustWindow, *, told: bool, windows: int) -> TrustView:
    """The trust window.

    Args:
        window: the estimator's.
        told: whether it has been told as open.
        windows: how often it was.
    """
    if window.is_open and not told:
        return TrustView(
            phase=Phase.WAITING.value,
            open=False,
            reason=FILTER_UNKNOWN,
            reasons=(FILTER_UNKNOWN,),
            windows=windows,
            trusted_s=window.trusted_s,
            rejected=window.rejected,
        )
    return TrustView(
        phase=window.phase.value,
        open=window.is_open,
        reason=window.reason.value if window.reason is not None else None,
        reasons=tuple(reason.value for reason in window.reasons),
        windows=windows,
        trusted_s=window.trusted_s,
        rejected=window.rejected,
    )
