"""MAVLink as a sans-IO codec: bytes to frames and messages, messages to bytes.

Where a frame begins and whether it is right is said by :mod:`onboard.mavlink.framing`; messages of
numbers are read by :mod:`onboard.mavlink.plain`, others by pymavlink, which also packs them all.
Its own parser is not used because after a false start it throws the whole supposed frame away, up
to 280 bytes and several good messages with it, where this one resumes one byte later; and because
messages that nobody wants need never become objects.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from onboard.mavlink import framing, limits, plain
from onboard.mavlink.dialect import COMPONENT, Message, mavlink
from onboard.mavlink.signing import Signing


class Frame(NamedTuple):
    """One verified packet.  ``message`` is None where nobody wants it or the dialect lacks it."""

    raw: bytes
    message_id: int
    system: int
    component: int
    sequence: int
    message: Message | None


@dataclass(slots=True)
class SourceStatistics:
    """Packets of one system and component, by sequence number."""

    received: int = 0
    lost: int = 0
    late: int = 0
    duplicated: int = 0
    last: int = -1

    def count(self, sequence: int) -> None:
        """Take note of the next packet's sequence number (0 ... 255)."""
        self.received += 1
        if self.last < 0:
            self.last = sequence
            return
        gap = (sequence - self.last - 1) & 0xFF
        if gap == 0xFF:
            self.duplicated += 1
        elif gap >= 0x100 - limits.REORDERING:
            self.late += 1
            self.lost = max(0, self.lost - 1)
        else:
            self.lost += gap
            self.last = sequence


@dataclass(slots=True)
class CodecStatistics:
    """What one codec has seen.  ``bad_bytes`` belonged to no valid frame.

    ``unsigned_beats``: HEARTBEATs of autopilots among those of ``bad_signatures``.
    """

    bytes_received: int = 0
    frames: int = 0
    bad_bytes: int = 0
    bad_frames: int = 0
    bad_signatures: int = 0
    unsigned_beats: int = 0
    unknown: int = 0
    sent: int = 0
    sources: dict[tuple[int, int], SourceStatistics] = field(default_factory=dict)


class Codec:
    """Framing, verification and packing for one connection.

    Args:
        system: our system id; may be changed later (it is to be the vehicle's).
        component: our component id.
        wanted: message numbers worth building objects for; None for all.
        signing: verify what comes and sign what goes; None for plain MAVLink 2.
        link_id: this connection's id within signatures.
    """

    def __init__(
        self,
        *,
        system: int = 1,
        component: int = COMPONENT,
        wanted: frozenset[int] | None = None,
        signing: Signing | None = None,
        link_id: int = 0,
    ) -> None:
        self.wanted = wanted
        self.statistics = CodecStatistics()
        self._buffer = bytearray()
        self._signing = signing
        self._decoder = mavlink.MAVLink(None)
        self._encoder = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        if signing is not None:
            self._encoder.signing.secret_key = signing.key
            self._encoder.signing.link_id = link_id
            self._encoder.signing.sign_outgoing = True

    @property
    def system(self) -> int:
        """Our system id."""
        return int(self._encoder.srcSystem)

    @system.setter
    def system(self, system: int) -> None:
        self._encoder.srcSystem = system

    def encode(self, message: Message) -> bytes:
        """Pack a message as MAVLink 2 under our ids and the next sequence number."""
        encoder = self._encoder
        if self._signing is not None:
            encoder.signing.timestamp = self._signing.next_timestamp()
        frame = bytes(message.pack(encoder))
        encoder.seq = (encoder.seq + 1) & 0xFF
        self.statistics.sent += 1
        return frame

    def feed(self, data: bytes) -> list[Frame]:
        """Take bytes as they come; return the frames that they complete.  Never raises on data."""
        statistics = self.statistics
        statistics.bytes_received += len(data)
        buffer = self._buffer
        buffer += data
        end = len(buffer)
        frames: list[Frame] = []
        following = framing.NextValid(buffer)
        position = 0
        while end - position >= framing.SHORTEST:
            length = framing.packet_length(buffer, position)
            if position + length > end:
                break
            frame = self._open(buffer, position, length, following) if length else None
            if frame is None:
                start = framing.next_start(buffer, position + 1)
                statistics.bad_bytes += start - position
                position = start
                continue
            position += length
            if frame.message_id >= 0:
                self._count(frame)
                frames.append(frame)
        del buffer[:position]
        return frames

    def _open(
        self, buffer: bytearray, start: int, length: int, following: framing.NextValid
    ) -> Frame | None:
        """Verify one supposed frame.  None: not a frame; message id -1: refused."""
        raw = bytes(buffer[start : start + length])
        statistics = self.statistics
        message_id, system, component, sequence, signed, payload = framing.header(raw, 0)
        known = message_id in mavlink.mavlink_map
        if known and not framing.is_valid(raw, 0, message_id):
            statistics.bad_frames += 1
            return None
        if not known and not _is_credible(buffer, start, length, following):
            return None
        key = (message_id, system, component, sequence)
        if not known:
            statistics.unknown += 1
            return Frame(raw, *key, None)
        signing = self._signing
        if signing is not None and not (
            signing.verify(raw) if signed else signing.accepts_unsigned(message_id)
        ):
            statistics.bad_signatures += 1
            statistics.unsigned_beats += _is_autopilots_beat(message_id, raw, payload)
            return Frame(raw, -1, system, component, sequence, None)
        message = None
        if self.wanted is None or message_id in self.wanted:
            form = plain.layout(message_id)
            if form is None:
                message = self._decode(raw)
            else:
                body = raw[payload : payload + raw[1]]
                message = plain.read(form, body, system, component)
        return Frame(raw, *key, message)

    def _decode(self, raw: bytes) -> Message | None:
        """A message with text or arrays, by pymavlink."""
        try:
            return self._decoder.decode(bytearray(raw))
        except mavlink.MAVError:
            # The checksum held, so the sender meant it: a payload that our dialect's
            # definition cannot hold.  Pass it on as a frame without a message.
            self.statistics.unknown += 1
            return None

    def _count(self, frame: Frame) -> None:
        statistics = self.statistics
        statistics.frames += 1
        key = (frame.system, frame.component)
        source = statistics.sources.get(key)
        if source is None:
            if len(statistics.sources) >= limits.SOURCES_MAX:
                return
            source = statistics.sources[key] = SourceStatistics()
        source.count(frame.sequence)


def _is_autopilots_beat(message_id: int, raw: bytes, payload: int) -> bool:
    """Whether a frame is the HEARTBEAT of an autopilot, as far as its bytes say."""
    if message_id != mavlink.MAVLINK_MSG_ID_HEARTBEAT:
        return False
    kind, firmware = raw[payload : payload + raw[1]].ljust(6, b"\0")[4:6]
    return kind != int(mavlink.MAV_TYPE_GCS) and firmware != int(mavlink.MAV_AUTOPILOT_INVALID)


def _is_credible(buffer: bytearray, start: int, length: int, following: framing.NextValid) -> bool:
    """Whether a message that the dialect lacks, hence of unknown checksum, really is a frame.

    It is taken for one when another frame or the end of what has come follows it, and no
    frame that can be verified starts inside it.
    """
    end = start + length
    if end < len(buffer) and buffer[end] not in framing.MAGICS:
        return False
    return following.after(start + 1) >= end
