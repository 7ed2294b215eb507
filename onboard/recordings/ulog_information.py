"""What a ULog says of itself before its first record: information texts and parameters.

Messages ``length (2) kind (1) body``; of an I or P message the body is ``length of key (1) key
value``, and the key is ``type name`` (PX4, *ULog file format*).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from pathlib import Path

from onboard.recordings.ulog_index import HEADER_LENGTH, KINDS

LONGEST_HEAD = 4_000_000
"""Bytes that are looked at: definitions and parameters of PX4 are some 100 kB."""
SECTION_ENDS = frozenset(b"AD")
NUMBERS = {"int32_t": "<i", "float": "<f", "uint32_t": "<I"}


@dataclass(slots=True)
class UlogInformation:
    """Texts and parameters by name."""

    texts: dict[str, str] = field(default_factory=dict)
    parameters: dict[str, float] = field(default_factory=dict)


def ulog_information(path: Path) -> UlogInformation:
    """Read the head of a ULog; what is damaged there ends it."""
    with path.open("rb") as file:
        data = file.read(LONGEST_HEAD)
    found, at = UlogInformation(), HEADER_LENGTH
    while at + 3 <= len(data):
        size, kind = struct.unpack_from("<HB", data, at)
        body = data[at + 3 : at + 3 + size]
        if kind in SECTION_ENDS or kind not in KINDS or len(body) < size:
            break
        if kind in b"IP" and body:
            _take(found, body[1 : 1 + body[0]], body[1 + body[0] :])
        at += 3 + size
    return found


def _take(found: UlogInformation, key: bytes, value: bytes) -> None:
    words = key.decode("ascii", "replace").split(" ")
    if len(words) != 2:
        return
    form, name = words
    if form.startswith("char["):
        found.texts[name] = value.decode("ascii", "replace")
    elif form in NUMBERS and len(value) == struct.calcsize(NUMBERS[form]):
        found.parameters[name] = float(struct.unpack(NUMBERS[form], value)[0])
