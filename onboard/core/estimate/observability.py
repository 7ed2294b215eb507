"""What a flight can and cannot tell about the calibration parameters, in percent and in words.

Input is the information that the data alone give (the 6x6 Schur complement of the sums) and
what was known before (prior sigmas).  A number counts as observed when its posterior sigma
has come down to what is needed, *and* to half of the prior: one that the prior alone would
satisfy is not observed by the flight.

Two numbers that only show up together come out strongly correlated.  They are found from the
correlations, not from the eigenvectors of the whole matrix: where several directions are
equally unknown, eigenvectors mix them at will and would couple axes that have nothing to do
with each other.  The eigenvector *within* a coupled group then says which combination it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from onboard.core.estimate.limits import COUPLED, PRIOR_SHARE
from onboard.core.estimate.result import SIX_NAMES, Coverage, SixFlags
from onboard.core.maths.arrays import Array

_ROUNDING: Final = 1e-9  # sigma and target may agree exactly


@dataclass(frozen=True, slots=True)
class Needs:
    """Sigmas of scale (-) and offset (m/s^2), per axis alike: known before, and needed."""

    prior_scale: float = 0.03
    prior_offset: float = 0.5
    scale: float = 0.01
    offset: float = 0.05

    @property
    def prior(self) -> Array:
        """(6,) prior sigmas, in the order of SIX_NAMES."""
        return np.repeat([self.prior_scale, self.prior_offset], 3)

    @property
    def target(self) -> Array:
        """(6,) sigmas at which a number counts as observed."""
        needed = np.repeat([self.scale, self.offset], 3)
        result: Array = np.minimum(needed, PRIOR_SHARE * self.prior)
        return result


@dataclass(frozen=True, slots=True)
class WeakDirection:
    """One number, or one combination of coupled numbers, that the flight does not support.

    ``members`` index SIX_NAMES; ``weights`` are the combination in units of the sigmas needed,
    length 1, the largest positive; ``excess`` is its sigma over the needed one.
    """

    members: tuple[int, ...]
    weights: tuple[float, ...]
    excess: float
    sentence: str
    advice: str


@dataclass(frozen=True, slots=True)
class Observability:
    """What the flight supports; ``weak`` has the worst direction first."""

    observed: SixFlags
    coverage: Coverage
    weak: tuple[WeakDirection, ...]
    sigma: tuple[float, ...]

    @property
    def note(self) -> str:
        """All that is weak, as sentences for a person; empty if nothing is."""
        longer = [i for w in self.weak if w.advice == _LONGER for i in w.members]
        rest = [w for w in self.weak if w.advice != _LONGER]
        said = [f"{w.sentence}: {w.advice}." for w in rest]
        if longer:
            verb = "is" if len(longer) == 1 else "are"
            said.append(f"{_listed(sorted(longer))} {verb} not known well enough: {_LONGER}.")
        return " ".join(said)


def assess(information: ArrayLike, needs: Needs = Needs(), kind: str = "") -> Observability:
    """Judge an information matrix.

    Args:
        information: (6, 6) of (scale x, y, z, offset x, y, z) from the data alone, without
            prior.  Need not be regular; negative eigenvalues (from noise corrections) count
            as none, and a matrix that is not finite as no information.
        needs: Prior and needed sigmas.
        kind: Of vehicle (copter, plane, rover, boat), for what to fly; empty: not known.

    Returns:
        Flags, coverage in percent, weak directions.
    """
    covariance = posterior_covariance(information, needs.prior)
    sigma = np.sqrt(np.diag(covariance))
    # Rounded, so that axes that are weak alike come in their own order on every machine.
    excess = np.round(sigma / needs.target, 6)
    observed = sigma <= needs.target * (1 + _ROUNDING)
    percent = _percent(sigma, needs)
    weak = _weak_directions(covariance, needs.target, observed, kind)
    worst = int(np.argmax(excess))
    # Percent saturates at both ends; excess goes on to tell the better from the worse.
    coverage = Coverage(
        percent=float(percent.min()),
        per_parameter=_six(percent),
        weakest=SIX_NAMES[worst],
        advice=next((w.advice for w in weak if worst in w.members), ""),
    )
    flags = tuple(bool(flag) for flag in observed)
    return Observability(
        observed=(flags[0], flags[1], flags[2], flags[3], flags[4], flags[5]),
        coverage=coverage,
        weak=weak,
        sigma=_six(sigma),
    )


def posterior_covariance(information: ArrayLike, prior: ArrayLike) -> Array:
    """(6, 6) inverse of information plus prior, for any symmetric information.

    Done in units of the prior sigmas, where the prior is the identity: an eigenvalue of the
    information there is how many times better than the prior the data know that direction.

    Args:
        information: (n, n); only its symmetric, positive part counts.
        prior: (n,) sigmas, finite and positive.
    """
    S = np.asarray(prior, dtype=np.float64)
    N = np.asarray(information, dtype=np.float64)
    if not np.all(np.isfinite(N)):
        N = np.zeros_like(N)
    scaled = S[:, None] * (0.5 * (N + N.T)) * S
    eigenvalues, V = np.linalg.eigh(scaled)
    inverse = (V / (1 + np.maximum(eigenvalues, 0))) @ V.T
    result: Array = S[:, None] * inverse * S
    return result


def _percent(sigma: Array, needs: Needs) -> Array:
    """0 at the prior's sigma, 100 at the target, by the logarithm: halving counts alike."""
    gained = np.log(needs.prior / sigma) / np.log(needs.prior / needs.target)
    percent: Array = np.clip(100 * gained, 0, 100)
    return np.where(sigma <= needs.target * (1 + _ROUNDING), 100.0, percent)


