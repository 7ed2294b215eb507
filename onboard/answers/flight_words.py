"""How several flights agree or contradict each other, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.answers.answer import FlightAnswer
from onboard.core.estimate.merged_flights import Reconciled
from onboard.core.physics.wording import listed


def agreement(answers: Sequence[FlightAnswer], found: Reconciled) -> str:
    """Of how many flights the answer is, and what was left out because it contradicts them."""
    counted = [f.name for f in answers if f.counted]
    said = (
        f"of {len(counted)} flights that agree, each with its own noise and timing."
        if len(counted) > 1
        else f"of one flight, {counted[0]}."
    )
    odd = [f for f in answers if f.contradicted]
    if not odd:
        return said
    verb = "contradicts" if len(odd) == 1 else "contradict"
    why = (
        "it erred, or the sensor has changed since: the later flights count"
        if found.earlier
        else "left out"
    )
    return f"{said} {_named(odd)} {verb} the others: {why}."


def contradiction(answers: Sequence[FlightAnswer], found: Reconciled) -> str:
    """Which flights contradict each other, where nobody can say which of them are right."""
    odd = [f for f in answers if f.contradicted]
    if len(odd) == 1:
        return (
            f"{_named(odd)} contradicts the flights before it: it erred, or the sensor has "
            "changed, and nobody can say which: nothing is averaged over them; fly once more"
        )
    p = found.scatter
    return (
        f"{_named(odd)} contradict each other (all flights: chi-square {p.chi_square:.0f} of "
        f"{p.dof}), and nobody can say which is right: nothing is averaged over them; fly once more"
    )


def _named(odd: Sequence[FlightAnswer]) -> str:
    return listed([f"{f.name} (chi-square {f.apart.chi_square:.0f} of {f.apart.dof})" for f in odd])


def others(answers: Sequence[FlightAnswer]) -> str:
    """Which flights do not count for another reason than a contradiction."""
    left = left_out([f for f in answers if not f.contradicted])
    return f"Not counted: {left}." if left else ""


def left_out(answers: Sequence[FlightAnswer]) -> str:
    """Flights that do not count, each with the reason."""
    return "; ".join(f"{f.name}: {f.why}" for f in answers if not f.counted and f.why)
