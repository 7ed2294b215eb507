"""Of which axes an autopilot tells the attitude: the body's, or those of a view of it.

ArduPilot's quadplanes tell two attitudes as if they were one (``show_vtol_view`` in quadplane.cpp):
in modes that hover, and while they leave them, that of a view which is the body turned by
``Q_TRIM_PITCH``, and of tailsitters by another 90 deg, so that nose up is level (AP_AHRS_View.cpp);
else the body's.  ``ATT`` and ATTITUDE are of that kind.  EKF3's own record (``XKF1``) and
ATTITUDE_QUATERNION are of the body in all modes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

TAILSITTER_FRAME: Final = 10.0
"""Q_FRAME_CLASS; firmware that has no Q_TAILSIT_ENABLE knows them by it."""
NO_PITCH_TRIM: Final = 0x100
"""FLIGHT_OPTIONS: ATTITUDE is sent without PTCH_TRIM_DEG taken off."""
ASKED: Final = frozenset(
    (
        "Q_ENABLE",
        "Q_TAILSIT_ENABLE",
        "Q_FRAME_CLASS",
        "Q_TRIM_PITCH",
        "PTCH_TRIM_DEG",
        "FLIGHT_OPTIONS",
    )
)
"""Parameters that say it."""


def tells_views(values: Mapping[str, float], *, over_mavlink: bool) -> bool:
    """Whether the attitude that is told is of other axes in hover than in forward flight.

    Args:
        values: parameters by name.
        over_mavlink: whether ATTITUDE is meant, not the log's ATT: of that ``PTCH_TRIM_DEG`` is
            taken off, but not in modes that hover.
    """
    if not values.get("Q_ENABLE", 0.0) > 0.0:
        return False
    old = float(values.get("Q_FRAME_CLASS") == TAILSITTER_FRAME)
    if values.get("Q_TAILSIT_ENABLE", old) > 0.0 or values.get("Q_TRIM_PITCH", 0.0) != 0.0:
        return True
    kept = int(values.get("FLIGHT_OPTIONS", 0.0)) & NO_PITCH_TRIM
    return over_mavlink and not kept and values.get("PTCH_TRIM_DEG", 0.0) != 0.0
