"""Matches of an airframe that shares no code with the project's: a light plane of JSBSim's.

JSBSim flies its Cessna 172P in a constant wind, through turns, climbs, changes of power and kicks
of the rudder; what instruments would have seen is written as a laboratory's table, and ``onboard
match`` is asked.  Coefficients are held against finite differences of JSBSim's own forces, the wind
against what was set.  ``--without`` takes pieces of its physics out, alone or together.  JSBSim is
on the package registry (``pip install jsbsim``); without it there is nothing to do here.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import io
import json
import math
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.foreign_plane import (
    FOOT,
    HEAD,
    SEA_LEVEL_DENSITY,
    Flown,
    Simulator,
    flown,
    started,
)
from benchmarks.foreign_without import PIECES, airframes
from onboard.cli.main import run

MASS_KG = 2.0
"""Of the plane that coefficient files are of: the area is by this mass."""
SPAN_M, AREA_M2 = 10.9, 16.2
PROBE_RAD, KICK = 0.02, 0.2
MAP = """\
vehicle = "plane"
airborne = true
[time]
column = "t"
[attitude]
euler = ["roll", "pitch", "yaw"]
[force]
columns = ["fx", "fy", "fz"]
[rates]
columns = ["p", "q", "r"]
[velocity]
columns = ["vn", "ve", "vd"]
[position]
columns = ["pn", "pe", "pd"]
[airspeed]
column = "eas"
[throttle]
column = "throttle"
[rudder]
column = "rudder"
[origin]
latitude = 45.5
altitude = 300.0
"""


def truth(flight: Flown, airframes: Path | None = None) -> dict[str, float]:
    """Coefficients as SITL's files have them, by finite differences of JSBSim's own forces.

    Lift and drag over the flight's angles of attack, with the elevator that went with them: SITL's
    plane has no lift of its elevator, and a trimmed one has less than the wing's.
    """
    sim = started((0.0, 0.0), airframes)
    low, middle, high = np.quantile(flight.alpha, [0.1, 0.5, 0.9])
    trim = np.polyfit(flight.alpha, flight.elevator, 1)
    cl, cd = np.array(
        [
            _coefficients(sim, flight, a, elevator=float(np.polyval(trim, a)))[:2]
            for a in (low, middle, high)
        ]
    ).T
    side = [_coefficients(sim, flight, middle, beta=b)[2] for b in (-PROBE_RAD, PROBE_RAD)]
    kicked = [_coefficients(sim, flight, middle, rudder=r)[2] for r in (-KICK, KICK)]
    slope = (cl[2] - cl[0]) / (high - low)
    induced = (cd[2] - cd[0]) / (cl[2] ** 2 - cl[0] ** 2)
    return {
        "c_lift_0": float(np.mean(cl - slope * np.array([low, middle, high]))),
        "c_lift_a": float(slope),
        "c_drag_p": float(cd[1] - induced * cl[1] ** 2),
        "induced": float(induced),
        "c_y_b": (side[1] - side[0]) / (2.0 * PROBE_RAD),
        "c_y_deltar": (kicked[1] - kicked[0]) / (2.0 * KICK),
    }


def _coefficients(
    sim: Simulator,
    flight: Flown,
    alpha: float,
    *,
    beta: float = 0.0,
    elevator: float = 0.0,
    rudder: float = 0.0,
) -> tuple[float, float, float]:
    """Of lift, drag and side force along body y, at one speed."""
    sim["fcs/elevator-cmd-norm"], sim["fcs/rudder-cmd-norm"] = elevator, rudder
    ahead = flight.speed / FOOT
    sim["ic/u-fps"] = ahead * math.cos(alpha) * math.cos(beta)
    sim["ic/v-fps"] = ahead * math.sin(beta)
    sim["ic/w-fps"] = ahead * math.sin(alpha) * math.cos(beta)
    sim.run_ic()
    area = float(sim["aero/qbar-psf"] * sim["metrics/Sw-sqft"])
    lift, drag = sim["forces/fwz-aero-lbs"] / area, sim["forces/fwx-aero-lbs"] / area
    return float(lift), float(drag), float(sim["forces/fby-aero-lbs"] / area)


def answer(flight: Flown, folder: Path) -> dict[str, Any]:
    """What ``onboard match`` says of it, compared with the coefficients of ArduPilot's plane."""
    table, columns, frame = (folder / n for n in ("flight.csv", "map.toml", "frame.json"))
    lines = (",".join("" if math.isnan(x) else f"{x:.6f}" for x in row) for row in flight.rows)
    table.write_text("\n".join([HEAD, *lines]) + "\n", encoding="utf-8")
    columns.write_text(MAP, encoding="utf-8")
    # Of the area that has as much of the mass of SITL's plane as this one's has of its own.
    area = AREA_M2 * MASS_KG / flight.mass
    span = SPAN_M * math.sqrt(area / AREA_M2)
    frame.write_text(json.dumps({"s": area, "b": span}), encoding="utf-8")
    said = folder / "said.json"
    asked = [table, "--columns", columns, "--frame", frame, "--json", said]
    with contextlib.redirect_stdout(io.StringIO()):
        status = run(["match", *map(str, asked)])
    if status:
        raise SystemExit("onboard match failed")
    document: dict[str, Any] = json.loads(said.read_text(encoding="utf-8"))
    return document


