"""Effects that no flight shows by itself, asked of all flights of one sensor together.

What is wrong with a sensor, or with where things are on a vehicle, is so in every flight.  Where it
is too small to be found in any of them, it moves the six alike in each: their mean is as wrong as
each of them, while its sigma becomes less with every flight, and they agree.  So it is one
hypothesis for all flights.  What each says of the unknowns of an effect is added up,

    N = sum N_i + P^-1,    e = N^-1 sum N_i e_i,    gain = e^T N e,

and is scored once: no more of it than what explains flights by the size that the others ask for,
weakened by as much as they scatter about ``e`` beyond chance.  By the
odds of that, the mean is off by what the flights' own answers are off by, ``sum I_i J_i e`` over
``sum I_i``, with ``I_i`` what a flight knows of the six and ``J_i`` how the effect moves them there
(a mixture of models, as in :mod:`~onboard.core.diagnosis.undecided`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log

import numpy as np

from onboard.core.diagnosis.candidates import Candidate
from onboard.core.diagnosis.hypotheses import Choice
from onboard.core.diagnosis.limits import HARDLY
from onboard.core.diagnosis.score import surprise
from onboard.core.diagnosis.undecided import Undecided, log_odds, shares
from onboard.core.maths.arrays import Array


@dataclass(frozen=True, slots=True)
class Asked:
    """What one flight says of an effect, beside all else that was found in it.

    Attributes:
        effect: its name.
        title: in a short sentence.
        information: (k, k) of the flight's data on its unknowns.
        vector: (k,) that times the values that the flight asks for.
        prior: (k,) information of the prior about none of it.
        moves: (6, k) by how much scale (1) and beta (m/s^2) are larger with one of each; zero where
            the effect was found, and is in the flight's model.
    """

    effect: str
    title: str
    information: Array
    vector: Array
    prior: Array
    moves: Array

    def of_raw(self, T: Array) -> Asked:
        """The same where the six of the raw sensor are ``T`` (6, 6) times those of the flight."""
        return Asked(
            self.effect, self.title, self.information, self.vector, self.prior, T @ self.moves
        )


@dataclass(frozen=True, slots=True)
class Told:
    """A flight: what it says of effects, and what it knows of the six.

    ``six`` (6, 6) is zero for one that does not count in the mean.
    """

    effects: Sequence[Asked]
    six: Array


def asked_of(choice: Choice) -> tuple[Asked, ...]:
    """What a flight says of each effect that is the same in every flight."""
    return tuple(
        _asked(choice, c)
        for c in choice.candidates
        if c.columns is not None and not c.jump and not c.columns.of_flight
    )


def _asked(choice: Choice, c: Candidate) -> Asked:
    fitter, index = choice.fitter, list(c.index)
    rest = [i for i in choice.free if i not in c.index]
    fit = fitter.fit([*rest, *index], held_out=False)
    prior = fitter.prior_information[index]
    known = fitter.informed(fit, index)
    vector = known @ (fit.theta[index] - fitter.absent[index])
    variance = max(fitter.variance_along(fit, index)[0], 1.0)
    moves = np.zeros((6, len(index)))
    if c not in choice.chosen:
        moves = fitter.moved_by(rest, index)[:6]
    return Asked(
        c.effect,
        "" if c.columns is None else c.columns.title,
        (known - np.diag(prior)) / variance,
        vector / variance,
        prior,
        moves,
    )


def undecided_together(flights: Sequence[Told], prior_sigma: Array) -> list[Undecided]:
    """Effects that may be in all flights, how likely each is, and what it makes of their mean.

    Args:
        flights: at least one of which counts.
        prior_sigma: (6,) of what is known of the six beforehand.
    """
    names = dict.fromkeys(a.effect for f in flights for a in f.effects)
    known = np.diag(prior_sigma**-2.0)
    models = [model for name in names if (model := _model(name, flights, known)) is not None]
    # What is in every flight's model already stands in the way of nothing else.
    found = [(odds, m) for odds, m in models if np.any(m.moves)]
    each = shares(0.0, [odds for odds, _ in found])
    return [replace(m, share=share) for (_, m), share in zip(found, each, strict=True)]


def _model(name: str, flights: Sequence[Told], known: Array) -> tuple[float, Undecided] | None:
    """The logarithm of the odds of one effect, and its model with a share of one; None: hardly."""
    told = [(a, f.six) for f in flights for a in f.effects if a.effect == name]
    first = told[0][0]
    if any(len(a.vector) != len(first.vector) for a, _ in told):
        return None
    N = np.sum([a.information for a, _ in told], axis=0) + np.diag(first.prior)
    vector = np.sum([a.vector for a, _ in told], axis=0)
    e = np.linalg.solve(N, vector)
    every = [a for a, _ in told]
    gain = min(float(e @ vector), _elsewhere(every, N, vector)) / _scatter(every, e)
    moved = np.sum([six @ a.moves @ e for a, six in told], axis=0)
    moves = np.linalg.solve(np.sum([six for _, six in told], axis=0) + known, moved)
    odds = log_odds(surprise(gain, len(e)))
    if odds < log(HARDLY):
        return None
    return odds, Undecided(name, first.title, 1.0, moves)


def _elsewhere(told: Sequence[Asked], N: Array, vector: Array) -> float:
    """What the effect explains of each flight with the size that the others ask for.

    It is no more evidence than that; twice the number of unknowns is given back, as
    :meth:`~onboard.core.diagnosis.candidates.Candidate.score` does within a flight.
    """
    out = 2.0 * len(vector)
    for a in told:
        e = np.linalg.solve(N - a.information, vector - a.vector)
        out += float(2.0 * a.vector @ e - e @ a.information @ e)
    return out


def _scatter(told: Sequence[Asked], e: Array) -> float:
    """By how much the flights' values scatter about ``e``, over what chance does; at least one."""
    if len(told) < 2:
        return 1.0
    square, freedom = 0.0, -float(len(e))
    for a in told:
        # In directions in which a flight knows nothing it has no value of its own.
        root = np.sqrt(np.maximum(a.prior, np.finfo(float).tiny))
        size, turned = np.linalg.eigh(a.information / np.outer(root, root))
        known = size > 1.0
        own = turned[:, known].T @ (a.vector / root) / size[known]
        apart = own - turned[:, known].T @ (e * root)
        square += float(size[known] @ apart**2)
        freedom += float(np.count_nonzero(known))
    return max(1.0, square / freedom) if freedom > 0.0 else 1.0
