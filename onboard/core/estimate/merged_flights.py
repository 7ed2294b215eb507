"""Several flights of one accelerometer: what each says, whether they agree, what they say together.

Noise, timing, antenna and attitude errors are a flight's own: each flight is solved by itself, and
what is left of it for the others is a Gaussian of the six numbers, the prior taken out,

    N_i = P_i^-1 - P_0^-1,    b_i = N_i x_i,    x = (sum N_i + P_0^-1)^-1 (sum b_i + P_0^-1 x_0).

With equal noise that is the solution of all samples together.  What is the same error in all of
them, of covariance C_i that the flight itself does not tell, is left out of each, N (1 - C_i N)^-1,
and is an unknown u of all of them together: flight i is off by C_i^(1/2) u, of unit variance.  Who
has none of it tells it, as far as it knows the six.

*Agreement.*  Flights differ in directions that both of them know: those of the eigenvectors of
``P_a + P_b``, in units of the prior, whose eigenvalue is at most twice :data:`PRIOR_SHARE` squared.
Flight a is given values of its own in these directions, and shares the others, with their prior,
with b; what the separate values gain is chi-square with as many degrees of freedom as there are
such directions.  A set of flights is compared one by one, each with the sum of those before it: the
gains are independent and add up.  A set that scatters more than one in a thousand does by chance
contradicts itself.

*Who counts.*  The answer is about the sensor as it is after the last flight.  A consistent set
counts if it has that flight and at least one more, and if the flights left out are either all from
before it (the sensor may have changed since) or fewer than half (they erred).  If there is no such
set, or several of which none has the others in it, nobody can say which flights are right, and none
counts: of two flights neither.  Of many flights the sets of the last :data:`MOST_RECONCILED` are
looked for; those before count, the last of them first, up to one that contradicts the set.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import accumulate, combinations

import numpy as np

from onboard.core.estimate.joint import FLOOR, without_prior
from onboard.core.estimate.limits import (
    BY_CHANCE,
    MOST_ODD_FLIGHTS,
    MOST_RECONCILED,
    PRIOR_SHARE,
)
from onboard.core.estimate.result import Calibration
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import Array
from onboard.core.maths.chi_square import survival

KNOWN_ALIKE = 1.0 - 1e-6
"""Share of what is known of a number, at the most, that may be an error alike in all flights: what
is left of it must not be rounding [bound]."""


@dataclass(frozen=True, slots=True)
class FlightSix:
    """What one flight alone says of scale (1) and beta (m/s^2), sensor axes.

    Attributes:
        information: (6, 6) of its data, without prior and floor.
        vector: (6,) that times the values that the flight asks for.
        floored: (6, 6) the same with the floors in the sigmas: what is compared.
        floored_vector: (6,) what goes with it.
        alike: (6,) variances in what it says that are the same error in all flights of the sensor.
    """

    information: Array
    vector: Array
    floored: Array
    floored_vector: Array
    alike: Array = field(default_factory=lambda: np.zeros(6))

    def of_raw(self, applied: SixParameters) -> FlightSix:
        """The same of the raw sensor, if the samples were not raw but ``applied`` to it."""
        back = np.linalg.inv(raw_of(applied))
        return FlightSix(
            back.T @ self.information @ back,
            back.T @ self.vector,
            back.T @ self.floored @ back,
            back.T @ self.floored_vector,
            self.alike,  # of beta, which is the raw sensor's
        )

    @property
    def without_alike(self) -> tuple[Array, Array]:
        """Information (6, 6) and vector (6,) of what is known but for the error that is alike."""
        if not self.alike.any():
            return self.information, self.vector
        # Rounding must not let a flight know it better than it is alike.
        root = np.sqrt(self.alike)
        most = float(np.linalg.eigvalsh(self.information * np.outer(root, root))[-1])
        left = np.eye(6) - self.information * (self.alike * min(1.0, KNOWN_ALIKE / most))
        information: Array = np.asarray(np.linalg.solve(left, self.information), np.float64)
        vector: Array = np.asarray(np.linalg.solve(left, self.vector), np.float64)
        return information, vector


def raw_of(applied: SixParameters) -> Array:
    """(6, 6) scale and beta of the raw sensor, of those of samples with ``applied`` in them."""
    s, beta = np.array(applied.scale), applied.as_linear()[3:]
    return np.block([[np.diag(s), np.zeros((3, 3))], [np.diag(beta), np.eye(3)]])


@dataclass(frozen=True, slots=True)
class Prior:
    """What is known before any flight: (6,) scale and beta, and (6,) their sigmas."""

    center: Array
    sigma: Array


@dataclass(frozen=True, slots=True)
class Apart:
    """How far flights are from each other: chi-square and its degrees of freedom."""

    chi_square: float
    dof: int

    @property
    def p_value(self) -> float:
        """Probability of a larger chi-square; 1 where nothing can be compared."""
        return survival(self.chi_square, self.dof) if self.dof else 1.0

    @property
    def contradicted(self) -> bool:
        """Whether chance does not explain it."""
        return not self.p_value >= BY_CHANCE


@dataclass(frozen=True, slots=True)
class Reconciled:
    """Which of some flights count.

    Attributes:
        counted: indices of the flights that agree and count; empty if nobody can say.
        contradicted: indices of those that are named for a contradiction.
        apart: each flight against the others that count.  If none does: against all before the
            last one where these agree, else against all others.
        scatter: of all flights.
        earlier: the contradicted ones were all flown before those that count.
    """

    counted: tuple[int, ...]
    contradicted: tuple[int, ...]
    apart: tuple[Apart, ...]
    scatter: Apart
    earlier: bool


@dataclass(frozen=True, slots=True)
class Merged:
    """What flights say together, scale (1) and beta (m/s^2).

    Attributes:
        estimate: (6,) posterior.
        covariance: (6, 6) of it, without floor.
        information: (6, 6) of the flights alone.
        inflation: factor on the variance of all flights, at least 1: their scatter over its due.
    """

    estimate: Array
    covariance: Array
    information: Array
    inflation: float


def flight_six(c: Calibration, center: SixParameters | None = None) -> FlightSix | None:
    """What a flight says without its prior; None if it has no covariance.

    Args:
        c: its calibration.
        center: of its prior; None: the parameters in force.
    """
    six, P = np.array(c.scale + c.offset), c.with_its_gyroscope
    before = center or SixParameters(c.in_force_scale, c.in_force_offset)
    sigma = np.array(c.prior_sigma)
    found = [without_prior(c.imu, before, sigma, six, x) for x in (P - np.diag(FLOOR**2), P)]
    bare, floored = found
    if bare is None or floored is None:
        return None
    return FlightSix(
        bare.information,
        bare.vector + bare.information @ bare.before,
        floored.information,
        floored.vector + floored.information @ floored.before,
        np.square([0.0, 0.0, 0.0, *c.alike_sigma]),
    )


def merged(flights: Sequence[FlightSix], prior: Prior) -> Merged:
    """The flights (at least one) together, whether they agree or not.

    Where they scatter more than they should, as all of them could be by chance, their variances are
    taken to be larger by that factor, as it is done with the blocks of one flight.
    """
    scatter = scatter_of([_in_units(f, prior) for f in flights])
    inflation = max(1.0, scatter.chi_square / scatter.dof) if scatter.dof else 1.0
    information, vector = _together(flights, inflation)
    unit = prior.sigma
    inverse = np.linalg.inv(information * np.outer(unit, unit) + np.eye(6))
    change = inverse @ (unit * (vector - information @ prior.center))
    covariance = inverse * np.outer(unit, unit)
    return Merged(
        prior.center + unit * change, (covariance + covariance.T) / 2, information, inflation
    )


def _together(flights: Sequence[FlightSix], inflation: float) -> tuple[Array, Array]:
    """Information (6, 6) and vector (6,) of all, with what is alike in some of them unknown."""
    N, b, alike = np.zeros((12, 12)), np.zeros(12), False
    for f in flights:
        information, vector = f.without_alike
        of_both = np.hstack([np.eye(6), np.diag(np.sqrt(f.alike))])
        N += of_both.T @ information @ of_both / inflation
        b += of_both.T @ vector / inflation
        alike |= bool(f.alike.any())
    if not alike:
        return N[:6, :6], b[:6]
    # Its unit variance is beforehand, whatever the scatter of the flights is.
    told = np.linalg.solve(N[6:, 6:] + np.eye(6), np.column_stack([N[6:, :6], b[6:]]))
    return N[:6, :6] - N[:6, 6:] @ told[:, :6], b[:6] - N[:6, 6:] @ told[:, 6]


def reconciled(flights: Sequence[FlightSix], prior: Prior) -> Reconciled:
    """Which flights agree and count, and which are named for a contradiction.

    Args:
        flights: at least one, in the order in which they were flown.
        prior: of the six.
    """
    said = [_in_units(f, prior) for f in flights]
    every = tuple(range(len(said)))
    scatter = scatter_of(said)
    counted, since = (every, 0) if not scatter.contradicted else _counting(said)
    others = counted or every
    before = every[:-1]
    if not counted and len(before) > 1 and not scatter_of(said[:-1]).contradicted:
        others = before  # only the last one contradicts: it erred, or the sensor has changed
    apart = _each_against(said, others)
    if others != every or counted:
        odd = tuple(i for i in every if i >= since and i not in others)
    else:
        odd = tuple(i for i in every if apart[i].contradicted)
        odd = odd or (min(every, key=lambda i: apart[i].p_value),)
    earlier = bool(odd) and bool(counted) and max(odd) < min(counted)
    return Reconciled(counted, odd, apart, scatter, earlier)


@dataclass(frozen=True, slots=True)
class Normal:
    """Information (k, k) and vector (k,) in units of the prior, about its centre."""

    N: Array
    b: Array

    def __add__(self, other: Normal) -> Normal:
        """Both together."""
        return Normal(self.N + other.N, self.b + other.b)


def apart_of(a: Normal, b: Normal) -> Apart:
    """What separate values gain in the directions that both know."""
    one = np.eye(len(a.b))
    size, V = np.linalg.eigh(np.linalg.inv(a.N + one) + np.linalg.inv(b.N + one))
    both = size <= 2.0 * PRIOR_SHARE**2
    if not np.any(both):
        return Apart(0.0, 0)
    U, rest = V[:, both], V[:, ~both]
    shared = a.N + b.N + rest @ rest.T
    solved = np.linalg.solve(shared, np.column_stack([a.N @ U, a.b + b.b]))
    S = U.T @ a.N @ U - U.T @ a.N @ solved[:, :-1]
    s = U.T @ a.b - U.T @ a.N @ solved[:, -1]
    return Apart(float(s @ np.linalg.solve((S + S.T) / 2, s)), int(np.sum(both)))


def scatter_of(said: Sequence[Normal]) -> Apart:
    """Each with all before it, added up."""
    chi_square, dof = 0.0, 0
    so_far = said[0]
    for one in said[1:]:
        apart = apart_of(one, so_far)
        chi_square, dof = chi_square + apart.chi_square, dof + apart.dof
        so_far = so_far + one
    return Apart(chi_square, dof)


def _in_units(f: FlightSix, prior: Prior) -> Normal:
    b = f.floored_vector - f.floored @ prior.center
    return Normal(f.floored * np.outer(prior.sigma, prior.sigma), b * prior.sigma)


def _each_against(said: Sequence[Normal], others: Sequence[int]) -> tuple[Apart, ...]:
    """Each flight against the others without it."""
    nothing = Normal(np.zeros((6, 6)), np.zeros(6))
    those = [said[j] for j in others]
    before = list(accumulate(those, initial=nothing))
    after = list(accumulate(reversed(those), lambda a, b: b + a, initial=nothing))[::-1]
    place = {j: k for k, j in enumerate(others)}
    out = []
    for i, one in enumerate(said):
        k = place.get(i)
        rest = before[-1] if k is None else before[k] + after[k + 1]
        alone = len(others) == (0 if k is None else 1)
        out.append(Apart(0.0, 0) if alone else apart_of(one, rest))
    return tuple(out)


def _counting(said: Sequence[Normal]) -> tuple[tuple[int, ...], int]:
    """The one consistent set that counts, and since when flights were looked at.

    Empty if there is none, or no telling which.
    """
    since = max(0, len(said) - MOST_RECONCILED)
    last = said[since:]
    found: list[tuple[int, ...]] = []
    whole = [tuple(range(len(last)))] if since else []
    for chosen in (*whole, *_sets(len(last))):  # larger ones first
        within = any(set(chosen) <= set(larger) for larger in found)
        if not within and not scatter_of([last[i] for i in chosen]).contradicted:
            found.append(chosen)
    if len(found) != 1:
        return (), since
    counted = tuple(i + since for i in found[0])
    return _with_earlier(said, counted, since) if since else (counted, since)


def _with_earlier(
    said: Sequence[Normal], counted: tuple[int, ...], since: int
) -> tuple[tuple[int, ...], int]:
    """A set with the flights before it, up to one that contradicts it; up to which it was asked."""
    scatter = scatter_of([said[i] for i in counted])
    so_far = sum((said[i] for i in counted[1:]), start=said[counted[0]])
    while since:
        since -= 1
        apart = apart_of(said[since], so_far)
        scatter = Apart(scatter.chi_square + apart.chi_square, scatter.dof + apart.dof)
        if scatter.contradicted:
            break
        counted, so_far = (since, *counted), so_far + said[since]
    return counted, since


def _sets(count: int) -> Iterator[tuple[int, ...]]:
    """Sets with the last flight that may count, larger ones first, not all of them."""
    for left_out in range(1, count - 1):
        yield tuple(range(left_out, count))
        if 2 * left_out < count and left_out <= MOST_ODD_FLIGHTS:
            for odd in combinations(range(count - 1), left_out):
                if max(odd) >= left_out:
                    yield tuple(i for i in range(count) if i not in odd)
