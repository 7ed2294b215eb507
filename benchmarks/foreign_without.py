"""JSBSim's airframe with one piece of its physics taken out: whose share an error is.

What is estimated wrong with a piece and right without it is wrong for that piece.
"""

from __future__ import annotations

import importlib
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree as ET

import numpy as np

AIRCRAFT, PROPELLER = "c172p", "prop_75in2f"
PIECES: dict[str, tuple[str, ...]] = {
    "slip": ("CDbeta",),
    "elevator": ("CDDe", "CLDe"),
    "rates": ("CLq", "CLadot", "CYp", "CYr"),
    "bend": (),
}
"""Coefficients of the airframe that go with each piece: drag of sideslip, drag and lift of the
elevator, forces by rates of turn; and the bend of the propeller's thrust over its advance ratio,
which becomes the straight line of the part that it flies in."""
FLOWN_IN = (0.4, 1.8)
"""Advance ratios of a flight: full power at 40 m/s to a glide."""


def installed() -> Path:
    """JSBSim's own airframes."""
    return Path(str(importlib.import_module("jsbsim").__file__)).parent


@contextmanager
def airframes(without: Sequence[str]) -> Iterator[Path]:
    """A folder with airframes that lack these pieces; JSBSim's own if there is none to take out."""
    if not without:
        yield installed()
        return
    with TemporaryDirectory(prefix="without-") as made:
        folder = Path(made)
        for part in (f"aircraft/{AIRCRAFT}", "engine", "systems"):
            shutil.copytree(installed() / part, folder / part)
        names = {f"aero/coefficient/{c}" for piece in without for c in PIECES[piece]}
        _take_out(folder / "aircraft" / AIRCRAFT / f"{AIRCRAFT}.xml", names)
        if "bend" in without:
            _straighten(folder / "engine" / f"{PROPELLER}.xml")
        yield folder


def _take_out(path: Path, names: set[str]) -> None:
    """The functions of these names out of every axis; each must be there."""
    tree = ET.parse(path)  # noqa: S314 - a file of the installed package
    left = set(names)
    for axis in tree.iter("axis"):
        for function in [f for f in axis if f.get("name") in names]:
            axis.remove(function)
            left.discard(str(function.get("name")))
    if left:
        raise ValueError(f"{path.name} has no {', '.join(sorted(left))}")
    tree.write(path)


def _straighten(path: Path) -> None:
    """Thrust that is linear in the advance ratio, by least squares where it flies."""
    tree = ET.parse(path)  # noqa: S314 - a file of the installed package
    table = next(t for t in tree.iter("table") if t.get("name") == "C_THRUST")
    data = table.find("tableData")
    assert data is not None
    advance, thrust = np.array(str(data.text).split(), dtype=float).reshape(-1, 2).T
    inside = (advance >= FLOWN_IN[0]) & (advance <= FLOWN_IN[1])
    line = np.polyfit(advance[inside], thrust[inside], 1)
    rows = (f"{j:.2f} {np.polyval(line, j):.5f}" for j in (0.0, float(advance[-1])))
    data.text = "\n".join(rows)
    tree.write(path)
