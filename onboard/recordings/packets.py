"""MAVLink packets whose checksum is known to be right, unpacked without checking it again."""

from __future__ import annotations

from collections.abc import Callable

from onboard.mavlink.dialect import Message, mavlink
from onboard.mavlink.framing import header


class Packet:
    """What a decoder asks of a message: its kind, its sender, its fields by name."""

    def __init__(self, kind: int, system: int, component: int, fields: dict[str, float]) -> None:
        """Take the sender and the fields."""
        self.__dict__.update(fields)
        self._kind, self._system, self._component = kind, system, component

    def get_msgId(self) -> int:
        """Number of the message, by the dialect's own name for it."""
        return self._kind

    def get_srcSystem(self) -> int:
        """Sender."""
        return self._system

    def get_srcComponent(self) -> int:
        """Sender's component."""
        return self._component


class Unpacker:
    """Unpacks packets; those with arrays or strings by way of the dialect."""

    def __init__(self) -> None:
        """Learn which messages are plain numbers."""
        self._whole: Callable[[bytearray], Message] = mavlink.MAVLink(None).decode
        self._plain = {
            kind: (message.unpacker, tuple(message.ordered_fieldnames))
            for kind, message in mavlink.mavlink_map.items()
            if not any(message.array_lengths)
        }

    def __call__(self, packet: bytes) -> Message:
        """The message.

        Raises:
            MAVError: a payload that cannot be unpacked.
        """
        kind, system, component, _, _, start = header(packet, 0)
        plain = self._plain.get(kind)
        if plain is None:
            return self._whole(bytearray(packet))
        unpacker, names = plain
        # The sender leaves out zeros at the end, and may know more fields than we do.
        payload = packet[start : start + packet[1]][: unpacker.size].ljust(unpacker.size, b"\0")
        fields = dict(zip(names, unpacker.unpack(payload), strict=True))
        return Packet(kind, system, component, fields)
