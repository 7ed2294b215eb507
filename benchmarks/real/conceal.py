"""Known errors put into real recordings: does the answer change by just that?

The truth is the *difference* between what a recording says with an error of
:mod:`~benchmarks.real.concealed` in it and what it says without: whatever else is wrong with the
flight is in both.  A change is *recovered* within 10 % or three sigma of the claim.  Where three
sigma are more than the change itself nothing could be expected; those that claim better are counted
apart, as *seen*.  An effect is *found* when it is said by its name, and a name is *wrong* that is
neither the effect's nor one that the untouched flight had.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from benchmarks.real.command import building
from benchmarks.real.concealed import KINDS
from benchmarks.real.concealed_kind import Kind, about
from benchmarks.real.flights import judged, told
from benchmarks.real.outcomes import LEGEND, Outcome, Said, compared, table
from benchmarks.real.split import RealFlight
from onboard.core.diagnosis.evidence import Judge
from onboard.core.estimate.result import SIX_NAMES
from onboard.core.inputs.samples import Sample
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
        "tilt_roll": 0.0,
        "tilt_pitch": 0.0,
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


def flown(flight: RealFlight, kinds: Sequence[Kind], imu: int = 1) -> list[Outcome]:
    """Every kind in one flight."""
    samples: list[Sample] = list(open_recording(flight.path).samples())
    try:
        ground = about(samples, imu)
        before = said(judged(samples, imu))
    except (ArithmeticError, LookupError, ValueError) as error:
        return [Outcome(flight.name, k.name, k.wanted, why=str(error)) for k in kinds]
    span = float(np.sqrt(max(before.numbers["window_squared"][0], 0.0)))
    ground = about(samples, imu, late=before.numbers["gps_delay"][0], window=span)
    out = []
    for kind in kinds:
        if not kind.applies(ground):
            out.append(Outcome(flight.name, kind.name, kind.wanted, why="does not apply"))
            continue
        told(f"{flight.name}: {kind.name}")
        try:
            after = said(judged(kind.lay(samples, ground), imu))
        except (ArithmeticError, LookupError, ValueError) as error:
            out.append(Outcome(flight.name, kind.name, kind.wanted, why=str(error)))
            continue
        truth = kind.truth(before.values(), ground)
        out.append(compared(flight.name, kind, before, after, truth))
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
