"""Received messages whose fields are all numbers, as tuples: one step from the bytes to the object.

Nearly all that an autopilot sends in flight is of that kind, hundreds a second.  pymavlink's object
of a message costs twenty times as much as unpacking its payload: it copies header, payload, names
and checksum, which was right already.  These have its fields and what is asked of its header, by
the same names, and nothing else; they do not change.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from operator import itemgetter
from struct import Struct
from typing import Any, ClassVar, NamedTuple

from onboard.mavlink.dialect import mavlink


class PlainMessage(tuple[float, ...]):
    """Fields in the order of the wire, then system and component of the sender."""

    __slots__ = ()
    number: ClassVar[int]
    msgname: ClassVar[str]

    def get_msgId(self) -> int:
        """Number of the message."""
        return self.number

    def get_type(self) -> str:
        """Name of the message."""
        return self.msgname

    def get_srcSystem(self) -> int:
        """System id of the sender."""
        return int(self[-2])

    def get_srcComponent(self) -> int:
        """Component id of the sender."""
        return int(self[-1])

    def to_dict(self) -> dict[str, str | float]:
        """Name and fields, as pymavlink has them."""
        names = mavlink.mavlink_map[self.number].fieldnames
        return {"mavpackettype": self.msgname} | {name: getattr(self, name) for name in names}

    def __repr__(self) -> str:
        return str(self.to_dict())


class Layout(NamedTuple):
    """How the payload of one message is read: its numbers, bytes of them all, the class."""

    unpack: Callable[..., tuple[Any, ...]]
    size: int
    kind: type[PlainMessage]


@cache
def layout(number: int) -> Layout | None:
    """Of a message with this number; None where a field is text or an array, or there is none."""
    message = mavlink.mavlink_map.get(number)
    if message is None or any(message.array_lengths) or "char" in message.fieldtypes:
        return None
    names = message.ordered_fieldnames
    fields = {name: property(itemgetter(place)) for place, name in enumerate(names)}
    members = {"__slots__": (), "number": number, "msgname": message.msgname, **fields}
    unpacker: Struct = message.unpacker
    return Layout(
        unpacker.unpack_from, unpacker.size, type(message.msgname, (PlainMessage,), members)
    )


def read(form: Layout, payload: bytes, system: int, component: int) -> PlainMessage:
    """The message; zeros at the end of a payload may be left out, unknown fields may follow."""
    if len(payload) < form.size:
        payload = payload.ljust(form.size, b"\0")
    return tuple.__new__(form.kind, (*form.unpack(payload), system, component))
