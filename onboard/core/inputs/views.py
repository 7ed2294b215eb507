"""Of which axes an autopilot tells the attitude: the body's, or those of a view of it.

ArduPilot's quadplanes tell two attitudes as if they were one (``show_vtol_view`` in quadplane.cpp):
in modes that hover, and while they leave them, that of a view which is the body turned by
``Q_TRIM_PITCH``, and of tailsitters by another 90 deg, so that nose up is level (AP_AHRS_View.cpp);
else the body's.  ``ATT`` and ATTITUDE are of that kind.  EKF3's own record (``XKF1``) and
ATTITUDE_QUATERNION are of the body in all modes.
"""

from __future__ import annotations

import math
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


class Views:
    """What parameters say of it, as they come over MAVLink."""

    def __init__(self) -> None:
        """Nobody has said anything."""
        self._values: dict[str, float] = {}

    @property
    def told(self) -> bool:
        """Whether ATTITUDE is of other axes in hover than in forward flight."""
        return tells_views(self._values, over_mavlink=True)

    def take(self, name: str, value: float) -> bool:
        """Take a parameter; whether it is one of those that say it, and a number."""
        says = name in ASKED and math.isfinite(value)
        if says:
            self._values[name] = value
        return says

    def forget(self) -> None:
        """It is another vehicle."""
        self._values.clear()


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
    if not over_mavlink or values.get("PTCH_TRIM_DEG", 0.0) == 0.0:
        return False
    return not int(values.get("FLIGHT_OPTIONS", 0.0)) & NO_PITCH_TRIM
