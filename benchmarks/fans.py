"""Winds of a wall of fans, concealed from ``onboard match``: a quadrotor that nobody measured with.

``python -m benchmarks.fans FOLDER`` reads Neural-Fly's flights (aerorobotics/neural-fly on GitHub,
``data/experiment``: a quadrotor flown by six controllers in five winds of a wall of fans, whose
speed is in the files' names).  The winds of some controllers' flights are concealed; of the others
they are told as measured, but where the fans change.  What is found is held against the names, and
beside it stands what a parabola of the mean force ahead over the known winds makes of them, which
is what these flights scatter by among themselves.  Nothing of the data is kept here.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import io
import json
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from onboard.cli.main import run

Array = NDArray[np.float64]

FANS: Final = {"nowind": 0.0, "35wind": 4.2, "70wind": 8.5, "70p20sint": 8.5, "100wind": 12.1}
"""m/s by the end of a file's name, as the data's authors have it; of the one that changes, the
mean."""
CHANGING: Final = ("70p20sint",)
CONTROLLERS: Final = ("L1", "NF-C", "NF-T", "NF", "baseline", "indi")
EDGE: Final = 100
"""Samples at either end that the mean force leaves out: differences have one side there."""
GRAVITY: Final = 9.81
FIELDS: Final = (("p", "p", "xyz"), ("v", "v", "xyz"), ("w", "w", "xyz"), ("q", "q", "xyzw"))
MAP: Final = """\
vehicle = "copter"
world = "nwu"
body = "flu"
airborne = true
[time]
column = "t"
unit = "s"
[attitude]
quaternion = ["qw", "qx", "qy", "qz"]
[force]
columns = ["ax", "ay", "az"]
unit = "m/s^2"
kind = "acceleration"
frame = "world"
derived = true
[rates]
columns = ["wx", "wy", "wz"]
unit = "rad/s"
[velocity]
columns = ["vx", "vy", "vz"]
unit = "m/s"
[position]
columns = ["px", "py", "pz"]
unit = "m"
[motors]
columns = ["m1", "m2", "m3", "m4"]
range = [0, 2000]
[wind]
columns = ["wind_n", "wind_w"]
unit = "m/s"
sigma = 0.1
[origin]
latitude = 34.1
longitude = -118.1
altitude = 230
"""
"""The vehicle's nose points at the fans, which is north here."""


@dataclass(frozen=True, slots=True)
class Flight:
    """One of the data's files.

    Attributes:
        path: of it.
        controller: that flew.
        fans: what they were set to, as the name has it.
        columns: (n, k) of each field.
    """

    path: Path
    controller: str
    fans: str
    columns: dict[str, Array]

    @property
    def wind(self) -> float:
        """Towards the vehicle's tail, m/s."""
        return FANS[self.fans]

    @property
    def acceleration(self) -> Array:
        """(n, 3) slope of the velocity, m/s^2."""
        out: Array = np.gradient(self.columns["v"], self.columns["t"], axis=0)
        return out

    @property
    def force_ahead(self) -> float:
        """Mean specific force along the body's axis ahead, m/s^2."""
        felt = self.acceleration + np.array([0.0, 0.0, GRAVITY])
        ahead = self.columns["R"].reshape(-1, 3, 3)[:, :, 0]
        return float(np.mean(np.sum(ahead * felt, axis=1)[EDGE:-EDGE]))


def read(path: Path) -> Flight:
    """A file, whose vectors are written as lists.

    Raises:
        ValueError: its name is not one of the data's.
    """
    *_, controller, fans = path.stem.split("_")
    if controller not in CONTROLLERS or fans not in FANS:
        raise ValueError(f"{path.name}: its name says no controller and wind")
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    columns = {
        name: np.array([json.loads(row[name]) for row in rows], dtype=np.float64)
        for name in ("t", "p", "v", "q", "R", "w", "pwm")
    }
    return Flight(path, controller, fans, columns)


def write(flight: Flight, path: Path, *, known: bool) -> Path:
    """The flight as a table, with the wind in it or without."""
    parts = {"t": flight.columns["t"]}
    for name, letter, axes in FIELDS:
        parts |= {f"{letter}{a}": flight.columns[name][:, k] for k, a in enumerate(axes)}
    parts |= {f"a{a}": flight.acceleration[:, k] for k, a in enumerate("xyz")}
    parts |= {f"m{k + 1}": flight.columns["pwm"][:, k] for k in range(4)}
    told = known and flight.fans not in CHANGING
    wind = (repr(-flight.wind), "0.0") if told else ("", "")
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow([*parts, "wind_n", "wind_w"])
        for values in zip(*parts.values(), strict=True):
            out.writerow([*map(repr, map(float, values)), *wind])
    return path


