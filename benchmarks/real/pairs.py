"""Two accelerometers on one board: they feel the same force, so their difference needs no GPS.

The mean over flight of ``f = scale (raw - offset)`` is compared between the accelerometers
of each flight: with the parameters in force, and with each one's own estimate, what the effects
that were said add to it included (a shift of the offset by vibration is one accelerometer's own).
The predicted sigma of the difference takes the two solutions for independent.  They are not: they
share GPS and attitude, whose errors cancel in the difference.  So chi-square should be *below* its
degrees of freedom, and a pair that is far above them is contradicted.  Left out is what the places
of the sensors do (``w x (w x r)``, some mm/s^2 for 10 cm).

The second table is of the pair itself (:mod:`onboard.core.estimate.relative`): how well it knows
the difference without GPS, all flight in which both were heard and places taken into account; the
chi-square of the two estimates against it, with what they share left out; and the difference that
is left where all accelerometers of a flight are solved together.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from benchmarks.real.command import fit_and_show
from benchmarks.real.flights import Fit
from benchmarks.real.split import RealFlight
from onboard.core.estimate.comparison import compare
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
        together: (3,) with all accelerometers of the flight solved together.
    """

    flight: str
    imus: tuple[int, int]
    before: Array
    after: Array
    covariance: Array
    own_sigma: Array
    own_chi_square: float
    together: Array

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
    raw, scale, offset = _raw(fit), fit.estimate[:3], fit.estimate[3:]
    J = np.hstack([np.diag(raw - offset), -np.diag(scale)])
    more = fit.beside
    return Mean(scale * (raw - offset) + more.force, J @ fit.covariance @ J.T + more.covariance)


def _usable(fit: Fit) -> bool:
    return not fit.failed and bool(np.all(np.isfinite(fit.force)))


def run(made: Sequence[Fit]) -> list[Pair]:
    """Every pair of accelerometers of every flight that was estimated and moved."""
    good = [f for f in made if _usable(f)]
    return [
        pair
        for flight in dict.fromkeys(f.flight for f in good)
        for pair in _of_one_flight([f for f in good if f.flight == flight])
    ]


def _of_one_flight(fits: Sequence[Fit]) -> Iterator[Pair]:
    whole = [f.whole for f in fits if f.whole is not None]
    compared = compare(whole, [{f.imu: f.batches for f in fits}])
    own = {} if compared is None else {p.imus: p for p in compared.pairs}
    for one, other in combinations(fits, 2):
        imus = one.imu, other.imu
        a, b = mean_force(one), mean_force(other)
        sigma, chi_square, together = np.full(3, np.nan), float("nan"), np.full(3, np.nan)
        if compared is not None and imus in own:
            sigma, chi_square = np.array(own[imus].own_sigma), own[imus].chi_square
            six = [compared.joint.of(imu)[0] for imu in imus]
            together = felt(one, six[0]) - felt(other, six[1])
        yield Pair(
            one.flight,
            imus,
            one.force - other.force,
            a.force - b.force,
            a.covariance + b.covariance,
            sigma,
            chi_square,
            together,
        )


def felt(fit: Fit, six: Array) -> Array:
    """(3,) mean force by six numbers."""
    return six[:3] * (_raw(fit) - six[3:])


def _raw(fit: Fit) -> Array:
    return SixParameters(vector3(fit.in_force[:3]), vector3(fit.in_force[3:])).undo(fit.force)


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
    """One line for each pair: how well it knows the difference, and the estimates against it.

    And the difference once all accelerometers are solved together.
    """
    header = "".join(f"{'sigma ' + axis:>10}" for axis in "xyz")
    lines = [f"{'flight, IMUs':17}{header}{'chi2':>8}{'all together':^21}"]
    for p in pairs:
        sigma = "".join(f"{x:10.4f}" for x in p.own_sigma)
        together = "".join(f"{x:7.3f}" for x in p.together)
        lines.append(f"{_label(p):17}{sigma}{p.own_chi_square:8.1f}{together}")
    known = [p.own_chi_square for p in pairs if np.isfinite(p.own_chi_square)]
    if known:
        beyond = sum(x > CHI_SQUARE_999[3] for x in known)
        lines.append(f"contradicted once in a thousand: {beyond} of {len(known)} pairs")
        left = np.array([p.together for p in pairs if np.isfinite(p.own_chi_square)])
        rms, worst = float(np.sqrt(np.mean(left**2))), float(np.abs(left).max())
        lines.append(f"difference with all together, RMS, m/s^2: {rms:.3f}, at most {worst:.3f}")
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
