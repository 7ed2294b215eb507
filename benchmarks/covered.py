"""Coverage by package as a table: ``python -m benchmarks.covered covered.json``.

The file is that of ``coverage json`` after any number of runs with ``--branch --source onboard``
(``coverage combine`` adds them up).  Rooms of the core and of the daemon have rows of their own.
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any

ROOMS = ("core", "daemon")
"""Packages that are large enough to be told room by room."""


@dataclass(slots=True)
class Covered:
    """Lines and branches, those that were run and all."""

    lines: int = 0
    lines_of: int = 0
    branches: int = 0
    branches_of: int = 0

    def add(self, summary: Mapping[str, int]) -> None:
        """One more file."""
        self.lines += summary["covered_lines"]
        self.lines_of += summary["num_statements"]
        self.branches += summary["covered_branches"]
        self.branches_of += summary["num_branches"]


def by_package(document: Mapping[str, Any]) -> dict[str, Covered]:
    """Every package with its rooms, and ``all``."""
    found: dict[str, Covered] = defaultdict(Covered)
    for name, file in document["files"].items():
        for package in ("all", *_packages(PurePosixPath(name))):
            found[package].add(file["summary"])
    return dict(sorted(found.items(), key=lambda item: (item[0] == "all", item[0])))


def rows(found: Mapping[str, Covered]) -> Iterator[str]:
    """The table in Markdown."""
    yield "| package | lines | of | branches | of |"
    yield "|---|---|---|---|---|"
    for package, c in found.items():
        lines, branches = _share(c.lines, c.lines_of), _share(c.branches, c.branches_of)
        yield f"| {package} | {lines} | {c.lines_of:,} | {branches} | {c.branches_of:,} |"


def _packages(path: PurePosixPath) -> Iterator[str]:
    parts = path.parent.parts
    yield f"`{'/'.join(parts[:2])}`"
    if len(parts) > 2 and parts[1] in ROOMS:
        yield f"`{'/'.join(parts[:3])}`"


def _share(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.1f} %" if whole else "-"


def main() -> None:
    """Print the table."""
    with open(sys.argv[1], encoding="utf-8") as file:
        for row in rows(by_package(json.load(file))):
            print(row)


if __name__ == "__main__":
    main()
