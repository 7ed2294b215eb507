"""MAVLink 2 message signing: the shared key, time stamps that never repeat, verification.

Rules of the MAVLink signing specification: a signature is the first 48 bits of
``SHA-256(key + frame up to the signature)``; time stamps count 10 us since 1 January 2015
and must grow within each stream (link id, system, component); a new stream may be at most
one minute behind.

Three things go beyond the specification:

* **Restarts.**  What was accepted and what was sent last outlives the service
  (:meth:`Signing.kept`), so that neither an old packet is believed again nor a time stamp used
  twice, with or without a clock that knows the date.
* **Several ways.**  One packet can come by two endpoints.  Each way keeps its own record
  (:class:`WaySigning`), and only what is *acted on* counts for all: a copy that comes first on the
  way that stands by does not make the one in use a repetition.
* **Clocks.**  The date of a new stream is judged by the newest time stamp that was ever accepted,
  and by our own clock only where there is none yet.  A vehicle whose stamps lie behind ours takes
  over ours with the first packet that it accepts from us, as the specification has it; until then
  it is refused, which :attr:`Signing.behind_s` tells.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from onboard.mavlink import limits

EPOCH_UNIX_S = 1420070400.0
"""1 January 2015, where signing time starts."""
TICKS_PER_S = 100_000
RADIO_STATUS = 109
"""Made by telemetry radios, which have no key: let through unsigned, as the specification says;
nobody acts on it."""
LATEST = (1 << 48) - 1


@dataclass(frozen=True, slots=True)
class SigningRecord:
    """What has to outlive the service: time stamps of the last packet sent and accepted.

    ``streams`` by link id, system and component, in hex.
    """

    timestamp: int = 0
    streams: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse what is no record.

        Raises:
            ValueError: a stream that has no three bytes, or a time stamp that does not fit.
        """
        if any(len(bytes.fromhex(name)) != 3 for name in self.streams):
            raise ValueError("a stream has three bytes")
        if not all(0 <= t <= LATEST for t in (self.timestamp, *self.streams.values())):
            raise ValueError("a time stamp has 48 bits")


