"""Flights of one vehicle one by one: do the estimates repeat, and do they predict each other?

The scatter of single-flight estimates over their sigmas is a reduced chi-square of 1 if the sigmas
are honest: less if they are too wide.  Numbers are compared that the flight itself has observed, by
a sigma that is well below that of the prior.  They scatter less than they claim, for all lean on
the same prior: of a hover, scale and offset of z are known together and neither alone.  What counts
is how flights scatter along the directions that they know, the prior taken out of each
(:func:`together`).

Leave-one-out: the sums of all other flights, with the prior once, give one set of six; with it the
held-out flight is integrated freely from the filter's velocity, and compared with its GPS and with
the parameters in force.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.real.command import fit_and_show
from benchmarks.real.flights import Fit
from benchmarks.real.split import RealFlight
from onboard.core.estimate.dead_reckoning import free_drift
from onboard.core.estimate.joint import without_prior
from onboard.core.estimate.limits import PRIOR_SHARE
from onboard.core.estimate.merged_flights import FlightSix, Prior, reconciled
from onboard.core.estimate.result import SIX_NAMES
from onboard.core.maths.accelerometer import SixParameters, linear_of, parameters_of
from onboard.core.maths.arrays import vector3

Array = NDArray[np.float64]

HORIZONS_S = (10.0, 60.0)
MOST_WINDOWS = 12
FEWEST_FLIGHTS = 3


@dataclass(frozen=True, slots=True)
class Scatter:
    """How one number of one accelerometer scatters from flight to flight.

    Attributes:
        vehicle: whose.
        imu: accelerometer.
        name: of the number, as in SIX_NAMES.
        flights: how many observed it.
        mean: weighted by the claimed sigmas.
        sigma: of one flight as claimed, median.
        spread: standard deviation of the flights.
        reduced: chi-square over its degrees of freedom; NaN below two flights.
    """

    vehicle: str
    imu: int
    name: str
    flights: int
    mean: float
    sigma: float
    spread: float
    reduced: float


@dataclass(frozen=True, slots=True)
class Together:
    """How the flights of one accelerometer scatter along the directions that they know.

    Attributes:
        vehicle: whose.
        imu: accelerometer.
        flights: how many.
        chi_square: of each against those before it, added up.
        freedom: directions that both knew.
    """

    vehicle: str
    imu: int
    flights: int
    chi_square: float
    freedom: int


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Velocity drift of one flight of which only the others knew.

    Attributes:
        flight: held out.
        imu: accelerometer.
        horizon_s: of the free integration.
        windows: how many.
        in_force: drift at the end with the parameters in force, m/s, median of the windows.
        others: with the average of the other flights.
        own: with the flight's own estimate, which has seen it: the best that can be hoped for.
    """

    flight: str
    imu: int
    horizon_s: float
    windows: int
    in_force: float
    others: float
    own: float


def run(made: Sequence[Fit]) -> tuple[list[Scatter], list[LeftOut]]:
    """Scatter and leave-one-out of every vehicle with several flights, by accelerometer."""
    scatter: list[Scatter] = []
    left_out: list[LeftOut] = []
    for some in _several(made):
        scatter += [scatter_of(some, i) for i in range(6)]
        for f in some:
            left_out += _left_out(f, [o for o in some if o is not f])
    return scatter, left_out


def together(made: Sequence[Fit]) -> list[Together]:
    """Every accelerometer with several flights."""
    out = []
    for some in _several(made):
        one = some[0]
        said = [six for f in some if (six := _alone(f)) is not None]
        if len(said) >= FEWEST_FLIGHTS:
            scatter = reconciled(said, Prior(one.prior, one.prior_sigma)).scatter
            out.append(Together(one.vehicle, one.imu, len(said), scatter.chi_square, scatter.dof))
    return out


def _several(made: Sequence[Fit]) -> Iterator[list[Fit]]:
    """The flights of each accelerometer that has enough of them."""
    good = [f for f in made if not f.failed]
    for vehicle, imu in sorted({(f.vehicle, f.imu) for f in good}):
        some = [f for f in good if (f.vehicle, f.imu) == (vehicle, imu)]
        if len(some) >= FEWEST_FLIGHTS:
            yield some


def _alone(fit: Fit) -> FlightSix | None:
    """What a flight says without its prior, and without what its gyroscope's axes leave open."""
    in_force = SixParameters(vector3(fit.in_force[:3]), vector3(fit.in_force[3:]))
    covariance = fit.covariance - np.diag(fit.gyro_sigma**2)
    s = without_prior(fit.imu, in_force, fit.prior_sigma, fit.estimate, covariance)
    if s is None:
        return None
    vector = s.vector + s.information @ s.before
    return FlightSix(s.information, vector, s.information, vector)


def observed(fit: Fit, i: int) -> bool:
    """Whether a flight itself has observed number ``i`` of the linear six."""
    sigma = float(np.sqrt(fit.linear_covariance[i, i]))
    return sigma < PRIOR_SHARE * float(fit.prior_sigma[i])


