"""What effects that were almost found, or almost not, leave open about scale and offset.

Where an effect is at the edge of what counts as found, two models of the flight are likely, and
each gives the six with a sigma that knows nothing of the other: a curvature of the scale that was
just missed put the z scale of a plane ten sigma off.  The variance of a mixture is what its models
say, and what they differ by (Draper, 1995): one that knows a number worse has its share in that.

What counts as found is set by how seldom a false name may be said, which is not how likely an
effect is.  A score is twice a logarithm of a probability ``p`` by chance; at the most, such a ``p``
stands for odds of ``1 / (-e p ln p)`` (Sellke, Bayarri and Berger, 2001), here times those from
before the flight.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import exp, log

import numpy as np

from onboard.core.diagnosis.candidates import Candidate, believable
from onboard.core.diagnosis.forms import score_in_best_form
from onboard.core.diagnosis.hypotheses import Choice
from onboard.core.diagnosis.limits import CLEARLY, HARDLY, PRESENT
from onboard.core.diagnosis.selection import Fit, Fitter
from onboard.core.estimate.result import SIX_NAMES
from onboard.core.maths.accelerometer import SixParameters, parameters_jacobian
from onboard.core.maths.arrays import Array
from onboard.core.physics.effect import Effect


@dataclass(frozen=True, slots=True)
class Undecided:
    """A model that may be right instead of the one that was chosen.

    Attributes:
        effect: what it has that the reported one has not; or lacks, if that one has it.
        title: that in a short sentence.
        share: how likely it is, between 0 and 1.
        moves: (6,) by how much its scale (1) and beta (m/s^2) are larger.
        wider: (6, 6) by how much it knows them worse, covariance; in no direction negative.
    """

    effect: str
    title: str
    share: float
    moves: Array
    wider: Array


def undecided(choice: Choice, families: Sequence[Effect]) -> list[Undecided]:
    """The models next to the one that is reported.

    Args:
        choice: effects that were taken, and others that were not.
        families: those of the reported model.  What was taken and is not there was not needed by
            its own sums: it is one of the others again, unless something is there instead that was
            not to be chosen from, which has decided it.
    """
    kept = {f.effect for f in families}
    out = []
    for chosen in choice.chosen:
        if chosen.effect in kept:
            out += _in_the_place_of(choice, chosen)
    fitter, free, others = choice.fitter, choice.free, _others(choice)
    if kept <= {c.effect for c in choice.chosen}:
        dropped = [c for c in choice.chosen if c.effect not in kept]
        gone = {i for c in dropped for i in c.index}
        free, others = [i for i in free if i not in gone], [*others, *dropped]
    before = fitter.fit(free)
    for c, odds, after in _likely(fitter, free, before, others):
        out.append(_instead(fitter, c, 1.0 / (1.0 + exp(-odds)), before, after))
    return out


def in_words(
    models: Sequence[Undecided],
    six: SixParameters,
    claimed: Array,
    who: str = "This flight leaves",
) -> str:
    """Which of them most of the sigma of a number is about; empty if there is none.

    Args:
        models: that may be right instead.
        six: what is said.
        claimed: (6,) its variances.
        who: leaves it open.
    """
    jacobian = parameters_jacobian(six.as_linear())
    out = []
    for model in models:
        moves = jacobian @ model.moves
        share = model.share * moves**2 / claimed
        most = int(np.argmax(share))
        if share[most] > 0.5:  # most of it
            unit = "" if most < 3 else " m/s^2"
            way = "larger" if moves[most] > 0.0 else "smaller"
            out.append(
                f"{who} open whether {_clause(model.title)} ({model.effect}): the "
                f"other way the {SIX_NAMES[most]} would be {abs(moves[most]):.3f}{unit} {way}, "
                "which its sigma includes."
            )
    return " ".join(out)


def left_open(models: Sequence[Undecided]) -> Array:
    """(6, 6) what they add to the covariance of scale and beta."""
    out = np.zeros((6, 6))
    for model in models:
        out += model.share * (np.outer(model.moves, model.moves) + model.wider)
    return out


def _in_the_place_of(choice: Choice, chosen: Candidate) -> list[Undecided]:
    """Models without an effect that was chosen, or with another one in its place.

    Whether it is there is what its score says; which of two it is, what each explains.
    """
    fitter = choice.fitter
    rest = [i for i in choice.free if i not in chosen.index]
    before, with_it = fitter.fit(rest), fitter.fit(choice.free)
    own = log_odds(chosen.score(fitter, before, with_it))
    most = score_in_best_form(fitter, before, with_it, chosen)
    found = [(chosen, 0.0, before)]
    for c, _, fit in _likely(fitter, rest, before, _others(choice)):
        behind = most - score_in_best_form(fitter, before, fit, c)
        found.append((c, own - 0.5 * behind, fit))
    likely = shares(own, [odds for _, odds, _ in found])
    return [
        _instead(fitter, c, share, with_it, fit)
        for (c, _, fit), share in zip(found, likely, strict=True)
    ]


def _instead(fitter: Fitter, c: Candidate, share: float, reported: Fit, other: Fit) -> Undecided:
    """Another model than the reported one: what the six are there, and how well it knows them."""
    moves = other.theta[:6] - reported.theta[:6]
    here, there = (fitter.covariance(fit)[:6, :6] for fit in (reported, other))
    return Undecided(c.effect, _title(c), share, moves, beyond(there, here))


def beyond(larger: Array, smaller: Array) -> Array:
    """(n, n) what one covariance has beyond another, where it has more.

    In units of the smaller one, positive definite, so that scales and offsets may be compared.
    """
    L = np.linalg.cholesky(smaller)
    inverse = np.linalg.inv(L)
    size, turned = np.linalg.eigh(inverse @ (larger - smaller) @ inverse.T)
    more = L @ turned
    out: Array = (more * np.maximum(size, 0.0)) @ more.T
    return out


def shares(reported: float, others: Sequence[float]) -> list[float]:
    """How likely each of other models is, where one of all is right.

    Args:
        reported: logarithm of the odds of the model that is reported.
        others: of the others.
    """
    most = max((reported, *others))
    whole = exp(reported - most) + sum(exp(odds - most) for odds in others)
    return [exp(odds - most) / whole for odds in others]


def _title(c: Candidate) -> str:
    return c.effect if c.columns is None else c.columns.title


def _clause(title: str) -> str:
    """A sentence as a part of one: names keep their capitals."""
    return title if title[:2].isupper() else title[:1].lower() + title[1:]


def _others(choice: Choice) -> list[Candidate]:
    return [c for c in choice.candidates if c not in choice.chosen]


def _likely(
    fitter: Fitter, free: Sequence[int], before: Fit, some: Sequence[Candidate]
) -> Iterator[tuple[Candidate, float, Fit]]:
    """Candidates that could be there beside ``free``, their log odds, and the fits with them."""
    for c in some:
        if not c.new_beside(free):
            continue
        columns = [*free, *c.index]
        quick = fitter.fit(columns, held_out=False)
        if log_odds(c.score(fitter, before, quick)) < log(HARDLY):
            continue
        after = fitter.fit(columns)
        odds = log_odds(c.score(fitter, before, after))
        if (
            odds >= log(HARDLY)
            and believable(fitter, after, c)
            and c.margin(fitter, before, after) > CLEARLY
        ):
            yield c, odds, after


def log_odds(score: float) -> float:
    """Logarithm of the odds that an effect is there, at the most, by its score."""
    before, half = log(PRESENT / (1.0 - PRESENT)), 0.5 * score
    # From p = 1/e on, a probability speaks for chance.
    return before if half <= 1.0 else before + half - 1.0 - log(half)
