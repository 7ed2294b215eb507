"""Sensor errors drawn from a seed, flown by ArduPilot's own SITL, and explained.

The built-in simulator's sealed challenge (:mod:`benchmarks.explaining`) knows what its own sensors
can do.  This one asks a simulator that shares no code with this project, with what its users set:
``SIM_*`` parameters, of which some change in flight.  Every flight has errors of all six numbers of
the calibration, gyroscopes whose scales are up to 3 % off and a receiver that is late, so that
every flight is asked for them, besides one effect or none.  A hash of the answer is printed before
it flies.  With ``--weather`` there is :mod:`benchmarks.flown_weather` on top.
"""

from __future__ import annotations

import argparse
import asyncio
import hashlib
import json
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.flown_sealed import SIGMAS, UNCHECKED, WITHIN, printed
from benchmarks.flown_weather import weather as weather_of
from onboard.answers.explain import explain
from onboard.core.diagnosis.records import Diagnosis
from onboard.core.inputs.samples import ImuSample
from onboard.recordings.opening import open_recording
from sitl.ardupilot.flight import fly
from sitl.builtin.world import Vehicle
from sitl.errors import SitlError

AXES = "XYZ"
ALWAYS = frozenset({"gps_latency", "gps_smoothing"})
"""May be named of every flight: the simulator's receiver is late, and interpolates."""
TOLD_S = 1.0
"""By how much the moment at which a parameter is sent may miss that at which it acts, s."""


@dataclass(slots=True)
class Secret:
    """What one flight has.

    Attributes:
        seed: of it.
        vehicle: ``copter`` or ``plane``.
        parameters: of the simulator.
        change: parameters that change after so many seconds of manoeuvres.
        six: scale and offset of the first accelerometer, to be told.
        names: effects to be named.
        truth: numbers to be told, by ``effect.unknown``.
    """

    seed: int
    vehicle: Vehicle
    parameters: dict[str, float] = field(default_factory=dict)
    change: dict[float, dict[str, float]] = field(default_factory=dict)
    six: dict[str, float] = field(default_factory=dict)
    names: set[str] = field(default_factory=set)
    truth: dict[str, float] = field(default_factory=dict)

    @property
    def seal(self) -> str:
        """Of the answer."""
        answer = json.dumps([self.seed, self.six, sorted(self.names), self.truth], sort_keys=True)
        return hashlib.sha256(answer.encode()).hexdigest()[:16]


Draw = Callable[[Secret, np.random.Generator], None]


def _sized(rng: np.random.Generator, low: float, high: float) -> float:
    """Either sign, as large as between the two."""
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high))


def _both(name: str, value: float) -> dict[str, float]:
    """A parameter of both accelerometers."""
    return {f"SIM_ACC{i}_{name}": value for i in (1, 2)}


def _accelerometer(s: Secret, rng: np.random.Generator) -> None:
    for axis in AXES:
        scale, offset = 1.0 + float(rng.uniform(-0.03, 0.03)), float(rng.uniform(-0.3, 0.3))
        s.parameters |= _both(f"SCAL_{axis}", scale) | _both(f"BIAS_{axis}", offset)
        s.six |= {f"scale {axis}": scale, f"offset {axis}": offset}


def _air(s: Secret, rng: np.random.Generator) -> None:
    speed = float(rng.uniform(0.0, 5.0))
    s.parameters |= {"SIM_WIND_SPD": speed, "SIM_WIND_DIR": float(rng.uniform(0.0, 360.0))}


def _receiver(s: Secret, rng: np.random.Generator) -> None:
    s.parameters["SIM_GPS1_LAG_MS"] = float(rng.integers(50, 400))
    s.parameters["SIM_GPS1_HZ"] = float(rng.choice([5, 5, 10]))


def _antenna(s: Secret, rng: np.random.Generator) -> None:
    for axis in AXES:
        its = _sized(rng, 0.2, 0.6)
        s.parameters[f"SIM_GPS1_POS_{axis}"] = s.truth[f"gps_lever_arm.{axis.lower()}"] = its
    s.names.add("gps_lever_arm")


def _jump(s: Secret, rng: np.random.Generator) -> None:
    axis, its = AXES[int(rng.integers(3))], _sized(rng, 0.2, 0.6)
    at = float(rng.uniform(50.0, 130.0))
    s.change[at] = _both(f"BIAS_{axis}", s.six[f"offset {axis}"] + its)
    s.truth[f"bias_step.{axis.lower()}"] = its
    s.names.add("bias_step")


def _mount(s: Secret, rng: np.random.Generator) -> None:
    # The simulator turns the accelerometer; what reads too much is the attitude, the other way.
    for axis, angle in (("X", "roll"), ("Y", "pitch")):
        its = _sized(rng, 0.015, 0.04)
        s.parameters[f"SIM_ACC_TRIM_{axis}"] = its
        s.truth[f"mount_tilt.{angle}"] = -its
    s.names.add("mount_tilt")


def _gyroscope(s: Secret, rng: np.random.Generator) -> None:
    # Nobody calibrates it, and nobody is told of it: a nuisance, of the size that data sheets have.
    for axis in AXES:
        its = float(rng.uniform(-3.0, 3.0))
        s.parameters |= {f"SIM_GYR{i}_SCALE_{axis}": its for i in (1, 2)}


def _nothing(s: Secret, rng: np.random.Generator) -> None:
    del s, rng


EFFECTS: tuple[Draw, ...] = (_antenna, _jump, _mount, _nothing)


