"""How far two flights of a vehicle are from each other, and whether it is another mass.

They are compared in the directions that both know, those of the eigenvectors of the sum of their
covariances in plausible sizes (as :mod:`onboard.core.estimate.merged_flights` does).  Vehicles that
differ by no more than matters are the same: chi-square is that from the nearest point of the box of
the unknowns' floors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.chi_square import survival
from onboard.core.vehicle.limits import ANOTHER_MASS, TESTABLE
from onboard.core.vehicle.said import DIFFERENCE, Key, Said

SWEEPS = 200
"""Of the descent to the nearest point of a box, one unknown after the other [cost]."""
TURNS = 10
"""Newton steps to a mass [cost]."""


@dataclass(frozen=True, slots=True)
class Apart:
    """Two flights: chi-square, its degrees of freedom, and the unknown that differs most.

    ``masses`` are the logarithm of the second's over the first's, and its sigma, if another mass is
    all that differs; else None.
    """

    chi_square: float
    dof: int
    worst: Key | None = None
    masses: tuple[float, float] | None = None

    def by_chance(self, level: float) -> bool:
        """Whether so much is no rarer than this."""
        return not self.dof or survival(self.chi_square, self.dof) >= level


def apart_of(a: Said, b: Said, level: float) -> Apart:
    """How far two flights are from each other."""
    keys = [key for key in a.keys if key in b.keys]
    if not keys:
        return Apart(0.0, 0)
    (x, P), (y, Q) = a.of(keys), b.of(keys)
    found = _apart(a, keys, y - x, P + Q)
    if found.by_chance(level) or found.dof < 2:
        return found
    masses = _masses(a, keys, (x, y), P + Q)
    heavier = _heavier(a, keys, x, masses[0])
    if abs(masses[0]) > ANOTHER_MASS or not _apart(a, keys, y - heavier, P + Q).by_chance(level):
        return found
    # Within what matters a mass may pass for weaker rotors: the likelier of the two is told.
    if _left(y - heavier, P + Q) > _left(y - x, P + Q, keys.index(found.worst or keys[0])):
        return found
    return replace(found, masses=masses)


def _left(off: Array, covariance: Array, free: int | None = None) -> float:
    """Chi-square of differences (k,), of which one may be whatever is likeliest."""
    weight = np.linalg.inv(covariance)
    whole = float(off @ weight @ off)
    if free is None:
        return whole
    return whole - float(weight[free] @ off) ** 2 / float(weight[free, free])


def _apart(a: Said, keys: Sequence[Key], off: Array, covariance: Array) -> Apart:
    """Of differences (k,) with this covariance (k, k)."""
    unknowns = {(e.name, u.name): u for e in a.effects for u in e.unknowns}
    unit = np.array([unknowns[key].plausible for key in keys])
    floor = np.array([unknowns[key].floor for key in keys])
    size, ways = np.linalg.eigh(covariance / np.outer(unit, unit))
    both = size <= 2.0 / TESTABLE**2
    if not both.any():
        return Apart(0.0, 0)
    U = ways[:, both] / unit[:, None]
    weight = (U / size[both]) @ U.T
    beyond = off - _nearest(off, floor, weight)
    sigmas = np.maximum(np.abs(off) - floor, 0.0) / np.sqrt(np.diag(covariance))
    worst = keys[int(np.argmax(sigmas))]
    return Apart(float(beyond @ weight @ beyond), int(np.count_nonzero(both)), worst)


def _nearest(off: Array, floor: Array, weight: Array) -> Array:
    """(k,) of the box, ``|x| <= floor``, that is nearest to ``off``."""
    x = np.clip(off, -floor, floor)
    for _ in range(SWEEPS):
        for i in np.flatnonzero(np.diag(weight) > 0.0):
            x[i] += weight[i] @ (off - x) / weight[i, i]
            x[i] = min(max(x[i], -floor[i]), floor[i])
    return x


def _masses(
    a: Said, keys: Sequence[Key], values: tuple[Array, Array], covariance: Array
) -> tuple[float, float]:
    """Logarithm of the mass that makes the first flight's numbers the second's, and its sigma."""
    log_ratio, information = 0.0, 1.0
    weight = np.linalg.inv(covariance)
    for _ in range(TURNS):
        now = _heavier(a, keys, values[0], log_ratio)
        slope = (_heavier(a, keys, values[0], log_ratio + DIFFERENCE) - now) / DIFFERENCE
        information = max(float(slope @ weight @ slope), 1e-12)
        log_ratio += float(slope @ weight @ (values[1] - now)) / information
        log_ratio = min(max(log_ratio, -2.0 * ANOTHER_MASS), 2.0 * ANOTHER_MASS)
    return log_ratio, 1.0 / math.sqrt(information)


def _heavier(a: Said, keys: Sequence[Key], values: Array, log_ratio: float) -> Array:
    """(k,) numbers of the same airframe with another mass."""
    out = dict(zip(a.keys, a.values.tolist(), strict=True))
    out |= dict(zip(keys, values.tolist(), strict=True))
    for e in a.effects:
        its = [(e.name, u.name) for u in e.unknowns]
        out |= dict(zip(its, e.heavier([out[k] for k in its], log_ratio), strict=True))
    return np.array([out[key] for key in keys])
