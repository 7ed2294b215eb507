"""The GPS trust window as the snapshot shows it."""

from __future__ import annotations

from onboard.core.gps.trust import TrustWindow
from onboard.daemon.view.snapshot import (
    TrustView,
)

NO_TRUST = TrustView(
    phase="waiting", open=False, reason=None, reasons=(), windows=0, trusted_s=0.0, rejected={}
)


def trust_view(window: TrustWindow, *, windows: int) -> TrustView:
    """The trust window; ``windows``: how often it has opened."""
    return TrustView(
        phase=window.phase.value,
        open=window.is_open,
        reason=window.reason.value if window.reason is not None else None,
        reasons=tuple(reason.value for reason in window.reasons),
        windows=windows,
        trusted_s=window.trusted_s,
        rejected=window.rejected,
    )
