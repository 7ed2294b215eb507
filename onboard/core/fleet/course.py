"""One number over the flights of a vehicle: does it drift, has it jumped, which flights are odd.

The value of flight k is

    y_k = a + b T_k + d t_k + sum_j s_j [k > k_j] + o_k + sigma_k e_k,

with the temperature ``T`` where the flights have one that differs, a drift ``d`` per day, steps
``s_j`` between flights and, of an odd flight, a value ``o_k`` of its own.  Which of drift, steps
and odd flights are in it is found one after the other: the candidate whose gain (what its column
takes from the weighted sum of squares ``chi2``) is least probable by chance, as the best of all of
its kind, is taken if it is too improbable.

*Chance.*  Claimed sigmas are as good as the noise model, and flights scatter for reasons that
nobody has modelled.  The variance factor is

    s^2 = max(1, (nu0 + chi2_1) / (nu0 + nu)),    F = (chi2_0 - chi2_1) / s^2,

``chi2_1`` with ``nu`` degrees of freedom that of the model with the candidate.  F is compared with
the square of Student's t of ``nu0 + nu`` degrees: exact if the factor scatters between vehicles as
scaled inverse chi-square with ``nu0``, on the safe side if the claims hold (the moderated t of
Smyth, *Statistical Applications in Genetics and Molecular Biology* 3, 2004).  With ``s^2 = 1`` it
is the likelihood ratio.  Its probability times the number of candidates of *all* numbers of the
vehicle (Bonferroni) is to be at most the false alarms allowed per vehicle.

A step needs two flights on either side; one alone is odd.  In whichever of two flights the fault
is, or whether the last one shows a sensor that has changed, nobody can say: they are named.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.fleet.limits import (
    BESIDE_STEP,
    CLAIM_DOF,
    FALSE_ALARM,
    FEWEST_WARM,
    LEAST_WARMTH_K,
    PLACE_CHI_SQUARE,
    SHORTEST_SPAN_D,
)
from onboard.core.maths.arrays import Array
from onboard.core.maths.student import two_sided

DRIFT, STEP, ODD = "drift", "step", "odd"


@dataclass(frozen=True, slots=True)
class Series:
    """One number of one vehicle, flights in order.

    Attributes:
        value: (n,) in its unit, finite.
        sigma: (n,) of it, above 0: what flights do not share.
        day: (n,) when it was flown, days; None where the flights do not say.
        temperature: (n,) degrees Celsius; None where the flights do not say.
    """

    value: Array
    sigma: Array
    day: Array | None = None
    temperature: Array | None = None


@dataclass(frozen=True, slots=True)
class Sized:
    """A number that was fitted: its size, its sigma, and the probability that chance does it."""

    size: float
    sigma: float
    p_value: float


@dataclass(frozen=True, slots=True)
class Step:
    """A jump after flight ``after``; ``first`` ... ``last`` are the places that fit nearly as well.

    ``after`` counts from 0: the flight after which the number is another one.
    """

    after: int
    first: int
    last: int
    sized: Sized


@dataclass(frozen=True, slots=True)
class OddFlight:
    """A flight that contradicts the others, and by how much it differs from them."""

    flight: int
    sized: Sized


@dataclass(frozen=True, slots=True)
class Course:
    """What is said of a series.

    Attributes:
        steps: in the order of the flights.
        odd: flights that contradict the others; of two flights that contradict each other, both.
        trend: drift per day beside the steps; None without dates or flights enough.
        drifts: the drift was asked for among the others, and it is not chance.
        warmth: slope on temperature, per K; None where it is not in the model.
        factor: of the claimed sigmas, at least 1: root of the variance factor ``s^2``.
        chi_square: weighted sum of squares that is left.
        dof: degrees of freedom of that.
        latest: the number at the last flight that is not odd, with its sigma.
        parts: (n,) which flights belong together: it counts up at each step.
    """

    steps: tuple[Step, ...]
    odd: tuple[OddFlight, ...]
    trend: Sized | None
    drifts: bool
    warmth: Sized | None
    factor: float
    chi_square: float
    dof: int
    latest: tuple[float, float]
    parts: tuple[int, ...]


def places(series: Series) -> int:
    """How many candidates a series has: drift, steps, odd flights."""
    return len(_candidates(series))


def follow(series: Series, looked_at: int = 0, false_alarm: float = FALSE_ALARM) -> Course:
    """Find drift, steps and odd flights of one number.

    Args:
        series: at least one flight.
        looked_at: candidates of all numbers of the vehicle (:func:`places`); 0: of this alone.
        false_alarm: probability that anything is said of a vehicle of which nothing is to be said.
    """
    candidates = _candidates(series)
    allowed = false_alarm / max(looked_at, len(candidates), 1)
    base = _base(series)
    taken: list[_Candidate] = []
    found: list[tuple[_Candidate, Sized, tuple[int, int]]] = []
    while left := [c for c in candidates if _addable(c, taken, len(series.value), base.shape[1])]:
        best = _best(series, base, taken, left)
        if best is None or not best[1].p_value <= allowed:
            break
        taken.append(best[0])
        found.append(best)
    return _course(series, base, found)


@dataclass(frozen=True, slots=True)
class _Candidate:
    kind: str
    place: int
    column: Array


def _candidates(series: Series) -> list[_Candidate]:
    n = len(series.value)
    out = []
    if (day := _days(series)) is not None and n > 2:
        out.append(_Candidate(DRIFT, -1, day))
    at = np.arange(n)
    out += [
        _Candidate(STEP, k, (at > k).astype(float)) for k in range(BESIDE_STEP - 1, n - BESIDE_STEP)
    ]
    if n > 1:
        # Of two flights that differ, either could be the odd one: one question, not two.
        out += [_Candidate(ODD, k, (at == k).astype(float)) for k in range(n if n > 2 else 1)]
    return out


def _addable(c: _Candidate, taken: Sequence[_Candidate], n: int, base: int) -> bool:
    """Whether there are flights enough for it, and most of them are still not odd."""
    odd = sum(t.kind == ODD for t in taken)
    enough = base + len(taken) < n
    return enough and all(c is not t for t in taken) and (c.kind != ODD or 2 * (odd + 1) < n + 1)


def _days(series: Series) -> Array | None:
    """Days since the middle of the flights; None where there is no span."""
    if series.day is None or np.ptp(series.day) < SHORTEST_SPAN_D:
        return None
    centred: Array = series.day - np.mean(series.day)
    return centred


def _base(series: Series) -> Array:
    """(n, 1 or 2): what is always in the model."""
    T, n = series.temperature, len(series.value)
    ones = np.ones((n, 1))
    if T is None or n < FEWEST_WARM or np.ptp(T) < LEAST_WARMTH_K:
        return ones
    return np.column_stack([ones, T - np.mean(T)])


def _best(
    series: Series, base: Array, taken: Sequence[_Candidate], left: Sequence[_Candidate]
) -> tuple[_Candidate, Sized, tuple[int, int]] | None:
    """The candidate with the largest gain, its size, and the range of its place."""
    n, w = len(series.value), 1.0 / series.sigma
    X = np.column_stack([base, *(c.column for c in taken)]) * w[:, None]
    C = np.column_stack([c.column for c in left]) * w[:, None]
    Q = np.linalg.qr(X)[0]
    y = series.value * w
    r = y - Q @ (Q.T @ y)
    own = C - Q @ (Q.T @ C)
    square = np.einsum("nm,nm->m", own, own)
    # What the model has already (a step beside two odd flights) takes nothing more from it.
    fresh = square > 1e-6 * np.einsum("nm,nm->m", C, C)
    if not np.any(fresh):
        return None
    along = own.T @ r
    gain = np.where(fresh, along**2 / np.where(fresh, square, 1.0), -1.0)
    nu = n - X.shape[1] - 1
    i = _choice(left, gain, float(r @ r), nu)
    factor = variance_factor(max(float(r @ r) - float(gain[i]), 0.0), nu)
    sigma = math.sqrt(factor / square[i])
    size = float(along[i] / square[i])
    sized = Sized(size, sigma, two_sided(abs(size) / sigma, CLAIM_DOF + nu))
    near = [
        c.place
        for c, g in zip(left, gain, strict=True)
        if c.kind == left[i].kind == STEP and g > gain[i] - PLACE_CHI_SQUARE * factor
    ]
    return left[i], sized, (min(near, default=left[i].place), max(near, default=left[i].place))


def _choice(left: Sequence[_Candidate], gain: Array, before: float, nu: int) -> int:
    """The least probable by chance: the best of each kind, for as many as there are of the kind."""
    chances = []
    for kind in (DRIFT, STEP, ODD):
        its = [i for i, c in enumerate(left) if c.kind == kind]
        if its:
            i = max(its, key=lambda i: float(gain[i]))
            factor = variance_factor(max(before - float(gain[i]), 0.0), nu)
            t = math.sqrt(max(float(gain[i]), 0.0) / factor)
            chances.append((len(its) * two_sided(t, CLAIM_DOF + nu), -float(gain[i]), i))
    return min(chances)[2]


def variance_factor(chi_square: float, nu: int) -> float:
    """``s^2``: of a weighted sum of squares with ``nu`` degrees of freedom, at least 1."""
    return max(1.0, (CLAIM_DOF + chi_square) / (CLAIM_DOF + nu))


@dataclass(frozen=True, slots=True)
class _Fit:
    theta: Array
    covariance: Array
    factor: float
    chi_square: float
    nu: int

    def sized(self, i: int) -> Sized:
        sigma = math.sqrt(max(float(self.covariance[i, i]), 0.0))
        p = two_sided(abs(float(self.theta[i])) / sigma, CLAIM_DOF + self.nu) if sigma else 1.0
        return Sized(float(self.theta[i]), sigma, p)


def _fit(series: Series, X: Array) -> _Fit | None:
    """Weighted least squares, sigmas with the variance factor; None if the columns are no basis."""
    w = 1.0 / series.sigma
    A = X * w[:, None]
    if np.linalg.matrix_rank(A / np.linalg.norm(A, axis=0)) < X.shape[1]:
        return None
    inverse = np.linalg.inv(A.T @ A)
    theta = inverse @ (A.T @ (series.value * w))
    left = series.value * w - A @ theta
    chi_square, nu = float(left @ left), len(series.value) - X.shape[1]
    factor = variance_factor(chi_square, nu)
    covariance: Array = np.multiply(inverse, factor, dtype=np.float64)
    return _Fit(theta, covariance, factor, chi_square, nu)


def _course(
    series: Series, base: Array, found: Sequence[tuple[_Candidate, Sized, tuple[int, int]]]
) -> Course:
    n = len(series.value)
    X = np.column_stack([base, *(c.column for c, _, _ in found)])
    fit = _fit(series, X)
    if fit is None:
        raise ArithmeticError("columns that are not independent")
    steps, odd = [], []
    for i, (c, sized, (first, last)) in enumerate(found):
        told = replace(fit.sized(base.shape[1] + i), p_value=sized.p_value)
        if c.kind == STEP:
            steps.append(Step(c.place, first, last, told))
        elif c.kind == ODD:
            odd.append(OddFlight(c.place, told))
    if n == 2 and odd:
        either = odd[0].sized
        odd.append(OddFlight(1, replace(either, size=-either.size)))
    steps.sort(key=lambda s: s.after)
    odd.sort(key=lambda o: o.flight)
    named = {o.flight for o in odd}
    last_one = max((k for k in range(n) if k not in named), default=n - 1)
    row = X[last_one].copy()
    row[1 : base.shape[1]] = 0.0  # at the mean temperature, as all others
    latest = float(row @ fit.theta), math.sqrt(max(float(row @ fit.covariance @ row), 0.0))
    parts = tuple(sum(s.after < k for s in steps) for k in range(n))
    drifts = any(c.kind == DRIFT for c, _, _ in found)
    return Course(
        steps=tuple(steps),
        odd=tuple(odd),
        trend=_trend(series, X),
        drifts=drifts,
        warmth=fit.sized(1) if base.shape[1] > 1 else None,
        factor=math.sqrt(fit.factor),
        chi_square=fit.chi_square,
        dof=fit.nu,
        latest=latest,
        parts=parts,
    )


def _trend(series: Series, X: Array) -> Sized | None:
    """The drift beside everything else that was found, whether it is chance or not."""
    day = _days(series)
    if day is None:
        return None
    rest = X[:, [not np.array_equal(column, day) for column in X.T]]
    if rest.shape[1] + 1 >= len(day):
        return None
    fit = _fit(series, np.column_stack([rest, day]))
    return None if fit is None else fit.sized(rest.shape[1])
