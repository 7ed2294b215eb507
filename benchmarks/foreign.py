"""Matches of an airframe that shares no code with the project's: a light plane of JSBSim's.

JSBSim flies its Cessna 172P in a constant wind, through turns, climbs, changes of power and kicks
of the rudder; what instruments would have seen is written as a laboratory's table, and ``onboard
match`` is asked.  Coefficients are held against finite differences of JSBSim's own forces, the wind
against what was set.  JSBSim is on the package registry (``pip install jsbsim``); without it there
is nothing to do here.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import json
import math
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from onboard.cli.main import run
from onboard.core.maths.arrays import Array

AIRCRAFT = "c172p"
RATE_HZ = 200
EVERY, SELDOM = 4, 20
"""Steps between rows, and between those with a velocity and an airspeed."""
SETTLED_S = 15.0
FOOT, SLUG = 0.3048, 14.593903
PSF = 47.880259
ALTITUDE_M = 150.0
LATITUDE_DEG = 45.5
"""Where gravity is the standard one."""
SLOWEST_M_S = 42.0
FULL_RPM = 2700.0
"""A piston engine's propeller is seconds behind the throttle: the table has its speed."""
NOISE = {"force": 0.05, "rates": 0.002, "angles": 0.001, "velocity": 0.05, "airspeed": 0.3}
"""Of the instruments, standard deviations: m/s^2, rad/s, rad, m/s, m/s."""
MASS_KG = 2.0
"""Of the plane that coefficient files are of: the area is by this mass."""
SPAN_M, AREA_M2 = 10.9, 16.2
PROBE_RAD, KICK = 0.02, 0.2
SEA_LEVEL_DENSITY = 1.225
HEAD = "t,roll,pitch,yaw,fx,fy,fz,p,q,r,vn,ve,vd,pn,pe,pd,eas,throttle,rudder"
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
altitude = 150.0
"""


class Simulator(Protocol):
    """What is used of JSBSim's executive, whose properties are read and set by their names."""

    def __getitem__(self, name: str, /) -> float: ...
    def __setitem__(self, name: str, value: float, /) -> None: ...
    def set_debug_level(self, level: int, /) -> None: ...  # noqa: D102
    def load_model(self, name: str, /) -> bool: ...  # noqa: D102
    def set_dt(self, seconds: float, /) -> None: ...  # noqa: D102
    def run_ic(self) -> bool: ...  # noqa: D102
    def run(self) -> bool: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Flown:
    """A flight: (n, 19) rows as :data:`HEAD` names them, and what the truth is asked with.

    ``alpha`` (n,) rad and ``elevator`` (n,) -1 to 1; ``mass`` kg, ``rho`` kg/m^3, ``speed`` m/s.
    """

    rows: Array
    alpha: Array
    elevator: Array
    mass: float
    rho: float
    speed: float


def started(wind: tuple[float, float]) -> Simulator:
    """JSBSim's executive with its aircraft in level flight; wind towards north and east, m/s."""
    os.environ.setdefault("JSBSIM_DEBUG", "0")  # it greets on the terminal
    jsbsim = importlib.import_module("jsbsim")
    sim: Simulator = jsbsim.FGFDMExec(str(Path(str(jsbsim.__file__)).parent))
    sim.set_debug_level(0)
    sim.load_model(AIRCRAFT)
    sim.set_dt(1.0 / RATE_HZ)
    begin = {"h-sl-ft": ALTITUDE_M / FOOT, "lat-geod-deg": LATITUDE_DEG, "u-fps": 52.0 / FOOT}
    for name, value in begin.items():
        sim[f"ic/{name}"] = value
    sim.run_ic()
    sim["propulsion/set-running"] = -1
    sim["fcs/mixture-cmd-norm"] = 0.9
    sim["atmosphere/wind-north-fps"], sim["atmosphere/wind-east-fps"] = (w / FOOT for w in wind)
    return sim


def commands(rng: np.random.Generator) -> Iterator[tuple[float, float, float, float, float]]:
    """Until (s), bank (rad), climb (m/s), throttle, rudder."""
    t, side = SETTLED_S, 1.0
    yield t, 0.0, 0.0, 0.7, 0.0
    while True:
        bank, climb = side * rng.uniform(0.2, 0.75), rng.uniform(-2.5, 2.5)
        throttle = rng.uniform(0.3, 1.0)
        kick = rng.uniform(0.2, 0.5)
        yield (t := t + rng.uniform(5.0, 9.0)), bank, climb, throttle, 0.0
        yield (t := t + 2.5), 0.0, 0.0, throttle, kick
        yield (t := t + 2.5), 0.0, 0.0, throttle, -kick
        side = -side


