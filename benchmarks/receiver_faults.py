"""Errors of a receiver of every shape, jumps of the accelerometer, both and neither: what is said.

Ten flights a seed, copters and planes: an error that is constant (2 to 30 s, 1 to 4 m/s), small
(0.5 to 1 m/s), long (30 to 100 s); two that have nothing to do with each other, or take each other
back; one that grows in steps, or creeps in; an offset that jumps, alone or about the time of an
error; and a flight with nothing wrong.  An answer is right if it names all of it and nothing else.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.explaining import listened
from benchmarks.numbers import numbers
from onboard.core.diagnosis.procedure import examine
from onboard.core.maths.compiling import prefer_compiled
from sitl.builtin.effects import BiasStep, Effect, GpsFault
from sitl.builtin.truth import GpsTruth, random_imus
from sitl.recording import FlightSpec, run

Rng = np.random.Generator
PROMPT = GpsTruth(delay=0.03, stamped_early=0.02)


def _off(rng: Rng, low: float, high: float) -> tuple[float, float]:
    """North and east of an error of some size, m/s, in any direction."""
    size, angle = rng.uniform(low, high), rng.uniform(0.0, 2.0 * np.pi)
    return float(size * np.cos(angle)), float(size * np.sin(angle))


def _fault(start: float, lasts: float, off: tuple[float, float]) -> GpsFault:
    return GpsFault(start=float(start), end=float(start + lasts), north=off[0], east=off[1])


def _constant(rng: Rng, t: float) -> list[Effect]:
    return [_fault(t, rng.uniform(2.0, 30.0), _off(rng, 1.0, 4.0))]


def _small(rng: Rng, t: float) -> list[Effect]:
    return [_fault(t, rng.uniform(8.0, 30.0), _off(rng, 0.5, 1.0))]


def _long(rng: Rng, t: float) -> list[Effect]:
    return [_fault(t, rng.uniform(30.0, 100.0), _off(rng, 1.0, 4.0))]


def _two(rng: Rng, t: float) -> list[Effect]:
    return [
        _fault(at, rng.uniform(4.0, 20.0), _off(rng, 1.0, 3.0))
        for at in (30.0, max(t, 52.0) + 20.0)
    ]


def _opposite(rng: Rng, t: float) -> list[Effect]:
    (north, east), first = _off(rng, 1.0, 3.0), rng.uniform(6.0, 15.0)
    again = t + first + rng.uniform(5.0, 40.0)
    lasts = rng.uniform(6.0, 15.0)
    return [_fault(t, first, (north, east)), _fault(again, lasts, (-north, -east))]


def _steps(rng: Rng, t: float) -> list[Effect]:
    count, each, off = int(rng.integers(2, 4)), rng.uniform(5.0, 12.0), _off(rng, 0.8, 2.0)
    return [_fault(t + k * each, (count - k) * each, off) for k in range(count)]


def _creeping(rng: Rng, t: float) -> list[Effect]:
    (north, east), grows = _off(rng, 1.5, 4.0), rng.uniform(5.0, 20.0)
    count, lasts = round(5.0 * grows), grows + rng.uniform(0.0, 15.0)
    off = (north / count, east / count)
    return [_fault(t + k * grows / count, lasts - k * grows / count, off) for k in range(count)]


def _jump(rng: Rng, t: float) -> list[Effect]:
    way = rng.normal(size=3)
    x, y, z = (rng.uniform(0.15, 0.8) * way / np.linalg.norm(way)).tolist()
    return [BiasStep(time=t, x=x, y=y, z=z)]


def _both(rng: Rng, t: float) -> list[Effect]:
    at = t + rng.uniform(-30.0, 60.0)
    return [*_jump(rng, t), _fault(at, rng.uniform(6.0, 25.0), _off(rng, 1.0, 3.0))]


def _nothing(rng: Rng, t: float) -> list[Effect]:  # noqa: ARG001
    return []


KINDS: dict[str, Callable[[Rng, float], list[Effect]]] = {
    "constant": _constant,
    "small": _small,
    "long": _long,
    "two": _two,
    "opposite": _opposite,
    "in steps": _steps,
    "creeping": _creeping,
    "jump": _jump,
    "jump and error": _both,
    "nothing": _nothing,
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """What is said of one flight.

    Attributes:
        kind: of :data:`KINDS`.
        seed: of the flight.
        wanted: names that are right.
        said: names that were said.
        size: largest error that was made, and that was told with its sigma, m/s; NaN without one.
        pull: largest of the errors of the six numbers, over its sigma.
        offered: whether they would be set.
    """

    kind: str
    seed: int
    wanted: frozenset[str]
    said: frozenset[str]
    size: tuple[float, float, float]
    pull: float
    offered: bool

    @property
    def right(self) -> bool:
        """All that was made, and nothing else, was said."""
        return self.said == self.wanted

    def line(self) -> str:
        """For people."""
        made, told, sigma = self.size
        size = "" if np.isnan(made) else f"{made:6.2f} m/s made, {told:.2f} ± {sigma:.2f} told"
        names = ", ".join(sorted(self.said)) or "nothing"
        verdict = "" if self.right else "WRONG "
        pull = f"six within {self.pull:.1f} sigma"
        return f"{self.kind:16}{self.seed:8d}  {verdict}{names:24}{size:36}{pull}"


def one(kind: str, seed: int) -> Outcome:
    """Fly, listen, diagnose."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    duration = float(rng.uniform(180.0, 300.0))
    effects = tuple(KINDS[kind](rng, float(rng.uniform(0.3, 0.5) * duration)))
    flight = run(
        FlightSpec(
            vehicle="copter" if seed % 2 else "plane",
            seed=seed,
            duration=duration,
            imus=random_imus(seed),
            gps=PROMPT,
            effects=effects,
        )
    )
    calibrator = listened(flight)
    judge = examine(calibrator, 1)
    said = judge.diagnosis()
    six = list(numbers(judge, said, calibrator, flight))
    pulls = [np.abs(n.error) / np.sqrt(np.diag(n.covariance)) for n in six]
    told = [e.unknowns["offset"] for e in said.effects if "offset" in e.unknowns]
    size = (_largest(effects), told[0].value, told[0].sigma) if told else (np.nan,) * 3
    return Outcome(
        kind,
        seed,
        frozenset(effect.name for effect in effects),
        frozenset(effect.name for effect in said.effects),
        size,
        float(np.max(pulls, initial=0.0)),
        any(n.offered for n in six),
    )