class Signing:
    """One shared key and the time-stamp bookkeeping of all links that use it.

    Args:
        key: the 32 bytes shared with the autopilot.
        wall_clock: unix time, s.
        accept_unsigned: let unsigned messages in (a mixed network); signed ones must still
            be right.
        record: of an earlier run.

    Raises:
        ValueError: the key is not 32 bytes long.
    """

    def __init__(
        self,
        key: bytes,
        wall_clock: Callable[[], float],
        *,
        accept_unsigned: bool = False,
        record: SigningRecord | None = None,
    ) -> None:
        if len(key) != 32:
            raise ValueError(f"a signing key has 32 bytes, this one has {len(key)}")
        self.key = key
        self.behind_s = 0.0
        """How far the genuine packet refused last lies behind, s; 0 once one is accepted."""
        self.ahead_s = 0.0
        """How far the newest accepted packet lies ahead of our own clock, s."""
        self._wall_clock = wall_clock
        self._accept_unsigned = accept_unsigned
        record = record or SigningRecord()
        self._timestamp = record.timestamp
        self._accepted = max(record.streams.values(), default=0)
        self._acted_on = {bytes.fromhex(name): t for name, t in record.streams.items()}

    @classmethod
    def from_passphrase(
        cls,
        passphrase: str,
        wall_clock: Callable[[], float],
        record: SigningRecord | None = None,
    ) -> Signing:
        """The key that ground stations derive from a passphrase: its SHA-256."""
        key = hashlib.sha256(passphrase.encode()).digest()
        return cls(key, wall_clock, record=record)

    def of_a_way(self) -> WaySigning:
        """The same key, with a record of its own of what came by one way."""
        return WaySigning(self)

    def next_timestamp(self) -> int:
        """Time stamp of the next frame sent, greater than any sent or received before."""
        self._timestamp = min(max(self._timestamp + 1, self._now()), LATEST)
        return self._timestamp

    def accepts_unsigned(self, message_id: int) -> bool:
        """Whether an unsigned frame with this message may pass."""
        return self._accept_unsigned or message_id == RADIO_STATUS

    def verify(self, frame: bytes) -> bool:
        """Whether a signed MAVLink 2 frame (checksum already right) is genuine and new.

        It then counts as acted on.
        """
        genuine = self.is_genuine(frame) and self.is_new(frame)
        if genuine:
            self.act_on(frame)
        return genuine

    def is_genuine(self, frame: bytes) -> bool:
        """Whether whoever made it has the key."""
        signature = hashlib.sha256(self.key + frame[:-6]).digest()[:6]
        return hmac.compare_digest(signature, frame[-6:])

    def is_new(self, frame: bytes) -> bool:
        """Whether a genuine frame is newer than all of its stream that were acted on."""
        timestamp = _timestamp(frame)
        last = self._acted_on.get(_stream(frame))
        if last is not None:
            return timestamp > last
        # A stream that was never heard: by what is known to be past, else by our own clock.
        reference = self._accepted or self._now()
        lag = (reference - timestamp) / TICKS_PER_S
        if lag > limits.NEW_STREAM_LAG_S:
            self.behind_s = lag
            return False
        return True

    def act_on(self, frame: bytes) -> None:
        """A genuine frame is about to be acted on: none of its stream that is older will be."""
        if len(frame) < 13 or frame[:1] != b"\xfd" or not frame[2] & 1:
            return  # unsigned, where that is allowed
        timestamp, stream = _timestamp(frame), _stream(frame)
        self.behind_s = 0.0
        self.ahead_s = max(0.0, (timestamp - self._now()) / TICKS_PER_S)
        if stream in self._acted_on or len(self._acted_on) < limits.SOURCES_KNOWN:
            self._acted_on[stream] = max(timestamp, self._acted_on.get(stream, 0))
        self._accepted = max(self._accepted, timestamp)
        self._timestamp = max(self._timestamp, timestamp)

    def kept(self, margin_s: float = 0.0) -> SigningRecord:
        """What has to outlive the service.

        Args:
            margin_s: so long it may go on before it is kept again: after a crash in that time
                nothing that was used then may be used again.
        """
        margin = int(margin_s * TICKS_PER_S)
        streams = {s.hex(): min(t + margin, LATEST) for s, t in self._acted_on.items()}
        return SigningRecord(min(self._timestamp + margin, LATEST), streams)

    def _now(self) -> int:
        return max(0, int((self._wall_clock() - EPOCH_UNIX_S) * TICKS_PER_S))


class WaySigning(Signing):
    """What one way has brought: repetitions are told from copies that came by another way."""

    def __init__(self, shared: Signing) -> None:
        self.key = shared.key
        self._shared = shared
        self._last: dict[bytes, int] = {}

    def next_timestamp(self) -> int:
        """Time stamp of the next frame sent, one series for all ways."""
        return self._shared.next_timestamp()

    def accepts_unsigned(self, message_id: int) -> bool:
        """As the shared key has it."""
        return self._shared.accepts_unsigned(message_id)

    def verify(self, frame: bytes) -> bool:
        """Whether a frame is genuine, and newer than all of its stream on this way."""
        if not self._shared.is_genuine(frame):
            return False
        stream, timestamp = _stream(frame), _timestamp(frame)
        if timestamp <= self._last.get(stream, -1) or not self._shared.is_new(frame):
            return False
        if stream in self._last or len(self._last) < limits.SOURCES_KNOWN:
            self._last[stream] = timestamp
        return True


def _timestamp(frame: bytes) -> int:
    return int.from_bytes(frame[-12:-6], "little")


def _stream(frame: bytes) -> bytes:
    return frame[-13:-12] + frame[5:7]
