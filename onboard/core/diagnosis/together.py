"""Effects that no flight shows by itself, asked of all flights of one sensor together.

What is wrong with a sensor, or with where things are on a vehicle, is so in every flight.  Where it
is too small to be found in any of them, it moves the six alike in each: their mean is as wrong as
each of them, while its sigma becomes less with every flight, and they agree.  So it is one
hypothesis for all flights.  What each says of the unknowns of an effect is added up,

    N = sum N_i + P^-1,    e = N^-1 sum N_i e_i,    gain = e^T N e,

and is scored once: no more of it than what explains flights by the size that the others ask for,
weakened by as much as they scatter about ``e`` beyond chance.  By the
odds of that, the mean is off by what the flights' own answers are off by, ``sum I_i J_i e`` over
``sum I_i``, with ``I_i`` what a flight knows of the six and ``J_i`` how the effect moves them
there, and known worse by what ``N`` leaves open of ``e`` (a mixture of models, as in
:mod:`~onboard.core.diagnosis.undecided`).
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
        if not _has_simpler(choice, c)
    )


def _has_simpler(choice: Choice, c: Candidate) -> bool:
    """Whether it is asked in a simpler form: flights that show less of it have that, too."""
    return any(o.effect == c.effect and len(o.index) < len(c.index) for o in choice.candidates)


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
        (known + known.T - 2.0 * np.diag(prior)) / (2.0 * variance),
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
    every: dict[str, list[tuple[Asked, Array]]] = {}
    for f in flights:
        for a in f.effects:
            every.setdefault(a.effect, []).append((a, f.six))
    known = np.diag(prior_sigma**-2.0)
    models = [model for told in every.values() if (model := _model(told, known)) is not None]
    # What is in every flight's model already stands in the way of nothing else.
    found = [(odds, m) for odds, m in models if np.any(m.moves)]
    each = shares(0.0, [odds for odds, _ in found])
    return [replace(m, share=share) for (_, m), share in zip(found, each, strict=True)]


def _model(told: Sequence[tuple[Asked, Array]], known: Array) -> tuple[float, Undecided] | None:
    """The logarithm of the odds of one effect, and its model with a share of one; None: hardly."""
    first = told[0][0]
    if any(len(a.vector) != len(first.vector) for a, _ in told):
        return None
    said = _Said(
        np.array([a.information for a, _ in told]),
        np.array([a.vector for a, _ in told]),
        np.array([a.prior for a, _ in told]),
    )
    N = said.information.sum(axis=0) + np.diag(first.prior)
    vector = said.vector.sum(axis=0)
    e = np.linalg.solve(N, vector)
    scatter = _scatter(said, e)
    gain = min(float(e @ vector), _elsewhere(said, N, vector)) / scatter
    odds = log_odds(surprise(gain, len(e)))
    if odds < log(HARDLY):
        return None
    moved = np.sum([six @ a.moves for a, six in told], axis=0)
    J = np.linalg.solve(np.sum([six for _, six in told], axis=0) + known, moved)
    wider = scatter * J @ np.linalg.solve(N, J.T)
    return odds, Undecided(first.effect, first.title, 1.0, J @ e, wider)


@dataclass(frozen=True, slots=True)
class _Said:
    """What n flights say of one effect: information (n, k, k), vector (n, k), prior (n, k)."""

    information: Array
    vector: Array
    prior: Array


def _elsewhere(said: _Said, N: Array, vector: Array) -> float:
    """What the effect explains of each flight with the size that the others ask for.

    It is no more evidence than that; twice the number of unknowns is given back, as
    :meth:`~onboard.core.diagnosis.candidates.Candidate.score` does within a flight.
    """
    e = np.linalg.solve(N - said.information, (vector - said.vector)[..., None])[..., 0]
    asks = 2.0 * np.sum(said.vector * e)
    return float(2.0 * len(vector) + asks - np.einsum("nj,njk,nk->", e, said.information, e))


def _scatter(said: _Said, e: Array) -> float:
    """By how much the flights' values scatter about ``e``, over what chance does; at least one."""
    if len(said.vector) < 2:
        return 1.0
    # In directions in which a flight knows nothing it has no value of its own.
    root = np.sqrt(np.maximum(said.prior, np.finfo(float).tiny))
    size, turned = np.linalg.eigh(said.information / (root[:, :, None] * root[:, None, :]))
    known = size > 1.0
    apart = np.einsum("njk,nj->nk", turned, said.vector / root)
    apart = apart / np.where(known, size, 1.0) - np.einsum("njk,nj->nk", turned, e * root)
    square = float(np.sum((size * apart**2)[known]))
    freedom = float(np.count_nonzero(known) - len(e))
    return max(1.0, square / freedom) if freedom > 0.0 else 1.0
