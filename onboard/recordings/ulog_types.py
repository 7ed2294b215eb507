"""Types of a ULog: measured and laid out, never unfolded, so that nested arrays cost nothing."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

LONGEST_BODY = 65535
"""bytes of a message: the format has two for its length."""
DEEPEST = 8
"""Types within types: PX4 has two."""
MOST_TYPES, MOST_FIELDS = 4096, 512
"""PX4 has some 300 and 60."""
TYPES: dict[str, str] = {
    "int8_t": "i1",
    "uint8_t": "u1",
    "int16_t": "<i2",
    "uint16_t": "<u2",
    "int32_t": "<i4",
    "uint32_t": "<u4",
    "int64_t": "<i8",
    "uint64_t": "<u8",
    "float": "<f4",
    "double": "<f8",
    "bool": "i1",
    "char": "i1",
}
_FIELD = re.compile(r"(\w+)(?:\[(\d{1,5})\])? ([\w.]+)")


@dataclass(frozen=True, slots=True)
class Layout:
    """Records of one topic: ``dtype`` without the padding at the end, that ``longest`` includes."""

    dtype: np.dtype[np.void]
    longest: int
    timestamp: int


class Types:
    """What the definitions (F messages) say; a name keeps its first one."""

    def __init__(self) -> None:
        self._fields: dict[str, list[tuple[str, int, str]]] = {}
        self._sizes: dict[str, int] = {}

    def learn(self, body: bytes) -> bool:
        """Take a definition; whether it is one."""
        name, colon, rest = body.decode("ascii", "replace").partition(":")
        texts = [text for text in rest.split(";") if text]
        found = [_FIELD.fullmatch(text) for text in texts]
        fields = [(m[1], int(m[2]) if m[2] else 0, m[3]) for m in found if m]
        if name in self._fields:
            return self._fields[name] == fields
        if not colon or not all(found) or len(found) > MOST_FIELDS:
            return False
        if len(self._fields) >= MOST_TYPES:
            return False
        self._fields[name] = fields
        return True

    def layout(self, name: str) -> Layout | None:
        """Layout of a topic; None if it cannot be read."""
        places: dict[str, tuple[str, int]] = {}
        at = end = 0
        for kind, count, column in self._fields.get(name, ()):
            padding = column.startswith("_padding")
            if kind in TYPES and not padding:
                form = f"({count},){TYPES[kind]}" if count else TYPES[kind]
                places.setdefault(column, (form, at))
            at += self._size(kind, 0) * max(count, 1)
            end = end if padding else at
            if at > LONGEST_BODY:
                return None
        form, stamp = places.get("timestamp", ("", 0))
        if form != "<u8":
            return None
        formats, offsets = zip(*places.values(), strict=True)
        dtype = np.dtype(
            {
                "names": list(places),
                "formats": list(formats),
                "offsets": list(offsets),
                "itemsize": end,
            }
        )
        return Layout(dtype, at, stamp)

    def _size(self, kind: str, depth: int) -> int:
        """Bytes of a type; more than any record has, if it is unknown or too deep."""
        if kind in TYPES:
            return np.dtype(TYPES[kind]).itemsize
        size = self._sizes.get(kind)
        if size is None:
            size = LONGEST_BODY + 1
            if kind in self._fields and depth < DEEPEST:
                self._sizes[kind] = size  # a type within itself has no size
                parts = [(k, max(n, 1)) for k, n, _ in self._fields[kind]]
                size = min(sum(self._size(k, depth + 1) * n for k, n in parts), size)
            self._sizes[kind] = size
        return size