def compared(
    document: Mapping[str, Any], true: Mapping[str, float], wind: tuple[float, float], rho: float
) -> Iterator[tuple[str, float, float, float]]:
    """Name, truth, what was found, sigma."""
    told = document.get("wind") or {}
    for axis, value in zip(("north", "east"), wind, strict=True):
        if told.get(axis) is not None:
            yield f"wind {axis}", value, told[axis], told[f"sigma_{axis}"]
    # SITL corrects for density once more than nature does.
    twice = rho / SEA_LEVEL_DENSITY
    for effect in document["effects"]:
        for key, value in effect["values"].items():
            if key in true:
                yield key, true[key], twice * value["real"], twice * value["sigma"]


def main(arguments: list[str] | None = None) -> None:
    """Command line."""
    options = argparse.ArgumentParser(description="JSBSim's light plane, matched.")
    options.add_argument("--seconds", type=float, default=240.0)
    options.add_argument("--seeds", type=int, nargs="*", default=[1, 2, 3])
    options.add_argument("--without", nargs="*", default=[], choices=sorted(PIECES))
    chosen = options.parse_args(arguments)
    if importlib.util.find_spec("jsbsim") is None:
        print("skipped: jsbsim is not installed")
        return
    print("| flight | number | truth | found | sigma | sigmas off | % off |\n" + "|---" * 7 + "|")
    with airframes(chosen.without) as folder:
        for seed in chosen.seeds:
            for line in lines(seed, chosen.seconds, folder):
                print(line, flush=True)


def lines(seed: int, seconds: float, airframe: Path) -> Iterator[str]:
    """A row for each number of one flight, and what the force says."""
    rng = np.random.default_rng([seed, 30])
    north, east = (float(x) for x in rng.uniform(-8.0, 8.0, 2))
    flight = flown((north, east), seed, seconds, airframe)
    with tempfile.TemporaryDirectory(prefix="foreign-") as folder:
        document = answer(flight, Path(folder))
    true = truth(flight, airframe)
    for name, is_, found, sigma in compared(document, true, (north, east), flight.rho):
        off = found - is_
        yield (
            f"| {seed} | {name} | {is_:.4f} | {found:.4f} | {sigma:.4f} "
            f"| {off / sigma:.1f} | {100 * off / is_:.1f} |"
        )
    names = ", ".join(e["name"] for e in document["effects"])
    force = ", ".join(
        f"{k} {v['before']:.2f} -> {v['after']:.2f}"
        for k, v in document["mismatch"].items()
        if k in ("x", "y", "z")
    )
    yield f"flight {seed} is {document['verdict']} ({names}); m/s^2 {force}"


if __name__ == "__main__":
    main()
