"""The table of ``docs/licences.md``: what the service needs at run time, and under which licences.

Run in an environment where onboard is installed: ``.venv/bin/python docs/licences.py``.
"""

from __future__ import annotations

import re
import sys
import tomllib
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
LONGEST_NAME = 100
"""Characters; some packages have the whole licence where its name belongs."""
NAMES = {
    "BSD": "BSD-3-Clause",
    "Apache 2.0": "Apache-2.0",
    "LGPLv3": "LGPL-3.0",
    "Python Software Foundation License": "PSF-2.0",
    "BSD License": "BSD-3-Clause",
    "MIT License": "MIT",
    "Apache Software License": "Apache-2.0",
    "GNU Lesser General Public License v3 (LGPLv3)": "LGPL-3.0",
}
"""Classifiers that name a licence loosely, as the projects' own files have it."""


def canonical(name: str) -> str:
    """A project's name as package indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def requirements() -> list[str]:
    """Names in [project] dependencies and in the extra ``fast``."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = project["dependencies"] + project["optional-dependencies"]["fast"]
    return [Requirement(text).name for text in wanted]


def needed() -> dict[str, metadata.Distribution]:
    """All that is installed because of them, by canonical name."""
    found: dict[str, metadata.Distribution] = {}
    waiting = requirements()
    while waiting:
        name = canonical(waiting.pop())
        if name in found:
            continue
        found[name] = metadata.distribution(name)
        for text in found[name].requires or []:
            requirement = Requirement(text)
            if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
                waiting.append(requirement.name)
    return found


def licence(distribution: metadata.Distribution) -> str:
    """Its licence, in SPDX's words where the project uses them."""
    told = [distribution.metadata.get(key) or "" for key in ("License-Expression", "License")]
    for text in told:
        if text and "\n" not in text and len(text) < LONGEST_NAME:
            return NAMES.get(text, text)
    classified = [
        line.rpartition(" :: ")[2]
        for line in distribution.metadata.get_all("Classifier") or []
        if line.startswith("License ::")
    ]
    return ", ".join(NAMES.get(name, name) for name in classified)


def table() -> str:
    """One line for each."""
    rows = [
        f"| {distribution.metadata['Name']} | {licence(distribution)} |"
        for _, distribution in sorted(needed().items())
    ]
    return "\n".join(("| package | licence |", "|---|---|", *rows))


if __name__ == "__main__":
    sys.stdout.write(f"{table()}\n")
