"""What passes between the parameter protocol and the wire: frozen events in, frozen actions out.

:func:`parameter_event` reads a pymavlink message (of a ``v20`` dialect) into an event,
:func:`parameter_message` writes an action as one; both only touch attributes of what they
are given, so that the protocol itself needs neither pymavlink nor a socket.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeAlias

NO_INDEX = 65535
"""``param_index`` of a PARAM_VALUE that was not asked for by index.

ArduPilot sends it with the broadcast "this value is now saved" *and* with its answer to a
read by name, so it does not tell the two apart.
"""

MAV_PARAM_TYPE_REAL32 = 9
AUTOPILOT_COMPONENT = 1
_INTEGERS = {1: "<B", 2: "<b", 3: "<H", 4: "<h", 5: "<I", 6: "<i"}
"""MAV_PARAM_TYPE of the whole numbers that fit into the field, and how their bytes read."""


class ParameterErrorCode(Enum):
    """MAV_PARAM_ERROR; codes of newer dialects become ``OTHER``."""

    DOES_NOT_EXIST = 1
    VALUE_OUT_OF_RANGE = 2
    PERMISSION_DENIED = 3
    COMPONENT_NOT_FOUND = 4
    READ_ONLY = 5
    OTHER = -1


@dataclass(frozen=True, slots=True)
class ValueReceived:
    """PARAM_VALUE: the autopilot's word on a parameter, whoever caused it."""

    name: str
    value: float
    index: int = NO_INDEX
    count: int = 0


@dataclass(frozen=True, slots=True)
class ErrorReceived:
    """PARAM_ERROR, addressed to us."""

    name: str
    code: ParameterErrorCode
    index: int = NO_INDEX


@dataclass(frozen=True, slots=True)
class TextReceived:
    """STATUSTEXT: ArduPilot says here, and only here, why a write was denied."""

    text: str


ParameterEvent: TypeAlias = ValueReceived | ErrorReceived | TextReceived


@dataclass(frozen=True, slots=True)
class SendParamRead:
    """Send PARAM_REQUEST_READ by name."""

    name: str


@dataclass(frozen=True, slots=True)
class SendParamSet:
    """Send PARAM_SET; ``value`` is a float32 already."""

    name: str
    value: float


SendAction: TypeAlias = SendParamRead | SendParamSet


def to_float32(value: float) -> float:
    """The float32 nearest to ``value``: what PARAM_SET can carry.

    Raises:
        ValueError: not finite, or beyond float32 (ArduPilot answers neither at all).
    """
    if not math.isfinite(value):
        raise ValueError(f"a parameter cannot be {value}")
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        raise ValueError(f"{value} does not fit a float32") from None


def parameter_event(
    message: Any,  # noqa: ANN401 - pymavlink's messages have no types
    *,
    system: int,
    component: int = AUTOPILOT_COMPONENT,
    own_system: int | None = None,
    own_component: int | None = None,
) -> ParameterEvent | None:
    """Event that a pymavlink message means to the parameter protocol, None if nothing.

    What is no finite number is no value: it is left unheard, and whoever asked for it asks again.

    Args:
        message: any decoded message; ``param_id`` and ``text`` are str on receive.
        system: system id of the autopilot; messages of other systems are not its word.
        component: component id of the autopilot.
        own_system: our system id; errors addressed to others are not for us.
        own_component: our component id.
    """
    if message.get_srcSystem() != system or message.get_srcComponent() != component:
        return None
    kind = message.get_type()
    if kind == "PARAM_VALUE":
        if not math.isfinite(message.param_value):
            return None
        return ValueReceived(
            name=message.param_id,
            value=float(message.param_value),
            index=int(message.param_index),
            count=int(message.param_count),
        )
    if kind == "PARAM_ERROR":
        if own_system is not None and message.target_system not in (0, own_system):
            return None
        if own_component is not None and message.target_component not in (0, own_component):
            return None
        try:
            code = ParameterErrorCode(int(message.error))
        except ValueError:
            code = ParameterErrorCode.OTHER
        return ErrorReceived(message.param_id, code, int(message.param_index) & 0xFFFF)
    if kind == "STATUSTEXT":
        return TextReceived(message.text)
    return None


def parameter_message(
    action: SendAction,
    mav: Any,  # noqa: ANN401 - pymavlink's codec has no types
    *,
    system: int,
    component: int = AUTOPILOT_COMPONENT,
) -> Any:  # noqa: ANN401 - pymavlink's messages have no types
    """The pymavlink message of an action; ``mav`` is the dialect's ``MAVLink`` object."""
    match action:
        case SendParamRead(name):
            return mav.param_request_read_encode(system, component, name.encode(), -1)
        case SendParamSet(name, value):
            return mav.param_set_encode(
                system, component, name.encode(), value, MAV_PARAM_TYPE_REAL32
            )


def number_meant(value: float, kind: int) -> float:
    """The number that PARAM_SET or PARAM_VALUE carries by its float; NaN or infinite if it is none.

    Senders differ in how they put a whole number into the float field: as its value (ArduPilot), or
    as its bytes (PX4, some stations).  Bytes of a small whole number read as a float below 1e-38,
    which nobody means (0 is 0 both ways); those of a negative one read as NaN.

    Args:
        value: as the field reads.
        kind: MAV_PARAM_TYPE that was told.
    """
    layout = _INTEGERS.get(kind)
    if layout is None or (math.isfinite(value) and (value == 0.0 or abs(value) >= 1.0)):
        return value
    return float(struct.unpack_from(layout, struct.pack("<f", value))[0])
