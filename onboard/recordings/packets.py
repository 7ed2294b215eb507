"""MAVLink packets whose checksums are known to be right, unpacked without checking them again."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from onboard.mavlink.dialect import Message, mavlink
from onboard.recordings.bulk import filled
from onboard.recordings.packet_columns import Headers, Integers, Octets, headers, records


class Packet:
    """What a decoder asks of a message: its kind, its sender, its fields by name."""

    __slots__ = ("_component", "_system")
    KIND: ClassVar[int]
    _component: int
    _system: int

    def get_msgId(self) -> int:
        """Number of the message, by the dialect's own name for it."""
        return self.KIND

    def get_srcSystem(self) -> int:
        """Sender."""
        return self._system

    def get_srcComponent(self) -> int:
        """Sender's component."""
        return self._component


class Unpacker:
    """Unpacks packets of a file; those with arrays or strings by way of the dialect."""

    def __init__(self) -> None:
        self._one = mavlink.MAVLink(None)
        self._kinds: dict[int, type[Packet]] = {}

    def __call__(self, data: Octets, at: Integers) -> list[Message | None]:
        """The messages of packets at places (n,); None where a payload cannot be unpacked."""
        head = headers(data, at)
        messages: list[Message | None] = [None] * len(at)
        for kind in np.unique(head.kind).tolist():
            rows = np.flatnonzero(head.kind == kind)
            its = head.of(rows)
            if any(mavlink.mavlink_map[kind].array_lengths):
                ends = (at[rows] + its.length).tolist()
                found = [
                    self._whole(bytearray(data[a:b].tobytes()))
                    for a, b in zip(at[rows].tolist(), ends, strict=True)
                ]
            else:
                found = self._plain(kind, data, its)
            for row, message in zip(rows.tolist(), found, strict=True):
                messages[row] = message
        return messages

    def _whole(self, packet: bytearray) -> Message | None:
        """One packet as the dialect unpacks it."""
        try:
            return self._one.decode(packet)
        except mavlink.MAVError:
            return None

    def _plain(self, kind: int, data: Octets, head: Headers) -> list[Any]:
        """Packets of one kind that has nothing but numbers."""
        made = self._kinds.get(kind)
        if made is None:
            message = mavlink.mavlink_map[kind]
            names = tuple(message.ordered_fieldnames)
            made = type(message.msgname, (Packet,), {"__slots__": names, "KIND": kind})
            self._kinds[kind] = made
        fields = records(kind, data, head)
        columns = {name: fields[name].tolist() for name in fields.dtype.names or ()}
        columns["_system"] = head.system.tolist()
        columns["_component"] = head.component.tolist()
        return filled(made, columns)
