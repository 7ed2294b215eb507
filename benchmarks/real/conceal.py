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
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np

from benchmarks.real.concealed import KINDS, Kind, about
from benchmarks.real.flights import judged
from benchmarks.real.split import WHERE, RealFlight, available
from onboard.core.diagnosis.evidence import Judge
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.result import SIX_NAMES
from onboard.core.inputs.samples import Sample
from onboard.recordings.opening import open_recording

NEAR = 0.1
SIGMAS = 3.0
DRAWN = 7
"""Seed of the order in which flights and kinds are taken."""


@dataclass(frozen=True, slots=True)
class Said:
    """What the diagnosis said of one stream.

    Attributes:
        verdict: in a word.
        names: effects that were said.
        numbers: value and sigma by name, those of effects as ``effect.unknown``.
    """

    verdict: str
    names: frozenset[str]
    numbers: Mapping[str, tuple[float, float]]

    def values(self) -> dict[str, float]:
        """Without sigmas."""
        return {name: value for name, (value, _) in self.numbers.items()}


@dataclass(frozen=True, slots=True)
class Change:
    """One number: by how much it should have changed, and has."""

    name: str
    truth: float
    change: float
    sigma: float

    @property
    def recovered(self) -> bool:
        """Within ten per cent or three sigma."""
        return abs(self.change - self.truth) <= max(NEAR * abs(self.truth), SIGMAS * self.sigma)

    @property
    def near(self) -> bool:
        """Within ten per cent."""
        return abs(self.change - self.truth) <= NEAR * abs(self.truth)

    @property
    def seen(self) -> bool:
        """Whether the flight claims to know the number well enough to see it change."""
        return SIGMAS * self.sigma < abs(self.truth)


@dataclass(frozen=True, slots=True)
class Outcome:
    """One error in one flight.

    Attributes:
        flight: its name.
        kind: of error.
        wanted: names that may be said, the first of which must.
        before: verdict on the untouched flight.
        verdict: on the other.
        found: whether the wanted name was said; None where there is none.
        wrong: names that were said of it and should not.
        changes: of the numbers that it changes.
        moved: largest change of the six that should not have changed, in sigmas.
        why: nothing was measured, because.
    """

    flight: str
    kind: str
    wanted: tuple[str, ...]
    before: str = ""
    verdict: str = ""
    found: bool | None = None
    wrong: tuple[str, ...] = ()
    changes: tuple[Change, ...] = ()
    moved: float = float("nan")
    why: str = ""

    @property
    def recovered(self) -> bool:
        """Every number."""
        return bool(self.changes) and all(c.recovered for c in self.changes)

    @property
    def seen(self) -> bool:
        """Whether the first of the numbers is one that the flight claims to know."""
        return bool(self.changes) and self.changes[0].seen


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
    names = frozenset(e.name for e in diagnosis.effects)
    return Said(diagnosis.verdict.value, names, numbers)


def compared(
    flight: str, kind: Kind, before: Said, after: Said, truth: dict[str, float]
) -> Outcome:
    """What one error has changed.

    Args:
        flight: its name.
        kind: the error.
        before: without it.
        after: with it.
        truth: what its numbers should be with it.
    """
    changes = []
    for name, value in truth.items():
        old = before.numbers.get(name, (0.0, 0.0))[0]
        new, sigma = after.numbers.get(name, (0.0, 0.0))
        changes.append(Change(name, value - old, new - old, sigma))
    moved = max(
        abs(after.numbers[n][0] - before.numbers[n][0]) / after.numbers[n][1]
        for n in SIX_NAMES
        if n not in truth
    )
    return Outcome(
        flight,
        kind.name,
        kind.wanted,
        before.verdict,
        after.verdict,
        kind.wanted[0] in after.names if kind.wanted else None,
        tuple(sorted(after.names - before.names - set(kind.wanted) - {"empirical"})),
        tuple(changes),
        moved,
    )


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


def table(outcomes: Sequence[Outcome]) -> str:
    """Each outcome, then each kind."""
    lines = [
        f"{'flight':15}{'concealed':25}{'number':>12}{'truth':>8}{'found':>8}{'sigma':>7}  said"
    ]
    for o in outcomes:
        label = f"{o.flight.removeprefix('real-')[:14]:15}{o.kind[:24]:25}"
        if o.why:
            lines.append(f"{label}{o.why[:38]}")
            continue
        for i, c in enumerate(o.changes):
            mark = "ok" if c.recovered and c.seen else "wide" if c.recovered else "OFF"
            name = c.name.rsplit(".", maxsplit=1)[-1][:11]
            said_ = f"{mark} {_words(o)}" if i == 0 else mark
            lines.append(
                f"{label if i == 0 else '':40}{name:>12}{c.truth:8.3g}{c.change:8.3g}"
                f"{c.sigma:7.2g}  {said_}"
            )
    return "\n".join([*lines, "", kind_table(outcomes)])


def _words(o: Outcome) -> str:
    words = [] if o.found is None else ["found" if o.found else "missed"]
    words += [f"WRONG {n}" for n in o.wrong]
    if o.verdict == Verdict.INSUFFICIENT.value:
        words.append("(silent)")
    return " ".join(words)


def kind_table(outcomes: Sequence[Outcome]) -> str:
    """One line for each kind of error, and the whole."""
    head = (
        f"{'concealed':28}{'flights':>8}{'named':>9}{'wrong':>7}{'recovered':>11}"
        f"{'of seen':>10}{'silent':>8}"
    )
    done = [o for o in outcomes if not o.why]
    kinds = dict.fromkeys(o.kind for o in done)
    rows = [_row(name, [o for o in done if o.kind == name]) for name in kinds]
    return "\n".join([head, *rows, _row("all", done)])


def _row(label: str, some: Sequence[Outcome]) -> str:
    named = [o for o in some if o.wanted]
    seen = [o for o in some if o.seen]
    named_text = f"{sum(bool(o.found) for o in named)}/{len(named)}" if named else ""
    return (
        f"{label:28}{len(some):8}{named_text:>9}{sum(bool(o.wrong) for o in some):7}"
        f"{f'{sum(o.recovered for o in some)}/{len(some)}':>11}"
        f"{f'{sum(o.recovered for o in seen)}/{len(seen)}':>10}"
        f"{sum(o.verdict == Verdict.INSUFFICIENT.value for o in some):8}"
    )


LEGEND = """\
ok: recovered; wide: within three sigma of a claim that is too wide to see it; OFF: neither.
silent: the verdict is insufficient, and then no effect is named.  of seen: of those that the
flight claims to know well enough."""


def main(arguments: list[str] | None = None) -> None:
    """Conceal and print."""
    parser = argparse.ArgumentParser(description="Known errors put into real recordings.")
    parser.add_argument("--flights", nargs="*", default=[], help="of those for building")
    parser.add_argument("--kinds", nargs="*", default=[], help="words of their names")
    parser.add_argument("--limit", type=int, default=15, help="so many, fairly drawn; 0: all")
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args(arguments)
    flights = available("building", chosen.flights)
    if not flights:
        print(WHERE)
        return
    kinds = chosen_kinds(chosen.kinds)
    print(table(run(flights, kinds, limit=chosen.limit, jobs=chosen.jobs)))
    print(LEGEND)


if __name__ == "__main__":
    main()