def matched(concealed: Sequence[Flight], known: Sequence[Flight]) -> list[tuple[float, float]]:
    """Wind towards the tail and its sigma, m/s, of each flight whose wind was concealed."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        columns, out = folder / "columns.toml", folder / "match.json"
        columns.write_text(MAP, encoding="utf-8")
        tables = [
            str(write(flight, folder / f"{k:03}.csv", known=flight in known))
            for k, flight in enumerate((*concealed, *known))
        ]
        further = [word for table in tables[1:] for word in ("--with", table)]
        with contextlib.redirect_stdout(io.StringIO()):
            run(["match", tables[0], *further, "--columns", str(columns), "--json", str(out)])
        document = json.loads(out.read_text(encoding="utf-8"))
    winds = [document["wind"], *(other["wind"] for other in document["others"])]
    return [(-w["north"], w["sigma_north"]) for w in winds[: len(concealed)]]


def by_parabola(concealed: Sequence[Flight], known: Sequence[Flight]) -> list[float]:
    """Wind, m/s, by a parabola of the mean force over the winds that are known."""
    steady = [f for f in known if f.fans not in CHANGING]
    a, b, c = np.polyfit([f.wind for f in steady], [f.force_ahead for f in steady], 2)
    out = []
    for flight in concealed:
        roots = np.roots([a, b, c - flight.force_ahead])
        middle = -b / (2.0 * a)
        # On the side of its top where these winds are.
        real = roots.real[np.abs(roots.imag) < 1e-9]
        same = real[(real > middle) == (middle < 0.0)]
        out.append(float(same[0]) if len(same) else float(middle))
    return out


HEAD: Final = f"{'flight':28}{'fans':>7}{'found':>8}{'sigma':>8}{'off':>8}{'parabola off':>14}  m/s"


@dataclass(frozen=True, slots=True)
class Found:
    """The wind of one flight, m/s: found, its sigma, and by a parabola of the mean force."""

    flight: Flight
    wind: float
    sigma: float
    plain: float

    @property
    def off(self) -> float:
        """By how much it is more than the fans' name."""
        return self.wind - self.flight.wind

    def __str__(self) -> str:
        """As a row under :data:`HEAD`."""
        name = f"{self.flight.controller}, {self.flight.fans}"
        return (
            f"{name:28}{self.flight.wind:7.1f}{self.wind:8.2f}{self.sigma:8.2f}"
            f"{self.off:+8.2f}{self.plain - self.flight.wind:+14.2f}"
        )


def main(arguments: list[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, help="of the data's files")
    parser.add_argument(
        "--concealed",
        nargs="+",
        choices=CONTROLLERS,
        default=list(CONTROLLERS[1:4]),
        help="controllers whose flights' winds are",
    )
    parser.add_argument(
        "--each",
        action="store_true",
        help="each controller's in turn, all others' told (an hour and more)",
    )
    chosen = parser.parse_args(arguments)
    every = [read(path) for path in sorted(chosen.folder.glob("*.csv"))]
    found: list[Found] = []
    for names in [[c] for c in CONTROLLERS] if chosen.each else [chosen.concealed]:
        concealed = [f for f in every if f.controller in names]
        known = [f for f in every if f.controller not in names]
        if not concealed or not known:
            parser.error(f"no flights of these controllers, or of no others, in {chosen.folder}")
        rows = zip(concealed, matched(concealed, known), by_parabola(concealed, known), strict=True)
        some = [Found(flight, *wind, plain) for flight, wind, plain in rows]
        if not found:
            print(HEAD)
        for row in some:
            print(row, flush=True)
        found += some
    off = np.array([f.off for f in found])
    sigmas = np.array([f.sigma for f in found])
    others = np.array([f.plain - f.flight.wind for f in found])
    print(
        f"RMS {_rms(off):.2f} m/s, {_rms(off / sigmas):.1f} sigma; "
        f"by a parabola of the mean force {_rms(others):.2f} m/s"
    )


def _rms(x: Array) -> float:
    return math.sqrt(float(np.mean(x * x)))


if __name__ == "__main__":
    main()
