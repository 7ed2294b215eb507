"""A light plane of JSBSim's in flight, and what instruments would have seen of it."""

from __future__ import annotations

import importlib
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from benchmarks.foreign_without import AIRCRAFT, installed
from onboard.core.maths.arrays import Array

RATE_HZ = 200
EVERY, SELDOM = 4, 20
"""Steps between rows, and between those with a velocity and an airspeed."""
SETTLED_S = 15.0
FOOT, SLUG = 0.3048, 14.593903
PSF = 47.880259
ALTITUDE_M = 300.0
LATITUDE_DEG = 45.5
"""Where gravity is the standard one."""
SLOWEST_M_S = 36.0
FULL_RPM = 2700.0
"""A piston engine's propeller is seconds behind the throttle: the table has its speed."""
NOISE = {"force": 0.05, "rates": 0.002, "angles": 0.001, "velocity": 0.05, "airspeed": 0.3}
"""Of the instruments, standard deviations: m/s^2, rad/s, rad, m/s, m/s."""
SEA_LEVEL_DENSITY = 1.225
HEAD = "t,roll,pitch,yaw,fx,fy,fz,p,q,r,vn,ve,vd,pn,pe,pd,eas,throttle,rudder"


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


def started(wind: tuple[float, float], airframes: Path | None = None) -> Simulator:
    """JSBSim's executive with its aircraft in level flight.

    Args:
        wind: towards north and east, m/s.
        airframes: folder of another one of its name; JSBSim's own if None.
    """
    os.environ.setdefault("JSBSIM_DEBUG", "0")  # it greets on the terminal
    jsbsim = importlib.import_module("jsbsim")
    sim: Simulator = jsbsim.FGFDMExec(str(airframes or installed()))
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
    """Until (s), bank (rad), climb (m/s), throttle, rudder; as high at the end as at the start.

    Turns, kicks of the rudder, and what tells thrust from drag: glides, and full power level.
    """
    t, side = SETTLED_S, 1.0
    yield t, 0.0, 0.0, 0.7, 0.0
    while True:
        yield (t := t + 8.0), side * rng.uniform(0.2, 0.75), 0.0, rng.uniform(0.5, 0.9), 0.0
        kick = rng.uniform(0.1, 0.25)
        for way in (side, -side):
            yield (t := t + 2.5), 0.0, 0.0, 0.7, way * kick
        yield (t := t + 10.0), 0.0, 3.0, 1.0, 0.0
        yield (t := t + 6.0), 0.0, 0.0, 1.0, 0.0
        yield (t := t + 6.0), 0.0, -4.0, rng.uniform(0.6, 1.0), 0.0
        yield (t := t + 8.0), 0.0, -1.0, 0.0, 0.0
        side = -side


def flown(
    wind: tuple[float, float], seed: int, seconds: float, airframes: Path | None = None
) -> Flown:
    """A flight in a wind towards north and east, m/s."""
    rng = np.random.default_rng([seed, 31])
    sim, told = started(wind, airframes), commands(rng)
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
    alpha, elevator = np.array(trim).T
    return Flown(np.array(rows), alpha, elevator, _mass(sim), rho, speed)


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
