"""What a concealed error has changed, number by number, and the tables of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from benchmarks.real.concealed_kind import Kind
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.result import SIX_NAMES

NEAR = 0.1
SIGMAS = 3.0


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
