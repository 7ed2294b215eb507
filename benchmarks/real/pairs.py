"""Two accelerometers on one board: they feel the same force, so their difference needs no GPS.

The mean over flight of ``f = scale (raw - offset)`` is compared between the accelerometers
of each flight: with the parameters in force, and with each one's own estimate, what the effects
that were said add to it included (a shift of the offset by vibration is one accelerometer's own).
The predicted sigma of the difference takes the two solutions for independent.  They are not: they
share GPS and attitude, whose errors cancel in the difference.  So chi-square should be *below* its
degrees of freedom, and a pair that is far above them is contradicted.  Left out is what the places
of the sensors do (``w x (w x r)``, some mm/s^2 for 10 cm).

The second table is of the pair itself (:mod:`onboard.core.estimate.relative`): how well it knows
the difference without GPS, all flight in which both were heard and places taken into account, and
the chi-square of the two estimates against it, with what they share left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from benchmarks.real.command import fit_and_show
from benchmarks.real.flights import Fit
from benchmarks.real.split import RealFlight
from onboard.core.estimate.joint import Single, disagreement, without_prior
from onboard.core.estimate.relative import relative_of
from onboard.core.estimate.shared_windows import shared_windows
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import vector3
from onboard.core.maths.chi_square import CHI_SQUARE_999, survival

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Pair:
    """Difference of the mean forces of two accelerometers of one flight, sensor axes, m/s^2.

    Attributes:
        flight: its name.
        imus: which two.
        before: (3,) with the parameters in force.
        after: (3,) with each accelerometer's own estimate.
        covariance: (3, 3) of ``after`` as the estimates claim.
        own_sigma: (3,) of the difference as the pair itself has it; NaN if it does not.
        own_chi_square: of the estimates against that.
    """

    flight: str
    imus: tuple[int, int]
    before: Array
    after: Array
    covariance: Array
    own_sigma: Array
    own_chi_square: float

    @property
    def sigma(self) -> Array:
        """(3,) of ``after``."""
        out: Array = np.sqrt(np.diag(self.covariance))
        return out

    @property
    def chi_square(self) -> float:
        """With three degrees of freedom."""
        return float(self.after @ np.linalg.solve(self.covariance, self.after))


@dataclass(frozen=True, slots=True)
class Agreement:
    """Chi-square of all accelerometers of one flight about their common mean force.

    Three accelerometers make three pairs, of which two are independent: pairs do not add up, this
    does.
    """

    flight: str
    chi_square: float
    freedom: int


@dataclass(frozen=True, slots=True)
class Mean:
    """A mean force, or a difference of two, and its covariance."""

    force: Array
    covariance: Array


def mean_force(fit: Fit) -> Mean:
    """(3,) mean force by all that a flight says of an accelerometer, and its (3, 3) covariance."""
    raw = SixParameters(vector3(fit.in_force[:3]), vector3(fit.in_force[3:])).undo(fit.force)
    scale, offset = fit.estimate[:3], fit.estimate[3:]
    J = np.hstack([np.diag(raw - offset), -np.diag(scale)])
    more = fit.beside
    return Mean(scale * (raw - offset) + more.force, J @ fit.covariance @ J.T + more.covariance)


def _usable(fit: Fit) -> bool:
    return not fit.failed and bool(np.all(np.isfinite(fit.force)))


def run(made: Sequence[Fit]) -> list[Pair]:
    """Every pair of accelerometers of every flight that was estimated and moved."""
    good = [f for f in made if _usable(f)]
    out = []
    for one, other in combinations(good, 2):
        if one.flight != other.flight:
            continue
        a, b = mean_force(one), mean_force(other)
        out.append(
            Pair(
                one.flight,
                (one.imu, other.imu),
                one.force - other.force,
                a.force - b.force,
                a.covariance + b.covariance,
                *_own(one, other),
            )
        )
    return out


def _own(one: Fit, other: Fit) -> tuple[Array, float]:
    """(3,) sigma of the difference as the pair itself has it, and chi-square against that."""
    a, b = single_of(one), single_of(other)
    if a is None or b is None:
        return np.full(3, np.nan), float("nan")
    before, prior = (np.concatenate(x) for x in ((a.before, b.before), (a.prior_sigma,) * 2))
    windows = shared_windows(one.batches, other.batches)
    relative = relative_of((one.imu, other.imu), windows, before, prior)
    if relative is None:
        return np.full(3, np.nan), float("nan")
    return np.sqrt(np.diag(relative.own_covariance)), disagreement(relative, a, b)


def single_of(fit: Fit) -> Single | None:
    """What a flight says of an accelerometer without its prior; None: it says nothing."""
    in_force = SixParameters(vector3(fit.in_force[:3]), vector3(fit.in_force[3:]))
    return without_prior(
        fit.imu, in_force, fit.prior_sigma, fit.estimate, fit.covariance, fit.gyro_sigma
    )


def agreements(made: Sequence[Fit]) -> list[Agreement]:
    """All accelerometers of each flight about their mean, weighted by what they claim."""
    out = []
    for flight in dict.fromkeys(f.flight for f in made):
        means = [mean_force(f) for f in made if f.flight == flight and _usable(f)]
        if len(means) < 2:
            continue
        out.append(Agreement(flight, apart(means), 3 * (len(means) - 1)))
    return out


def apart(means: Sequence[Mean]) -> float:
    """Chi-square of some about their common mean, weighted by what they claim."""
    weights = [np.linalg.inv(m.covariance) for m in means]
    b = sum((w @ m.force for w, m in zip(weights, means, strict=True)), np.zeros(3))
    middle = np.linalg.solve(sum(weights, np.zeros((3, 3))), b)
    off = [m.force - middle for m in means]
    return sum(float(d @ w @ d) for d, w in zip(off, weights, strict=True))


def table(pairs: Sequence[Pair], agreed: Sequence[Agreement] = ()) -> str:
    """One line for each pair, and what they say together."""
    lines = [f"{'flight, IMUs':17}{'in force':^19}{'estimated':^19}{'its sigma':^18}{'chi2':>6}"]
    for p in pairs:
        label = _label(p)
        before, after = ("".join(f"{x:6.2f}" for x in d) for d in (p.before, p.after))
        sigma = "".join(f"{x:6.3f}" for x in p.sigma)
        lines.append(f"{label:17}{before} {after} {sigma}{p.chi_square:6.1f}")
    if pairs:
        lines += summary(pairs, agreed)
    return "\n".join(lines)


def own_table(pairs: Sequence[Pair]) -> str:
    """One line for each pair: how well it knows the difference, and the estimates against it."""
    header = "".join(f"{'sigma ' + axis:>10}" for axis in "xyz")
    lines = [f"{'flight, IMUs':17}{header}{'chi2':>8}   of the pair itself"]
    for p in pairs:
        sigma = "".join(f"{x:10.4f}" for x in p.own_sigma)
        lines.append(f"{_label(p):17}{sigma}{p.own_chi_square:8.1f}")
    known = [p.own_chi_square for p in pairs if np.isfinite(p.own_chi_square)]
    if known:
        beyond = sum(x > CHI_SQUARE_999[3] for x in known)
        lines.append(f"contradicted once in a thousand: {beyond} of {len(known)} pairs")
    return "\n".join(lines)


def _label(p: Pair) -> str:
    return f"{p.flight.removeprefix('real-')[:13]:13} {p.imus[0]}-{p.imus[1]}"


def summary(pairs: Sequence[Pair], agreed: Sequence[Agreement]) -> list[str]:
    """RMS of the differences, chi-square over all pairs."""
    before = float(np.sqrt(np.mean([p.before**2 for p in pairs])))
    after = float(np.sqrt(np.mean([p.after**2 for p in pairs])))
    chi, dof = sum(a.chi_square for a in agreed), sum(a.freedom for a in agreed)
    closer = sum(np.linalg.norm(p.after) < np.linalg.norm(p.before) for p in pairs)
    rms = f"{before:.3f} in force, {after:.3f} estimated"
    return [
        f"difference, RMS of {len(pairs)} pairs, m/s^2: {rms}",
        f"closer than with the parameters in force: {closer} of {len(pairs)} pairs",
        f"chi-square {chi:.1f} for {dof} degrees of freedom (p = {survival(chi, dof):.2g})",
    ]


def paired(flights: Sequence[RealFlight]) -> list[RealFlight]:
    """Those with more than one accelerometer."""
    return [f for f in flights if len(f.imus) > 1]


def show(made: Sequence[Fit]) -> None:
    """Print both tables."""
    pairs = run(made)
    print(table(pairs, agreements(made)))
    print()
    print(own_table(pairs))


def main(arguments: list[str] | None = None) -> None:
    """Fit and print."""
    fit_and_show("Pairs of accelerometers on real flights.", show, arguments, paired)


if __name__ == "__main__":
    main()