def drawn(seed: int) -> Secret:
    """A vehicle, its air and sensors, and one effect or none, as the seed has them."""
    rng = np.random.default_rng(seed)
    secret = Secret(seed, "copter" if rng.random() < 0.5 else "plane")
    effect = EFFECTS[int(rng.integers(len(EFFECTS)))]
    for draw in (_accelerometer, _air, _receiver, effect, _gyroscope):
        draw(secret, rng)
    return secret


@dataclass(slots=True)
class Score:
    """What came of one flight, or of all."""

    six: int = 0
    sigmas: list[float] = field(default_factory=list)
    named: int = 0
    wanted: int = 0
    numbers: int = 0
    right: int = 0
    false: int = 0
    calibrated: int = 0
    words: list[str] = field(default_factory=list)

    def add(self, other: Score) -> None:
        """Count another one's, but not its words."""
        self.sigmas += other.sigmas
        for name in ("six", "named", "wanted", "numbers", "right", "false", "calibrated"):
            setattr(self, name, getattr(self, name) + getattr(other, name))

    def __str__(self) -> str:
        worst = max(self.sigmas, default=0.0)
        return (
            f"{self.named} of {self.wanted} effects named, {self.right} of {self.numbers} of their"
            f" numbers within {100 * WITHIN:.0f} % or {SIGMAS:.0f} sigma, {self.false} flights with"
            f" a false one; {self.six} of {len(self.sigmas)} scales and offsets within"
            f" {SIGMAS:.0f} sigma, the worst {worst:.1f}; {self.calibrated} calibrated"
        )


def scored(secret: Secret, d: Diagnosis, changed: float | None) -> Score:
    """What a diagnosis has found of a secret.

    Args:
        secret: what was concealed.
        d: what was found.
        changed: when parameters changed, s since the first sample; None: they did not.
    """
    out, c = Score(calibrated=int(d.calibration.status.value == "calibrated")), d.calibration
    # With a jump, the six are those before it.
    for k, axis in enumerate(AXES):
        for name, value, sigma in (
            ("scale", c.scale[k], c.scale_sigma[k]),
            ("offset", c.offset[k], c.offset_sigma[k]),
        ):
            off = abs(value - secret.six[f"{name} {axis}"]) / sigma
            out.sigmas.append(off)
            out.six += off <= SIGMAS
            if off > SIGMAS:
                out.words.append(f"{axis} {name} {off:.1f} sigma off")
    said = {e.name: e for e in d.effects}
    out.wanted, out.named = len(secret.names), len(secret.names & set(said))
    false = set(said) - secret.names - ALWAYS
    out.false = int(bool(false))
    for what, names in (("missed", secret.names - set(said)), ("false", false)):
        if names:
            out.words.append(f"{what} {', '.join(sorted(names))}")
    for key, true in secret.truth.items():
        effect, unknown = key.split(".")
        got = said[effect].unknowns.get(unknown) if effect in said else None
        good = got is not None and abs(got.value - true) <= max(
            WITHIN * abs(true), SIGMAS * got.sigma
        )
        out.numbers, out.right = out.numbers + 1, out.right + int(good)
        if not good and got is not None:
            out.words.append(f"{key} {got.value:.3g} +-{got.sigma:.2g} for {true:.3g}")
    if changed is not None and "bias_step" in said:
        time = said["bias_step"].unknowns["time"]
        good = abs(time.value - changed) <= TOLD_S + SIGMAS * time.sigma
        out.numbers, out.right = out.numbers + 1, out.right + int(good)
        if not good:
            out.words.append(f"jump at {time.value:.1f} s for {changed:.1f}")
    return out


def lines(
    seeds: range,
    *,
    seconds: float,
    speedup: float,
    keep: Path | None = None,
    weather: bool = False,
) -> Iterator[str]:
    """A row for each flight, and what they come to; logs stay in the folder ``keep``, if any."""
    total = Score()
    for seed in seeds:
        s = drawn(seed)
        words, air = weather_of(seed, s.vehicle) if weather else ([], {})
        what = " ".join([f"{seed} {s.vehicle}", *words])
        yield f"{what}, sealed {s.seal}"
        with tempfile.TemporaryDirectory(prefix="sealed-") as folder:
            log = (keep or Path(folder)) / f"{seed}.BIN"
            try:
                changed = asyncio.run(
                    fly(
                        s.vehicle,
                        log,
                        parameters={"SIM_WIND_TURB": 0.0, **UNCHECKED, **s.parameters, **air},
                        seconds=seconds,
                        speedup=speedup,
                        seed=seed,
                        changes=s.change,
                    )
                )
            except SitlError as error:
                yield f"{what}: not flown, {error}"
                continue
            found = explain([log])
            first = next(x.t for x in open_recording(log).samples() if isinstance(x, ImuSample))
        at = next(iter(changed.values()), None)
        score = scored(s, found.diagnosis, None if at is None else at - first)
        total.add(score)
        said = [", ".join(sorted(s.names)) or "nothing", found.diagnosis.verdict.value]
        yield f"{what}: {'; '.join(said + score.words)}"
    yield str(total)


def main(arguments: list[str] | None = None) -> None:
    """Print the rows, or why there are none."""
    options = argparse.ArgumentParser(description="Sensor errors in flights of ArduPilot's SITL.")
    options.add_argument("--keep", type=Path, help="a folder for the logs")
    options.add_argument("--weather", action="store_true", help="gusts, shaking, noise and more")
    printed(lines, options, arguments)


if __name__ == "__main__":
    main()