def scatter_of(some: Sequence[Fit], i: int) -> Scatter:
    """Number ``i`` over the flights of one accelerometer that observed it."""
    seen = [f for f in some if observed(f, i)]
    x = np.array([f.estimate[i] for f in seen])
    # All flights of one accelerometer have flown with the same gyroscope.
    sigma = np.array([np.sqrt(f.covariance[i, i] - f.gyro_sigma[i] ** 2) for f in seen])
    vehicle, imu, nan = some[0].vehicle, some[0].imu, float("nan")
    if not seen:
        return Scatter(vehicle, imu, SIX_NAMES[i], 0, nan, nan, nan, nan)
    mean = float(np.sum(x / sigma**2) / np.sum(1.0 / sigma**2))
    dof = len(x) - 1
    reduced = float(np.sum(((x - mean) / sigma) ** 2) / dof) if dof else nan
    spread = float(np.std(x, ddof=1)) if dof else nan
    return Scatter(
        vehicle, imu, SIX_NAMES[i], len(x), mean, float(np.median(sigma)), spread, reduced
    )


def average(some: Sequence[Fit]) -> Array:
    """(6,) scale and offset of several flights together: their information, the prior once."""
    prior = np.diag(1.0 / some[0].prior_sigma ** 2)
    A, b = prior, prior @ some[0].prior
    for f in some:
        own = np.diag(1.0 / f.prior_sigma**2)
        whole = np.linalg.inv(f.linear_covariance)
        A = A + whole - own
        b = b + whole @ f.linear - own @ f.prior
    return parameters_of(np.asarray(np.linalg.solve(A, b), dtype=np.float64))


def _left_out(fit: Fit, others: Sequence[Fit]) -> list[LeftOut]:
    sixes = [linear_of(x) for x in (fit.in_force, average(others), fit.estimate)]
    out = []
    for horizon in HORIZONS_S:
        drift = free_drift(fit.chain, fit.states, sixes, horizon_s=horizon, most=MOST_WINDOWS)
        if drift is not None:
            before, after, own = (float(x) for x in drift.end)
            out.append(LeftOut(fit.flight, fit.imu, horizon, drift.windows, before, after, own))
    return out


def scatter_table(scatter: Sequence[Scatter]) -> str:
    """One line for each number of each accelerometer."""
    head = (
        f"{'vehicle, IMU':20}{'number':>10}{'flights':>8}{'mean':>9}{'spread':>9}"
        f"{'claimed':>9}{'chi2/dof':>10}"
    )
    lines = [
        f"{s.vehicle[:17]:18}{s.imu:2}{s.name:>10}{s.flights:8}{s.mean:9.4f}{s.spread:9.4f}"
        f"{s.sigma:9.4f}{s.reduced:10.2f}"
        for s in scatter
        if s.flights
    ]
    return "\n".join([head, *lines])


def left_out_table(left_out: Sequence[LeftOut]) -> str:
    """One line for each flight, accelerometer and horizon."""
    head = (
        f"{'flight, IMU':18}{'horizon':>8}{'windows':>8}{'in force':>10}{'others':>9}{'own':>9}"
        "  (m/s at the end)"
    )
    lines = [
        f"{o.flight:16}{o.imu:2}{o.horizon_s:6.0f} s{o.windows:8}{o.in_force:10.3f}"
        f"{o.others:9.3f}{o.own:9.3f}"
        for o in left_out
    ]
    return "\n".join([head, *lines])


def summary(
    scatter: Sequence[Scatter], known: Sequence[Together], left_out: Sequence[LeftOut]
) -> list[str]:
    """What all say together."""
    dof = sum(s.flights - 1 for s in scatter if np.isfinite(s.reduced))
    chi = sum(s.reduced * (s.flights - 1) for s in scatter if np.isfinite(s.reduced))
    lines = [f"scatter over sigmas: chi-square {chi:.1f} for {dof} degrees of freedom"]
    chi, dof = sum(t.chi_square for t in known), sum(t.freedom for t in known)
    lines.append(f"along what flights know, without their prior: {chi:.1f} for {dof}")
    for horizon in HORIZONS_S:
        some = [o for o in left_out if o.horizon_s == horizon]
        if some:
            better = sum(o.others < o.in_force for o in some)
            medians = [
                float(np.median([getattr(o, n) for o in some]))
                for n in ("in_force", "others", "own")
            ]
            lines.append(
                f"left out, {horizon:.0f} s: better in {better} of {len(some)}; drift "
                f"{medians[0]:.2f} in force, {medians[1]:.2f} others, {medians[2]:.2f} own"
            )
    return lines


def show(made: Sequence[Fit]) -> None:
    """Print both tables."""
    scatter, left_out = run(made)
    if not scatter:
        print(f"no vehicle with {FEWEST_FLIGHTS} flights")
        return
    print(scatter_table(scatter))
    print()
    print(left_out_table(left_out))
    print("\n".join(summary(scatter, together(made), left_out)))


def repeated(flights: Sequence[RealFlight]) -> list[RealFlight]:
    """Those of vehicles that flew more than once."""
    return [f for f in flights if sum(o.vehicle == f.vehicle for o in flights) > 1]


def main(arguments: list[str] | None = None) -> None:
    """Fit and print."""
    fit_and_show("Repeated flights of one vehicle.", show, arguments, repeated)


if __name__ == "__main__":
    main()
