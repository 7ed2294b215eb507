"""MAVLink 2 message signing: the shared key, time stamps that never repeat, verification.

Rules of the MAVLink signing specification: a signature is the first 48 bits of
``SHA-256(key + frame up to the signature)``; time stamps count 10 us since 1 January 2015
and must grow within each stream (link id, system, component); a new stream may be at most
one minute behind.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Callable

from onboard.mavlink import limits

EPOCH_UNIX_S = 1420070400.0
"""1 January 2015, where signing time starts."""
TICKS_PER_S = 100_000
RADIO_STATUS = 109
"""Made by telemetry radios, which have no key: accepted unsigned, as the specification says."""


class Signing:
    """One shared key and the time-stamp bookkeeping of all links that use it.

    Args:
        key: the 32 bytes shared with the autopilot.
        wall_clock: unix time, s.
        accept_unsigned: let unsigned messages in (a mixed network); signed ones must still
            be right.

    Raises:
        ValueError: the key is not 32 bytes long.
    """

    def __init__(
        self, key: bytes, wall_clock: Callable[[], float], *, accept_unsigned: bool = False
    ) -> None:
        if len(key) != 32:
            raise ValueError(f"a signing key has 32 bytes, this one has {len(key)}")
        self.key = key
        self._wall_clock = wall_clock
        self._accept_unsigned = accept_unsigned
        self._timestamp = 0
        self._streams: dict[bytes, int] = {}

    @classmethod
    def from_passphrase(cls, passphrase: str, wall_clock: Callable[[], float]) -> Signing:
        """The key that ground stations derive from a passphrase: its SHA-256."""
        return cls(hashlib.sha256(passphrase.encode()).digest(), wall_clock)

    def next_timestamp(self) -> int:
        """Time stamp of the next frame sent, greater than any sent or received before."""
        now = int((self._wall_clock() - EPOCH_UNIX_S) * TICKS_PER_S)
        self._timestamp = max(self._timestamp + 1, now)
        return self._timestamp

    def accepts_unsigned(self, message_id: int) -> bool:
        """Whether an unsigned frame with this message may pass."""
        return self._accept_unsigned or message_id == RADIO_STATUS

    def verify(self, frame: bytes) -> bool:
        """Whether a signed MAVLink 2 frame (checksum already right) is genuine and fresh."""
        signature = hashlib.sha256(self.key + frame[:-6]).digest()[:6]
        if not hmac.compare_digest(signature, frame[-6:]):
            return False
        timestamp = int.from_bytes(frame[-12:-6], "little")
        stream = frame[-13:-12] + frame[5:7]
        last = self._streams.get(stream)
        if last is None:
            now = int((self._wall_clock() - EPOCH_UNIX_S) * TICKS_PER_S)
            if timestamp + limits.NEW_STREAM_LAG_S * TICKS_PER_S < max(self._timestamp, now):
                return False
        elif timestamp <= last:
            return False
        self._streams[stream] = timestamp
        self._timestamp = max(self._timestamp, timestamp)
        return True
