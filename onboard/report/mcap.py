"""Time series as an MCAP file, which Foxglove and other viewers of logs open.

Version 0 of the format: records one after another, each message a JSON object of numbers with a
JSON Schema for its topic.  Nothing is compressed or indexed: these are thousands of messages.
"""

from __future__ import annotations

import itertools
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, DATA_END = 0x01, 0x02, 0x03, 0x04, 0x05, 0x0F
NANOSECONDS = 1e9
"""Of a second: the unit of the format's times."""


@dataclass(frozen=True, slots=True)
class Track:
    """One topic: ``t`` (n,) s, not negative, and columns (n,) by name; NaN: not there."""

    topic: str
    t: Array
    columns: Mapping[str, Array]


def mcap(tracks: Sequence[Track]) -> bytes:
    """The file; messages of all topics in order of time, which is that of the recording.

    Args:
        tracks: topics, each with at least one column.
    """
    parts = [MAGIC, _record(HEADER, _text("") + _text("onboard"))]
    messages: list[tuple[int, int, bytes]] = []
    for number, track in enumerate(tracks, start=1):
        schema = json.dumps(_schema(track)).encode()
        name = track.topic.strip("/").replace("/", ".")
        parts += [
            _record(
                SCHEMA,
                struct.pack("<H", number) + _text(name) + _text("jsonschema") + _bytes(schema),
            ),
            _record(
                CHANNEL,
                struct.pack("<HH", number, number)
                + _text(track.topic)
                + _text("json")
                + _bytes(b""),
            ),
        ]
        messages += [(at, number, said) for at, said in _said(track)]
    counts = itertools.count()
    for at, number, said in sorted(messages, key=lambda m: m[:2]):
        head = struct.pack("<HIQQ", number, next(counts), at, at)
        parts.append(_record(MESSAGE, head + said))
    parts += [
        _record(DATA_END, struct.pack("<I", 0)),
        _record(FOOTER, struct.pack("<QQI", 0, 0, 0)),
    ]
    return b"".join([*parts, MAGIC])


def _schema(track: Track) -> dict[str, object]:
    return {"type": "object", "properties": {n: {"type": "number"} for n in track.columns}}


def _said(track: Track) -> list[tuple[int, bytes]]:
    """Times in ns and messages; moments at which no column has a number are left out."""
    out = []
    for k, t in enumerate(track.t):
        values = {n: float(column[k]) for n, column in track.columns.items()}
        finite = {n: v for n, v in values.items() if np.isfinite(v)}
        if finite and np.isfinite(t) and t >= 0.0:
            out.append((round(float(t) * NANOSECONDS), json.dumps(finite).encode()))
    return out


def _record(kind: int, content: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(content)) + content


def _bytes(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def _text(text: str) -> bytes:
    return _bytes(text.encode("utf-8", "replace"))
