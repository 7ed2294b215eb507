"""Text of others as it may be shown: names of files, what a recording or an error says.

A file may be called anything: bytes that are no UTF-8, control characters that a terminal obeys,
marks that turn the direction of writing.  None of them is shown, and none ends a program.
"""

from __future__ import annotations

import unicodedata
from typing import Any, Final

UNSHOWN: Final = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
"""Categories of characters that are orders, not letters: control, format, half a pair, ends of
lines."""
INSTEAD: Final = "\ufffd"


def printable(text: str, keep: str = "") -> str:
    """The text with U+FFFD for each character that is none to be shown, but for those to keep."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        INSTEAD if unicodedata.category(c) in UNSHOWN and c not in keep else c for c in text
    )


def in_ascii(line: str) -> str:
    """One line of printable ASCII: ground stations differ in what encoding they expect."""
    return "".join(c if " " <= c <= "~" or c == "\t" else "?" for c in line)


def encodable(data: Any) -> Any:  # noqa: ANN401 - whatever JSON has
    """The same dictionaries, lists and texts, which UTF-8 can say."""
    match data:
        case str():
            return data.encode("utf-8", "replace").decode()
        case dict():
            return {encodable(key): encodable(value) for key, value in data.items()}
        case list() | tuple():
            return [encodable(item) for item in data]
        case _:
            return data
