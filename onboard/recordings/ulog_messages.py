"""Whether bytes may be a message of a ULog: it has no checksums, and noise has any kind and length.

Of 3,000 bytes of noise some hundred are letters of a kind, and the two before each say a length of
up to 64 kB: whoever believes one of them leaves out what was recorded behind.  So each body is held
against what its kind must have (PX4, *ULog file format*); records, types and parameters are checked
where they are taken.
"""

from __future__ import annotations

from collections.abc import Callable
from mmap import mmap

Bytes = bytes | mmap

SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
LEVELS = frozenset(range(8)) | frozenset(b"01234567")
"""Of a text for people: syslog's, as a digit; older writers had the number."""
LATEST_US = 1 << 53
"""Clocks begin with the board, or in 1970 and then end in 2255.  Of eight bytes of noise one in
2,000 is a time [bound]."""
LONGEST_KEY = 255
"""Of a name: its length is one byte [the format]."""


def _information(data: Bytes, body: int, stop: int) -> bool:
    """``length of key (1) key value``, the key being ``type name``."""
    length = data[body] if stop > body else 0
    key = bytes(data[body + 1 : body + 1 + length])
    return body + 1 + length <= stop and b" " in key.strip() and _is_text(key)


def _further(data: Bytes, body: int, stop: int) -> bool:
    """The same behind a byte of its own."""
    return _information(data, body + 1, stop)


def _said(data: Bytes, body: int, stop: int) -> bool:
    """``level (1) time (8) text``."""
    return stop - body >= 9 and data[body] in LEVELS and _is_time(data, body + 1)


def _tagged(data: Bytes, body: int, stop: int) -> bool:
    """``level (1) tag (2) time (8) text``."""
    return stop - body >= 11 and data[body] in LEVELS and _is_time(data, body + 3)


def _sync(data: Bytes, body: int, stop: int) -> bool:
    return bytes(data[body:stop]) == SYNC


def _removed(data: Bytes, body: int, stop: int) -> bool:
    del data
    return stop - body == 2


def _is_text(key: bytes) -> bool:
    return key.isascii() and key.decode("ascii").isprintable()


def _is_time(data: Bytes, at: int) -> bool:
    return int.from_bytes(data[at : at + 8], "little") < LATEST_US


def is_name(name: bytes) -> bool:
    """Whether it can be that of a topic."""
    return 0 < len(name) <= LONGEST_KEY and name.isascii() and name.replace(b"_", b"").isalnum()


PASSED_BY: dict[int, Callable[[Bytes, int, int], bool]] = {
    ord("I"): _information,
    ord("M"): _further,
    ord("Q"): _further,
    ord("L"): _said,
    ord("C"): _tagged,
    ord("S"): _sync,
    ord("R"): _removed,
}
"""Messages that are not read, by their kind: whether bytes from ``body`` to ``stop`` may be one."""