def _six(values: Array) -> tuple[float, float, float, float, float, float]:
    a, b, c, d, e, f = values.tolist()
    return (a, b, c, d, e, f)


def _weak_directions(
    covariance: Array, target: Array, observed: NDArray[np.bool_], kind: str
) -> tuple[WeakDirection, ...]:
    C = covariance / np.outer(target, target)
    correlation = C / np.sqrt(np.outer(np.diag(C), np.diag(C)))
    directions = []
    for group in _groups(np.abs(correlation) >= COUPLED, ~observed):
        eigenvalues, V = np.linalg.eigh(C[np.ix_(group, group)])
        v = V[:, -1]
        v = v * np.sign(v[np.argmax(np.abs(v))])
        sentence, advice = describe(group, kind)
        directions.append(
            WeakDirection(
                members=group,
                weights=tuple(v.tolist()),
                excess=round(float(np.sqrt(eigenvalues[-1])), 6),
                sentence=sentence,
                advice=advice,
            )
        )
    return tuple(sorted(directions, key=lambda d: (-d.excess, d.members)))


def _groups(coupled: NDArray[np.bool_], wanted: NDArray[np.bool_]) -> list[tuple[int, ...]]:
    """Connected components of ``coupled`` among the ``wanted`` indices, each sorted."""
    left = {int(i) for i in np.flatnonzero(wanted)}
    groups = []
    while left:
        group, frontier = set(), {min(left)}
        while frontier:
            group |= frontier
            frontier = {j for i in frontier for j in left if coupled[i, j]} - group
        left -= group
        groups.append(tuple(sorted(group)))
    return groups


_CHANGE_FORCE: Final[Mapping[str, tuple[str, str, str]]] = MappingProxyType(
    {
        "copter": (
            "fly fast forward and backward, and brake hard each time",
            "fly fast to the left and to the right, and brake hard each time",
            "climb and descend fast, and fly banked turns at speed",
        ),
        "plane": (
            "change between full and idle throttle, climbing and descending",
            "sideslip to both sides",
            "fly steep banked turns and pull-ups, so that the load factor changes",
        ),
        "rover": (
            "accelerate and brake hard, several times",
            "turn tightly at speed, to both sides",
            "drive fast up and down slopes",
        ),
        "boat": (
            "accelerate and slow down hard, several times",
            "turn tightly at speed, to both sides",
            "cross waves at speed",
        ),
    }
)
"""By kind of vehicle and axis: what changes the specific force along it and so tells scale from
offset."""
_OTHER_KIND: Final = (
    "accelerate and brake hard, several times, nose up and nose down",
    "accelerate hard to both sides",
    "change the load factor: steep banked turns, pull-ups, fast climbs and descents",
)
_ROLL_OVER_HEADINGS: Final = "fly level legs on different headings, with turns both ways"
_LONGER: Final = "fly on with GPS trusted, and turn through all headings"


def describe(members: tuple[int, ...], kind: str = "") -> tuple[str, str]:
    """(what cannot be told, what to fly) for a group of numbers, indices into SIX_NAMES."""
    change = _CHANGE_FORCE.get(kind, _OTHER_KIND)
    names = [SIX_NAMES[i] for i in members]
    axes = sorted({i % 3 for i in members})
    scales = [i for i in members if i < 3]
    if len(members) == 1:
        (index,) = members
        if index < 3:
            return f"{names[0]} is not excited enough", change[index]
        return f"{names[0]} is not known well enough", _LONGER
    sentence = f"{_listed(members)} cannot be told apart"
    if not scales:
        return sentence, _ROLL_OVER_HEADINGS
    return sentence, "; ".join(change[axis] for axis in axes)


def _listed(members: Sequence[int]) -> str:
    """``x offset``; ``x offset and y offset``; with commas where there are more."""
    names = [SIX_NAMES[i] for i in members]
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