def flown(wind: tuple[float, float], seed: int, seconds: float) -> Flown:
    """A flight in a wind towards north and east, m/s."""
    rng = np.random.default_rng([seed, 31])
    sim, told = started(wind), commands(rng)
    until, bank, climb, throttle, rudder = next(told)
    rows, trim, place, level = [], [], np.zeros(3), 0.0
    for k in range(round((SETTLED_S + seconds) * RATE_HZ)):
        t = k / RATE_HZ
        if t >= until:
            until, bank, climb, throttle, rudder = next(told)
        speed = sim["velocities/vt-fps"] * FOOT
        slow = speed < SLOWEST_M_S
        wrong = (min(climb, -1.0) if slow else climb) - sim["velocities/h-dot-fps"] * FOOT
        level = float(np.clip(level + 0.02 * wrong / RATE_HZ, -0.2, 0.3))
        pitch = level + 0.02 * wrong + 0.1 * (1.0 - math.cos(bank))
        nose = sim["attitude/theta-rad"]
        sim["fcs/throttle-cmd-norm"] = 1.0 if slow else throttle
        sim["fcs/elevator-cmd-norm"] = -2.5 * (pitch - nose) + 0.8 * sim["velocities/q-rad_sec"]
        roll, p = sim["attitude/phi-rad"], sim["velocities/p-rad_sec"]
        sim["fcs/aileron-cmd-norm"] = 0.8 * (bank - roll) - 0.3 * p
        sim["fcs/rudder-cmd-norm"] = rudder
        sim.run()
        place = place + _velocity(sim) / RATE_HZ
        if t >= SETTLED_S and k % EVERY == 0:
            rows.append(_row(sim, t - SETTLED_S, place, rng, seldom=k % SELDOM == 0))
            trim.append((sim["aero/alpha-rad"], sim["fcs/elevator-cmd-norm"]))
    speed = math.sqrt(2.0 * sim["aero/qbar-psf"] * PSF / (rho := _density(sim)))
    return Flown(np.array(rows), *np.array(trim).T, _mass(sim), rho, speed)


def _mass(sim: Simulator) -> float:
    return float(sim["inertia/mass-slugs"]) * SLUG


def _density(sim: Simulator) -> float:
    return float(sim["atmosphere/rho-slugs_ft3"]) * SLUG / FOOT**3


def _velocity(sim: Simulator) -> Array:
    return FOOT * np.array([sim[f"velocities/v-{axis}-fps"] for axis in ("north", "east", "down")])


def _row(
    sim: Simulator, t: float, place: Array, rng: np.random.Generator, *, seldom: bool
) -> list[float]:
    """What instruments would say, with their noise; NaN where they say nothing now."""

    def noisy(values: Sequence[float] | Array, of: str) -> list[float]:
        return [float(v) + NOISE[of] * float(rng.standard_normal()) for v in values]

    angles = [sim[f"attitude/{a}-rad"] for a in ("phi", "theta", "psi")]
    by_mass = FOOT / float(sim["inertia/mass-slugs"])
    force = [by_mass * sim[f"forces/fb{axis}-total-lbs"] for axis in "xyz"]
    rates = [sim[f"velocities/{a}-rad_sec"] for a in "pqr"]
    slow = [math.nan] * 7
    if seldom:
        eas = sim["velocities/vt-fps"] * FOOT * math.sqrt(_density(sim) / SEA_LEVEL_DENSITY)
        slow = [*noisy(_velocity(sim), "velocity"), *place, *noisy([eas], "airspeed")]
    turning = sim["propulsion/engine/propeller-rpm"] / FULL_RPM
    surfaces = [turning**2, sim["fcs/rudder-cmd-norm"]]
    fast = [*noisy(angles, "angles"), *noisy(force, "force"), *noisy(rates, "rates")]
    return [t, *fast, *slow, *surfaces]


def truth(flight: Flown) -> dict[str, float]:
    """Coefficients as SITL's files have them, by finite differences of JSBSim's own forces.

    Lift and drag over the flight's angles of attack, with the elevator that went with them: SITL's
    plane has no lift of its elevator, and a trimmed one has less than the wing's.
    """
    sim = started((0.0, 0.0))
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
    if run(["match", *map(str, asked)]):
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
    chosen = options.parse_args(arguments)
    if importlib.util.find_spec("jsbsim") is None:
        print("skipped: jsbsim is not installed")
        return
    print("| flight | number | truth | found | sigma | sigmas off | % off |\n" + "|---" * 7 + "|")
    for seed in chosen.seeds:
        rng = np.random.default_rng([seed, 30])
        north, east = (float(x) for x in rng.uniform(-8.0, 8.0, 2))
        flight = flown((north, east), seed, chosen.seconds)
        with tempfile.TemporaryDirectory(prefix="foreign-") as folder:
            document = answer(flight, Path(folder))
        for name, true, found, sigma in compared(
            document, truth(flight), (north, east), flight.rho
        ):
            off = found - true
            print(
                f"| {seed} | {name} | {true:.4f} | {found:.4f} | {sigma:.4f} "
                f"| {off / sigma:.1f} | {100 * off / true:.1f} |"
            )
        names = ", ".join(e["name"] for e in document["effects"])
        force = {k: (v["before"], v["after"]) for k, v in document["mismatch"].items()}
        print(f"flight {seed}: {document['verdict']}: {names}; force left {force}")


if __name__ == "__main__":
    main()