def _largest(effects: Sequence[Effect]) -> float:
    """The largest velocity that is off at any moment, m/s; NaN without any."""
    faults = [effect for effect in effects if isinstance(effect, GpsFault)]
    at = [[f for f in faults if f.start <= begin.start < f.end] for begin in faults]
    sums = [np.hypot(sum(f.north for f in now), sum(f.east for f in now)) for now in at]
    return float(max(sums, default=np.nan))


def table(outcomes: Sequence[Outcome]) -> str:
    """A row for each kind."""
    rows = ["| kind | right | sizes off by, sigma | six past 3 sigma |", "|---|---|---|---|"]
    for kind in KINDS:
        mine = [o for o in outcomes if o.kind == kind]
        if not mine:
            continue
        sizes = np.array([o.size for o in mine])
        off = np.abs(sizes[:, 1] - sizes[:, 0]) / sizes[:, 2]
        off = off[np.isfinite(off)]
        worst = f"{off.max():.1f} at most" if len(off) else ""
        far = sum(o.pull > 3.0 for o in mine)
        offered = sum(o.pull > 3.0 and o.offered for o in mine)
        right = sum(o.right for o in mine)
        rows.append(f"| {kind} | {right} of {len(mine)} | {worst} | {far}, {offered} offered |")
    return "\n".join(rows)


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Errors of a receiver of every shape.")
    parser.add_argument("--first", type=int, default=70000, help="first seed")
    parser.add_argument("--count", type=int, default=4, help="seeds")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    chosen = parser.parse_args(arguments)
    prefer_compiled()
    outcomes = []
    for seed in range(chosen.first, chosen.first + chosen.count):
        for kind in chosen.kinds:
            outcomes.append(one(kind, seed))
            print(outcomes[-1].line(), flush=True)
    print(table(outcomes))


if __name__ == "__main__":
    main()
