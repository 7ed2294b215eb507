"""Known errors put into real recordings: does the answer change by just that?

The truth is the *difference* between what a recording says with an error of
:mod:`~benchmarks.real.concealed` in it and what it says without: whatever else is wrong with the
flight is in both.  An effect that only the other one has is therefore asked of the untouched
flight, too: the same unknowns, beside what that flight has by itself.

A change is *recovered* within 10 % or three sigma of the claim.  Where three sigma are more than
the change itself, or an effect that is not named would have had to be larger, nothing could be
expected; those that claim better are counted apart, as *seen*.  An effect is *found* when it is
said by its name, and a name is *wrong* that is neither the effect's nor one that the untouched
flight had.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np

from benchmarks.real.command import building
from benchmarks.real.concealed import KINDS
from benchmarks.real.concealed_kind import Array, Kind, about
from benchmarks.real.concealed_response import weighed
from benchmarks.real.flights import judged, told
from benchmarks.real.outcomes import LEGEND, SIGMAS, Outcome, Said, compared, table
from benchmarks.real.split import RealFlight
from onboard.core.diagnosis.evidence import Judge
from onboard.core.estimate.result import SIX_NAMES
from onboard.core.inputs.samples import Sample
from onboard.core.physics.effect import Effect
from onboard.core.physics.effects.bias_step import BiasStep
from onboard.recordings.opening import open_recording

DRAWN = 7
"""Seed of the order in which flights and kinds are taken."""


def said(judge: Judge) -> Said:
    """Names and numbers of a diagnosis."""
    diagnosis = judge.diagnosis()
    engine, c = judge.engine, judge.calibration
    solution, index = engine.found(), engine.model.index
    sigma = np.sqrt(np.diag(solution.covariance))
    six = zip(SIX_NAMES, c.scale + c.offset, c.scale_sigma + c.offset_sigma, strict=True)
    numbers = {name: (value, s) for name, value, s in six}
    origin = {
        "window_squared": engine.point.window**2,
        "heading": engine.point.heading,
        "tilt_roll": engine.point.tilt[0],
        "tilt_pitch": engine.point.tilt[1],
    }
    for name, at in origin.items():
        i = index.get(name)
        if i is not None:
            numbers[name] = (at + float(solution.theta[i]), float(sigma[i]))
    for name in ("gps_delay", "imu_delay"):
        timing = diagnosis.timing[f"{name}_s"]
        numbers[name] = (timing.value, timing.sigma)
    for effect in diagnosis.effects:
        for key, q in effect.unknowns.items():
            numbers.setdefault(f"{effect.name}.{key}", (q.value, q.sigma))
    for axis in "xyz":
        # Of an antenna that is not named, what the nuisance has found is what is there already.
        i = index.get(f"antenna_{axis}")
        if i is not None:
            place = (float(solution.theta[i]), float(sigma[i]))
            numbers.setdefault(f"gps_lever_arm.{axis}", place)
    names = frozenset(e.name for e in diagnosis.effects)
    blind = frozenset(n.name for n in diagnosis.not_testable)
    smallest = {f"{u.name}.{key}": x for u in diagnosis.unseen for key, x in u.smallest.items()}
    return Said(diagnosis.verdict.value, names, numbers, blind, smallest)


def response(untouched: Judge, fix_step: float) -> Array:
    """(2, K) how the receiver weighs what is around a fix, as the untouched flight says."""
    engine = untouched.engine
    found = engine.found()
    point = engine.asked(found.theta, found.covariance)
    return weighed(point.window, point.shapes, fix_step)


def headings(untouched: Judge) -> Array:
    """(2, K) times of fixes, s, and the vehicle's heading there, rad, as the flight says."""
    states = list(untouched.engine.states)
    return np.array([[s.t, np.arctan2(s.R_nb[1, 0], s.R_nb[0, 0])] for s in states]).T


def asked(untouched: Judge, other: Judge, effect: str) -> dict[str, tuple[float, float]]:
    """What the untouched flight says of an effect that was found in the other one only.

    A flight wanders by itself at that moment, along that axis, by less than it would say.  A jump
    that it has by itself at another moment is another one, beside which this one is asked about.
    """
    mine = [f for f in untouched.evidence.families if f.effect == effect]
    theirs = [f for f in other.evidence.families if f.effect == effect]
    more = [_of(untouched, f) for f in theirs if not any(alike(f, own) for own in mine)]
    if not more:
        return {}
    engine = untouched.engine.beside(more).with_rows()
    solution = engine.found()
    sigma = np.sqrt(np.diag(solution.covariance))
    return {
        f"{effect}.{key}": (float(solution.theta[i]), float(sigma[i]))
        for f in more
        for key, i in zip(f.keys, engine.indices(f), strict=False)
    }


