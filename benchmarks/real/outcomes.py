"""What a concealed error has changed, number by number, and the tables of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from benchmarks.real.concealed_kind import Kind
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.result import SIX_NAMES

SILENT = Verdict.INSUFFICIENT.value
NEAR = 0.1
SIGMAS = 3.0


@dataclass(frozen=True, slots=True)
class Said:
    """What the diagnosis said of one stream.

    Attributes:
        verdict: in a word.
        names: effects that were said.
        numbers: value and sigma by name, those of effects as ``effect.unknown``.
        blind: effects that the flight is said not to show.
        smallest: sizes from which what was not said would have been, by ``effect.unknown``.
    """

    verdict: str
    names: frozenset[str]
    numbers: Mapping[str, tuple[float, float]]
    blind: frozenset[str] = frozenset()
    smallest: Mapping[str, float] = field(default_factory=dict)

    def values(self) -> dict[str, float]:
        """Without sigmas."""
        return {name: value for name, (value, _) in self.numbers.items()}


@dataclass(frozen=True, slots=True)
class Change:
    """One number: by how much it should have changed, and has.

    Attributes:
        name: of the number.
        truth: by how much it should have changed.
        change: by how much it has.
        sigma: of the number as claimed; 0 if it was not said.
        told: whether it was said.
        hidden: it was not, and the flight was said not to show it.
    """

    name: str
    truth: float
    change: float
    sigma: float
    told: bool = True
    hidden: bool = False

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
        return SIGMAS * self.sigma < abs(self.truth) if self.told else not self.hidden


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
        effect = name.partition(".")[0]
        hidden = effect in after.blind or after.verdict == SILENT
        hidden = hidden or abs(value - old) < after.smallest.get(name, 0.0)
        # What a nuisance says of an effect that is not named has its prior in its sigma.
        told = name in after.numbers and (effect == name or effect in after.names)
        changes.append(Change(name, value - old, new - old, sigma, told, hidden=hidden))
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
    lines = [f"{'flight':14}{'concealed':22}{'number':>9}{'truth':>8}{'found':>8}{'sigma':>7} said"]
    for o in outcomes:
        lines += _lines(o)
    return "\n".join([*lines, "", kind_table(outcomes)])


def _lines(o: Outcome) -> list[str]:
    """One line for each number, one for names that were wrong."""
    label = f"{o.flight.removeprefix('real-')[:13]:14}{o.kind[:22]:22}"
    if o.why:
        return [f"{label} {o.why[:40]}"]
    out = []
    for i, c in enumerate(o.changes):
        mark = ("ok" if c.seen else "wide") if c.recovered else "OFF" if c.seen else "hid"
        name = c.name.rsplit(".", maxsplit=1)[-1][:8]
        words = "" if i or o.found is None else " found" if o.found else " missed"
        out.append(
            f"{'' if i else label:36}{name:>9}{c.truth:8.2g}{c.change:8.2g}{c.sigma:7.1g} "
            f"{mark}{words}"
        )
    said = [f"wrong: {', '.join(o.wrong)}"] if o.wrong else []
    said += [f"the six took it: {o.moved:.0f} sigma"] if o.moved > SIGMAS else []
    said += ["silent"] if o.verdict == SILENT else []
    if said:
        out.append(f"{'':36}  {'; '.join(said)}")
    return out


def kind_table(outcomes: Sequence[Outcome]) -> str:
    """One line for each kind of error, and the whole."""
    head = (
        f"{'concealed':27}{'flights':>8}{'named':>9}{'wrong':>7}{'recovered':>11}"
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
        f"{label:27}{len(some):8}{named_text:>9}{sum(bool(o.wrong) for o in some):7}"
        f"{f'{sum(o.recovered for o in some)}/{len(some)}':>11}"
        f"{f'{sum(o.recovered for o in seen)}/{len(seen)}':>10}"
        f"{sum(o.verdict == SILENT for o in some):8}"
    )


LEGEND = """\
ok: recovered.  wide: within three sigma of a claim that is too wide to see it.
hid: too little for the flight to show, as it says.  OFF: none of these.
silent: the verdict is insufficient, and then nothing is named.
of seen: of those that the flight claims, or does not deny, to know well enough."""
