"""The one place that names the MAVLink dialect.

The v20 module is imported by name, so that no environment variable decides what we speak.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeAlias

from pymavlink.dialects.v20 import ardupilotmega

mavlink = ardupilotmega
"""The dialect module; everybody takes it from here."""

Message: TypeAlias = Any
"""A message object of the dialect (pymavlink's classes carry no usable types)."""

MESSAGE_IDS: dict[str, int] = {cls.msgname: number for number, cls in mavlink.mavlink_map.items()}
"""Message number by name, for every message of the dialect."""

COMPONENT = mavlink.MAV_COMP_ID_ONBOARD_COMPUTER
"""The component that this daemon is (191)."""


def message_ids(names: Iterable[str]) -> frozenset[int]:
    """Numbers of the named messages.

    Raises:
        ValueError: the dialect has no message of such a name.
    """
    try:
        return frozenset(MESSAGE_IDS[name] for name in names)
    except KeyError as error:
        raise ValueError(f"no MAVLink message is called {error.args[0]}") from None
