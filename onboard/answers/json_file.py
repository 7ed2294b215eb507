"""A document as a file of JSON."""

from __future__ import annotations

import msgspec

from onboard.printable import encodable


def indented(document: msgspec.Struct | dict[str, object]) -> bytes:
    """Indented JSON in UTF-8 with a final newline; names of files that are no UTF-8 have ``?``."""
    try:
        data = msgspec.json.encode(document)
    except UnicodeEncodeError:
        data = msgspec.json.encode(encodable(msgspec.to_builtins(document)))
    return msgspec.json.format(data, indent=2) + b"\n"
