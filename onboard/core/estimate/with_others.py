"""What a vehicle's other accelerometers add to what is known of one: all that can be set of it.

They feel one trajectory, so whatever one of them knows by GPS the next one knows through their
difference (:mod:`onboard.core.estimate.relative`): one that is shaken, or came in too seldom,
learns from one that is not.

*Which six.*  What is to be set fits the accelerometer to the axes of its own gyroscope, for those
turned what it felt (:func:`~onboard.core.estimate.gyro_axes.gyro_sigma`).  Their difference is
that of two accelerometers, without any gyroscope.  So a pair ties its two only as far as the axes
of their gyroscopes are known, and right ones differ in the level offsets by as much: accelerometers
that are made to agree do not navigate better.

*How much of whose.*  Errors of GPS and attitude are in all of them alike, by an amount that nobody
knows.  With shares ``w`` of their information that add up to one the stacked covariance is a bound
whatever they have in common (covariance intersection, Julier and Uhlmann 1997).  Every one takes
the shares with which the force over the loads that it flew is known best,

    min over w of tr(M P(w)),    P(w) = (sum of w_i I_i + what pairs and priors say)^-1,

which is convex in ``w`` (the trace of the inverse of a linear function), so it is found by steps
towards one accelerometer after the other (Frank and Wolfe 1956), from itself alone on: nothing of
what it knows by itself is lost.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from onboard.core.estimate.comparison import Comparison
from onboard.core.estimate.determined import force_moments
from onboard.core.estimate.joint import Joint, Single, stacked, without_prior
from onboard.core.estimate.relative import Relative
from onboard.core.estimate.result import Calibration, Together
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import Array, vector3
from onboard.core.maths.chi_square import CHI_SQUARE_999

ROUNDS = 8
"""Steps towards one accelerometer [cost: any shares are valid, these are nearly the best]."""
SHARES = np.linspace(0.0, 1.0, 11)
"""How far a step goes [cost]."""


def with_others(
    calibrations: Iterable[Calibration], comparison: Comparison
) -> dict[int, Calibration]:
    """Those that some other one adds to, by number, with what all of them know.

    Args:
        calibrations: whose sigmas can be believed and whose six are all that is wrong with what
            they read.
        comparison: of the vehicle's accelerometers.  A pair that its two contradict (past the 0.999
            quantile) ties nothing.
    """
    singles = {c.imu: (c, s) for c in calibrations if (s := _navigating(c)) is not None}
    pairs = {
        r.imus: r.loosened(np.concatenate([singles[imu][1].gyro_sigma for imu in r.imus]))
        for r, pair in zip(comparison.relatives, comparison.pairs, strict=True)
        if singles.keys() >= {*r.imus} and pair.chi_square <= CHI_SQUARE_999[3]
    }
    out = {}
    for group in _tied(singles, pairs):
        some = [singles[imu][1] for imu in group]
        ties = [pairs[two] for two in combinations(group, 2) if two in pairs]
        for imu in group:
            c = singles[imu][0]
            out[imu] = replace(c, together=_known(c, some, ties))
    return out


def _navigating(c: Calibration) -> Single | None:
    """A calibration of those six that fit its gyroscope, without its prior."""
    in_force = SixParameters(c.in_force_scale, c.in_force_offset)
    six, gyro = np.array(c.scale + c.offset), np.array(c.gyro_sigma)
    prior = np.array(c.prior_sigma)
    return without_prior(c.imu, in_force, prior, six, c.with_its_gyroscope, gyro)


def _tied(names: Iterable[int], pairs: Iterable[tuple[int, int]]) -> list[tuple[int, ...]]:
    """Groups, of two at least, that pairs hold together."""
    groups = [{name} for name in names]
    for a, b in pairs:
        mine = [g for g in groups if a in g or b in g]
        groups = [g for g in groups if g not in mine] + [set().union(*mine)]
    return [tuple(sorted(g)) for g in groups if len(g) > 1]


def _known(c: Calibration, singles: Sequence[Single], ties: Sequence[Relative]) -> Together:
    """What a group knows of one of its accelerometers."""
    found = _best(c, singles, ties)
    six, covariance = found.of(c.imu)
    return Together(
        found.imus,
        vector3(six[:3]),
        vector3(six[3:]),
        tuple(tuple(float(x) for x in row) for row in covariance),
    )


def _best(c: Calibration, singles: Sequence[Single], ties: Sequence[Relative]) -> Joint:
    M = force_moments(c.load_mean, c.load_square, c.in_force_scale + c.in_force_offset)
    imus = [s.imu for s in singles]

    def at(weights: Array) -> _Tried:
        found = stacked(singles, ties, weights)
        return _Tried(float(np.sum(M * found.of(c.imu)[1])), weights, found)

    best = at(np.array([float(imu == c.imu) for imu in imus]))
    for _ in range(ROUNDS):
        tried = [
            at(best.weights + share * (corner - best.weights))
            for corner in np.eye(len(imus))
            for share in SHARES[1:]
        ]
        better = min(tried, key=lambda x: x.error)
        if better.error >= best.error:
            break
        best = better
    return best.found


@dataclass(frozen=True, slots=True)
class _Tried:
    """Shares, what they give, and the expected square error of the force, (m/s^2)^2."""

    error: float
    weights: Array
    found: Joint
