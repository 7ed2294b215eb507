"""Writes the tables of effects in the manuals from the catalogue: ``python docs/tables.py``."""

from __future__ import annotations

import re
from pathlib import Path

from onboard.core.physics.catalogue import kinds

HERE = Path(__file__).parent


def effects() -> str:
    """Rows of ``explaining.md``: name, title, what the unknowns are."""
    return "".join(f"| `{k.effect}` | {k.title} | {k.meaning} |\n" for k in kinds())


def findings() -> str:
    """Rows of ``ground-station.md``: number, name, title."""
    return "".join(f"| {k.code} | `{k.effect}` | {k.title} |\n" for k in kinds())


def rewritten(text: str, heading: str, rows: str) -> str:
    """A manual with other rows in the first table under a heading, where they name an effect."""
    start = text.index(f"\n{heading}\n")
    names = "|".join(kind.effect for kind in kinds())
    table = re.compile(rf"(?:^\|(?: \d+ \|)? `(?:{names})` \|.*\n)+", re.MULTILINE)
    return text[:start] + table.sub(lambda _: rows, text[start:], count=1)


def main() -> None:
    """Both manuals."""
    for name, heading, rows in (
        ("explaining.md", "## Effects", effects()),
        ("ground-station.md", "### OBC_FINDING", findings()),
    ):
        path = HERE / name
        path.write_text(rewritten(path.read_text("utf-8"), heading, rows), encoding="utf-8")


if __name__ == "__main__":
    main()
