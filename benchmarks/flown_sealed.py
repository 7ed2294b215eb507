"""Airframes, winds and sensors drawn from a seed, flown by ArduPilot's own SITL, and matched.

The built-in simulator's sealed challenge (:mod:`benchmarks.matching`) knows what its own physics
can do.  This one asks a simulator that shares no code with this project, with what its users set:
keys of frame and coefficient files and ``SIM_*`` parameters.  A hash of the answer is printed
before it flies.  Its binary is looked for in ARDUPILOT_SITL_DIR and on PATH.
"""

from __future__ import annotations

import argparse
import asyncio
import hashlib
import json
import math
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from onboard.answers.match import match
from onboard.answers.match_document import match_document
from sitl.ardupilot.flight import fly
from sitl.ardupilot.process import find_binary
from sitl.builtin.world import Vehicle
from sitl.errors import NoBinaryError, SitlError

MCOEF = 1.24165
"""EKF3's coefficient over the frame's ``mdrag_coef``, of the default mass and rotors."""
WITHIN, SIGMAS = 0.1, 3.0
"""A number is right within so much of itself, or so many of its sigmas."""
UNCHECKED: Mapping[str, float] = {"ARMING_CHECK": 0.0, "ARMING_SKIPCHK": -1.0}
"""An accelerometer that is off must not keep it on the ground."""


@dataclass(slots=True)
class Secret:
    """What one flight has: its settings, and what should be said of it.

    Attributes:
        seed: of it.
        vehicle: ``copter`` or ``plane``.
        airframe: keys of a frame or coefficient file.
        parameters: of the simulator.
        truth: numbers to be told, by ``effect.number`` or by the setting that is handed back.
        names: effects to be named.
        beside: effects that may be named with them.
    """

    seed: int
    vehicle: Vehicle
    airframe: dict[str, object] = field(default_factory=dict)
    parameters: dict[str, float] = field(default_factory=dict)
    truth: dict[str, float] = field(default_factory=dict)
    names: set[str] = field(default_factory=set)
    beside: set[str] = field(default_factory=set)

    @property
    def seal(self) -> str:
        """Of the answer."""
        answer = json.dumps([self.seed, sorted(self.names), self.truth], sort_keys=True)
        return hashlib.sha256(answer.encode()).hexdigest()[:16]


Draw = Callable[[Secret, np.random.Generator], None]


def _either(rng: np.random.Generator, low: tuple[float, float], high: tuple[float, float]) -> float:
    return float(rng.uniform(*(low if rng.random() < 0.5 else high)))


def _wind(s: Secret, rng: np.random.Generator) -> None:
    # In more of it the plane's take-off does not end everywhere.
    most = 9.0 if s.vehicle == "copter" else 6.0
    speed, direction = float(rng.uniform(2.0, most)), float(rng.uniform(0.0, 360.0))
    s.parameters |= {"SIM_WIND_SPD": speed, "SIM_WIND_DIR": direction, "SIM_WIND_T": 1.0}
    s.truth["wind.north"] = -speed * math.cos(math.radians(direction))
    s.truth["wind.east"] = -speed * math.sin(math.radians(direction))
    s.names.add("wind")


def _profile(s: Secret, rng: np.random.Generator) -> None:
    _wind(s, rng)
    s.parameters["SIM_WIND_T"] = 0.0
    s.truth = {"wind_profile.exponent": 0.5, "SIM_WIND_SPD": s.parameters["SIM_WIND_SPD"]}
    s.names.add("wind_profile")


def _turbulence(s: Secret, rng: np.random.Generator) -> None:
    _wind(s, rng)
    s.parameters["SIM_WIND_TURB"] = float(rng.uniform(1.0, 3.0))
    s.names.add("turbulence")


def _rotors(s: Secret, rng: np.random.Generator) -> None:
    its = _either(rng, (0.08, 0.13), (0.3, 0.5))
    s.airframe["mdrag_coef"] = its
    s.truth["rotor_drag.mcoef"] = MCOEF * its
    s.names.add("rotor_drag")
    s.beside.add("body_drag")  # its share of the whole drag changes with it


