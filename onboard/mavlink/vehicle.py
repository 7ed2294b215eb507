"""What kind of vehicle a HEARTBEAT speaks for."""

from __future__ import annotations

_COPTERS = frozenset({2, 3, 4, 13, 14, 15, 29, 35})
_PLANES = frozenset({1, 19, 20, 21, 22, 23, 24, 25, 28})
_OTHERS = {10: "rover", 11: "boat", 12: "submarine", 7: "airship"}


def kind_of_vehicle(mav_type: int) -> str:
    """copter, plane (VTOL planes, too), rover, boat, submarine, airship; empty for any other."""
    if mav_type in _COPTERS:
        return "copter"
    if mav_type in _PLANES:
        return "plane"
    return _OTHERS.get(mav_type, "")
