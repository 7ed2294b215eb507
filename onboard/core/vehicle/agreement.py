"""Whether flights of one vehicle tell one airframe, and which of them count.

Each flight is fitted by itself and says what it knows of the unknowns that are the vehicle's
(:mod:`onboard.core.vehicle.said`); air, battery and what a calibration left are a flight's own, and
so is what is only estimated beside the effects.  Two flights whose chi-square
(:mod:`onboard.core.vehicle.apart`) is rarer by chance than :data:`FALSE_ALARM`, divided by the
number of pairs, contradict each other.

Where there are enough flights to tell by how much flights differ, that is in the sigmas of all
(:func:`onboard.core.vehicle.inflation.inflation_of`): then only those contradict each other that do
beyond what most of them differ by.

The answer is about the first flight.  What contradicts it is set aside; of the others that
contradict each other those with the most contradictions, until none is left: of two nobody can
say which is right, and neither counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.medians import MEDIAN_SQUARE
from onboard.core.vehicle.apart import Apart, apart_of
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.limits import FALSE_ALARM, FEWEST_FLIGHTS
from onboard.core.vehicle.matching import Matched
from onboard.core.vehicle.records import Aside, Compared, VehicleMatch
from onboard.core.vehicle.said import NOTHING, Key, Said, said_of
from onboard.core.vehicle.several import of_parts
from onboard.core.vehicle.wind_record import wind_of


@dataclass(frozen=True, slots=True)
class Agreement:
    """Which flights count, by number, and why the others do not."""

    counted: tuple[int, ...]
    aside: tuple[Aside, ...] = ()


@dataclass(frozen=True, slots=True)
class ToldAlone:
    """What each of several flights tells by itself, and which of them count; of one, nothing.

    ``found`` is None for a flight in which nothing can be found.
    """

    found: tuple[Matched | None, ...]
    agreement: Agreement

    @property
    def of_counted(self) -> list[Matched]:
        """Of the flights that count."""
        return [m for k in self.agreement.counted if k < len(self.found) and (m := self.found[k])]

    def counting(self, flight: Flight) -> Flight:
        """The flights that count, of all."""
        return of_parts(flight, self.agreement.counted)

    def sigmas(self, force_sigma: Array) -> Array:
        """(parts, 3) of the flights that count, of all (or of one, (3,))."""
        out: Array = np.atleast_2d(force_sigma)[list(self.agreement.counted)]
        return out

    def beside(self, match: VehicleMatch) -> VehicleMatch:
        """The match of those that count with what is set aside, which it does not explain."""
        if not self.agreement.aside:
            return match
        counted = self.agreement.counted
        winds = [
            match.other_winds[counted.index(k) - 1] if k in counted else wind_of(m)
            for k, m in enumerate(self.found)
            if k and m is not None
        ]
        aside = self.agreement.aside
        note = "; ".join(s for s in (*map(aside_sentence, aside), match.note) if s)
        return replace(match, other_winds=tuple(winds), aside=aside, explained=False, note=note)


def told_alone(
    flight: Flight, force_sigma: Array, find: Callable[[Flight, Array], Matched | None]
) -> ToldAlone:
    """Each flight by itself, and whether they agree.

    Args:
        flight: of one recording, or of several.
        force_sigma: (3,) or (parts, 3) what the sensor level leaves unknown of the force, m/s^2.
        find: of one flight and its (1, 3).
    """
    if flight.parts == 1:
        return ToldAlone((), Agreement((0,)))
    sigmas = np.atleast_2d(force_sigma)
    found = tuple(find(of_parts(flight, [k]), sigmas[[k]]) for k in range(flight.parts))
    return ToldAlone(
        found, agreement_of([(NOTHING,) if m is None else said_of(m.fit) for m in found])
    )


def agreement_of(forms: Sequence[Sequence[Said]]) -> Agreement:
    """Which of some flights tell one airframe with the first.

    Args:
        forms: of each flight, what it says of its vehicle; one in which the vehicle became another
            says it of either.
    """
    numbers = range(len(forms))
    if len(forms) >= FEWEST_FLIGHTS:
        forms = _scattered(forms)
    pairs = list(combinations(numbers, 2))
    level = FALSE_ALARM / max(len(pairs), 1)
    apart = {(i, j): _nearest_forms(forms[i], forms[j], level) for i, j in pairs}
    odd = {pair for pair, (a, _, _) in apart.items() if not a.by_chance(level)}
    counted = _counting(len(forms), odd)
    aside = []
    for number in numbers:
        if number not in counted:
            i, j = next(p for p in sorted(odd) if number in p)
            a, first, second = apart[i, j]
            aside.append(
                _aside(number, i if number == j else j, a, (first, second), turned=number == i)
            )
    return Agreement(counted, tuple(aside))


def _nearest_forms(
    ours: Sequence[Said], theirs: Sequence[Said], level: float
) -> tuple[Apart, Said, Said]:
    """The two forms of two flights that are nearest to each other."""
    every = [(apart_of(a, b, level), a, b) for a in ours for b in theirs]
    return min(every, key=lambda x: x[0].chi_square)


def _scattered(forms: Sequence[Sequence[Said]]) -> list[list[Said]]:
    """The same with sigmas that have what most of the flights differ by besides.

    By the median of the differences of all pairs, a few of which may be of another vehicle
    (P. J. Rousseeuw and C. Croux, *J. Am. Stat. Assoc.* 88, 1993).
    """
    squares: dict[Key, float] = {}
    first = [its[0] for its in forms]
    for key in dict.fromkeys(key for said in first for key in said.keys):
        told = [said.of([key]) for said in first if key in said.keys]
        values = np.array([x.item() for x, _ in told])
        variances = np.array([v.item() for _, v in told])
        i, j = np.triu_indices(len(told), 1)
        if len(i):
            apart = np.median((values[i] - values[j]) ** 2) / MEDIAN_SQUARE
            due = np.median(variances[i] + variances[j])
            squares[key] = max(float(apart - due), 0.0) / 2.0

    def scattered(said: Said) -> Said:
        more = np.diag([squares.get(key, 0.0) for key in said.keys])
        return replace(said, covariance=said.covariance + more)

    return [[scattered(said) for said in its] for its in forms]


def _counting(count: int, odd: set[tuple[int, int]]) -> tuple[int, ...]:
    """Those that contradict neither the first nor each other."""
    left = [k for k in range(count) if (0, k) not in odd]
    while True:
        often = {k: sum((min(k, j), max(k, j)) in odd for j in left) for k in left}
        most = max(often.values())
        if not most:
            return tuple(left)
        left = [k for k in left if often[k] < most]


def _aside(
    number: int, against: int, apart: Apart, said: tuple[Said, Said], *, turned: bool
) -> Aside:
    """The record of a flight that is set aside; ``said`` by both, its own first if ``turned``."""
    key = apart.worst or ("", "")
    ours, theirs = said if turned else said[::-1]
    mass = None
    if apart.masses is not None:
        log_ratio, sigma = apart.masses
        ratio = math.exp(-log_ratio if turned else log_ratio)
        mass = Compared(1.0, ratio, ratio * sigma, "1")
    its, their = ours.numbers(key), theirs.numbers(key)
    # A ballistic coefficient of what has no drag is no number.
    name = next(n for n in its if math.isfinite(its[n].sigma + their[n].sigma))
    return Aside(number, against, key[0], name, its[name], their[name], mass)


def aside_sentence(a: Aside) -> str:
    """What a person is told of a flight that is set aside; flights are counted from one."""
    said = f"flight {a.number + 1} contradicts flight {a.against + 1} and was set aside: "
    if a.mass is not None:
        way = "heavier" if a.mass.real > 1.0 else "lighter"
        size, sigma = 100.0 * abs(a.mass.real - 1.0), 100.0 * a.mass.sigma
        return f"{said}it flew {size:.1f} +-{sigma:.1f} % {way}, and nothing else differs"
    unit = "" if a.its.unit == "1" else f" {a.its.unit}"
    its, theirs = (_number(x) for x in (a.its, a.theirs))
    return f"{said}{a.name} ({a.shown}) is {its} in it, and {theirs}{unit} there"


def _number(x: Compared) -> str:
    digits = max(1 - math.floor(math.log10(x.sigma)), 0) if x.sigma > 0.0 else 3
    return f"{x.real:.{digits}f} +-{x.sigma:.{digits}f}"