def _body(s: Secret, rng: np.random.Generator) -> None:
    s.airframe["refAngle"] = _either(rng, (25.0, 36.0), (53.0, 60.0))
    s.names.add("body_drag")


def _thrust(s: Secret, rng: np.random.Generator) -> None:
    its = _either(rng, (0.3, 0.35), (0.44, 0.5))
    s.airframe["hoverThrOut"] = its
    s.truth["thrust_scale.ratio"] = 0.39 / its
    s.names.add("thrust_scale")
    s.beside |= {"rotor_drag", "body_drag"}


def _curve(s: Secret, rng: np.random.Generator) -> None:
    its = _either(rng, (0.1, 0.45), (0.85, 0.95))
    s.airframe["propExpo"] = s.truth["thrust_curve.expo"] = its
    s.names.add("thrust_curve")


def _sag(s: Secret, rng: np.random.Generator) -> None:
    s.airframe |= {"battCapacityAh": float(rng.uniform(2.2, 4.0)), "refBatRes": 0.03}
    s.truth["voltage_sag.exponent"] = 2.0
    s.names.add("voltage_sag")


def _lean(s: Secret, rng: np.random.Generator) -> None:
    x, y = rng.choice([-1.0, 1.0], 2) * rng.uniform(0.03, 0.06, 2)
    s.airframe |= {f"motor{k}_vector": [float(x), float(y), -1.0] for k in range(1, 5)}
    s.truth |= {"thrust_tilt.x": float(x), "thrust_tilt.y": float(y)}
    s.names.add("thrust_tilt")


def _accelerometer(s: Secret, rng: np.random.Generator) -> None:
    axis = "XYZ"[int(rng.integers(3))]
    offset, scale = _either(rng, (-0.4, -0.2), (0.2, 0.4)), _either(rng, (0.96, 0.98), (1.02, 1.04))
    for number in (1, 2):
        s.parameters |= {f"SIM_ACC{number}_BIAS_{axis}": offset}
        s.parameters |= {f"SIM_ACC{number}_SCAL_{axis}": scale}
    s.truth |= {f"SIM_ACC1_BIAS_{axis}": offset, f"SIM_ACC1_SCAL_{axis}": scale}


def _antenna(s: Secret, rng: np.random.Generator) -> None:
    axis = "XY"[int(rng.integers(2))]
    its = _either(rng, (-0.6, -0.3), (0.3, 0.6))
    s.parameters[f"SIM_GPS1_POS_{axis}"] = s.truth[f"SIM_GPS1_POS_{axis}"] = its
    s.names.add("gps_lever_arm")


def _drag(s: Secret, rng: np.random.Generator) -> None:
    s.airframe["c_drag_p"] = s.truth["drag.c_drag_p"] = _either(rng, (0.05, 0.075), (0.14, 0.2))
    s.names.add("drag")


def _lift(s: Secret, rng: np.random.Generator) -> None:
    s.airframe["c_lift_0"] = s.truth["lift.c_lift_0"] = _either(rng, (0.3, 0.42), (0.68, 0.8))
    s.names.add("lift")


def _side(s: Secret, rng: np.random.Generator) -> None:
    s.airframe["c_y_b"] = s.truth["side_force.c_y_b"] = _either(rng, (-0.6, -0.4), (-1.6, -1.3))
    s.names.add("side_force")


def _airspeed(s: Secret, rng: np.random.Generator) -> None:
    its = _either(rng, (1.5, 1.75), (2.3, 2.6))
    s.parameters["SIM_ARSPD_RATIO"] = s.truth["SIM_ARSPD_RATIO"] = its
    s.names.add("airspeed_scale")


OF_COPTERS: tuple[Draw, ...] = (_rotors, _body, _thrust, _curve, _sag, _lean)
OF_PLANES: tuple[Draw, ...] = (_drag, _lift, _side, _airspeed)
AIR: tuple[Draw, ...] = (_wind, _profile, _turbulence)
SENSORS: tuple[Draw, ...] = (_accelerometer, _antenna)