def alike(one: Effect, other: Effect) -> bool:
    """Whether two effects of one name are the same: a jump, within three sigma of its moment."""
    if not (isinstance(one, BiasStep) and isinstance(other, BiasStep)):
        return True
    apart = abs(one.moment - other.moment)
    return apart <= SIGMAS * float(np.hypot(one.onset_sigma, other.onset_sigma))


def _of(untouched: Judge, effect: Effect) -> Effect:
    """A jump as the untouched flight's other accelerometers have seen it; others as they are."""
    if not isinstance(effect, BiasStep):
        return effect
    bare = BiasStep(untouched.final.origin).at(effect.moment)
    return untouched.evidence.companions.of(bare, untouched.imu)


def flown(flight: RealFlight, kinds: Sequence[Kind], imu: int = 1) -> list[Outcome]:
    """Every kind in one flight."""
    samples: list[Sample] = list(open_recording(flight.path).samples())
    try:
        ground = about(samples, imu)
        untouched = judged(samples, imu)
        before = said(untouched)
    except (ArithmeticError, LookupError, ValueError) as error:
        return [Outcome(flight.name, k.name, k.wanted, why=str(error)) for k in kinds]
    late = before.numbers["gps_delay"][0]
    ground = replace(
        ground,
        late=late,
        response=response(untouched, ground.fix_step),
        heading=headings(untouched),
    )
    out = []
    for kind in kinds:
        if not kind.applies(ground):
            out.append(Outcome(flight.name, kind.name, kind.wanted, why="does not apply"))
            continue
        told(f"{flight.name}: {kind.name}")
        try:
            other = judged(kind.lay(samples, ground), imu)
            after = said(other)
            same = asked(untouched, other, kind.wanted[0]) if kind.wanted else {}
        except (ArithmeticError, LookupError, ValueError) as error:
            out.append(Outcome(flight.name, kind.name, kind.wanted, why=str(error)))
            continue
        like = replace(before, numbers={**before.numbers, **same})
        truth = kind.truth(like.values(), ground)
        out.append(compared(flight.name, kind, like, after, truth))
    return out


def chosen_kinds(words: Sequence[str]) -> list[Kind]:
    """Kinds whose names hold one of the words; all without any.

    Raises:
        ValueError: a word that is in no name.
    """
    for word in words:
        if not any(word in k.name for k in KINDS):
            names = ", ".join(k.name for k in KINDS)
            raise ValueError(f"no kind with {word!r} in its name; there are {names}")
    return [k for k in KINDS if not words or any(w in k.name for w in words)]


def run(
    flights: Sequence[RealFlight], kinds: Sequence[Kind], *, limit: int = 0, jobs: int = 1
) -> list[Outcome]:
    """Every kind in every flight, or ``limit`` of them, drawn once and for all; 0: no limit."""
    both = [(f, k.name) for f in flights for k in kinds]
    order = np.random.default_rng(DRAWN).permutation(len(both))
    taken = {both[i] for i in (order[:limit] if limit else order)}
    work = [(f, [k.name for k in kinds if (f, k.name) in taken]) for f in flights]
    work = [(f, names) for f, names in work if names]
    if jobs <= 1:
        return [o for f, names in work for o in _worked(f, names)]
    with ProcessPoolExecutor(max_workers=jobs) as pool:
        return [o for some in pool.map(_worked, *zip(*work, strict=True)) for o in some]


def _worked(flight: RealFlight, names: Sequence[str]) -> list[Outcome]:
    """In a process of its own: kinds have functions, which do not travel."""
    return flown(flight, [k for k in KINDS if k.name in names])


def main(arguments: list[str] | None = None) -> None:
    """Conceal and print."""
    parser = argparse.ArgumentParser(description="Known errors put into real recordings.")
    parser.add_argument("--kinds", nargs="*", default=[], help="words of their names")
    parser.add_argument("--limit", type=int, default=15, help="so many, fairly drawn; 0: all")
    chosen, flights = building(parser, arguments)
    if flights:
        kinds = chosen_kinds(chosen.kinds)
        print(table(run(flights, kinds, limit=chosen.limit, jobs=chosen.jobs)))
        print(LEGEND)


if __name__ == "__main__":
    main()