def drawn(seed: int) -> Secret:
    """A vehicle, an airframe of one effect or none, air, and sensors, as the seed has them."""
    rng = np.random.default_rng(seed)
    secret = Secret(seed, "copter" if rng.random() < 0.65 else "plane")
    copter = secret.vehicle == "copter"
    kinds: tuple[tuple[float, tuple[Draw, ...]], ...] = (
        (0.6, AIR if copter else AIR[:1]),
        (0.75, OF_COPTERS if copter else OF_PLANES),
        (0.4, SENSORS),
    )
    for chance, of in kinds:
        if rng.random() < chance:
            of[int(rng.integers(len(of)))](secret, rng)
    return secret


def told(
    document: Mapping[str, Any], settings: Mapping[str, tuple[float, float]]
) -> Mapping[str, tuple[float, float]]:
    """Numbers and sigmas, by ``effect.number`` and by setting."""
    numbers = {
        f"{e['name']}.{key}": (value["real"], value["sigma"] or 0.0)
        for e in document["effects"]
        for key, value in e["values"].items()
    }
    return {**settings, **numbers}


def lines(seeds: range, *, seconds: float, speedup: float) -> Iterator[str]:
    """A row for each flight, and what they come to."""
    named = wanted = false = right = numbers = 0
    for seed in seeds:
        s = drawn(seed)
        what = f"{seed} {s.vehicle}"
        yield f"{what}, sealed {s.seal}"
        with tempfile.TemporaryDirectory(prefix="sealed-") as folder:
            log = Path(folder) / "flight.BIN"
            parameters = {"SIM_WIND_TURB": 0.0, **UNCHECKED, **s.parameters}
            try:
                asyncio.run(
                    fly(
                        s.vehicle,
                        log,
                        airframe=s.airframe or None,
                        parameters=parameters,
                        seconds=seconds,
                        speedup=speedup,
                        seed=seed,
                    )
                )
            except SitlError as error:
                yield f"{what}: not flown, {error}"
                continue
            answer = match(log)
        document = json.loads(match_document(answer).to_json())
        said = {e["name"] for e in document["effects"]}
        values = told(document, {x.name: (x.value, x.sigma) for x in answer.settings})
        off = []
        for key, true in s.truth.items():
            value, sigma = values.get(key, (math.nan, math.nan))
            good = abs(value - true) <= max(WITHIN * abs(true), SIGMAS * sigma)
            numbers, right = numbers + 1, right + good
            if not good:
                off.append(f"{key} {value:.3g} +-{sigma:.2g} for {true:.3g}")
        missed, more = s.names - said, said - s.names - s.beside
        wanted, named, false = (
            wanted + len(s.names),
            named + len(s.names & said),
            false + bool(more),
        )
        words = [", ".join(sorted(s.names)) or "nothing", document["verdict"]]
        words += [f"missed {', '.join(sorted(missed))}"] if missed else []
        words += [f"false {', '.join(sorted(more))}"] if more else []
        yield f"{what}: {'; '.join(words + off)}"
    yield f"{named} of {wanted} effects named, {false} flights with a false one"
    yield f"{right} of {numbers} numbers within {100 * WITHIN:.0f} % or {SIGMAS:.0f} sigma"


def printed(
    rows: Callable[..., Iterator[str]],
    options: argparse.ArgumentParser,
    arguments: list[str] | None,
) -> None:
    """Print what ``rows`` makes of the seeds and options that were chosen, or why nothing is."""
    options.add_argument("--first", type=int, default=1, help="first seed")
    options.add_argument("--count", type=int, default=12)
    options.add_argument("--seconds", type=float, default=200.0, help="of manoeuvres")
    options.add_argument("--speedup", type=float, default=6.0)
    chosen = vars(options.parse_args(arguments))
    try:
        find_binary("copter")
    except NoBinaryError as error:
        print(error)
        return
    first = chosen.pop("first")
    for line in rows(range(first, first + chosen.pop("count")), **chosen):
        print(line, flush=True)


def main(arguments: list[str] | None = None) -> None:
    """Print the rows, or why there are none."""
    options = argparse.ArgumentParser(description="Concealed in flights of ArduPilot's SITL.")
    printed(lines, options, arguments)


if __name__ == "__main__":
    main()
