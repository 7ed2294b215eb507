"""What one flight offers to set: is it better where that flight has not been?

Whoever sets what a flight offers flies the next flight with it.  So every flight of the vehicle is
integrated freely, without GPS, with the parameters in force and with what each *other* flight
offers.  And two accelerometers of one board feel the same: their difference should not become more
where what is offered for either of them is set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from benchmarks.real.command import fit_and_show
from benchmarks.real.flights import Fit
from benchmarks.real.offer import Offer
from benchmarks.real.pairs import felt
from benchmarks.real.repeats import HORIZONS_S, MOST_WINDOWS
from onboard.core.estimate.dead_reckoning import free_drift
from onboard.core.maths.accelerometer import linear_of

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """A flight without GPS with what another flight of the accelerometer offers.

    Attributes:
        flight: flown.
        offering: the other one.
        imu: accelerometer.
        horizon_s: of the free integration.
        in_force: drift of the velocity at its end, m/s, median of the windows.
        offered: with what is offered.
    """

    flight: str
    offering: str
    imu: int
    horizon_s: float
    in_force: float
    offered: float


@dataclass(frozen=True, slots=True)
class Apart:
    """Length of the mean difference of two accelerometers in moving flight, m/s^2.

    Attributes:
        flight: its name.
        imus: which two.
        in_force: with the parameters in force.
        offered: with what is offered for either.
    """

    flight: str
    imus: tuple[int, int]
    in_force: float
    offered: float


def elsewhere(made: Sequence[Fit]) -> list[Elsewhere]:
    """Every flight with what each other flight of the same accelerometer offers."""
    good = [f for f in made if not f.failed]
    out = []
    for flown in good:
        others = [f for f in good if f is not flown and _same(f, flown) and _offers(f)]
        sixes = [linear_of(x) for x in (flown.in_force, *(_set_to(f) for f in others))]
        for horizon in HORIZONS_S if others else ():
            drift = free_drift(
                flown.chain, flown.states, sixes, horizon_s=horizon, most=MOST_WINDOWS
            )
            if drift is None:
                continue
            before, *after = (float(x) for x in drift.end)
            out += [
                Elsewhere(flown.flight, f.flight, flown.imu, horizon, before, x)
                for f, x in zip(others, after, strict=True)
            ]
    return out


def apart(made: Sequence[Fit]) -> list[Apart]:
    """Every two accelerometers of a flight of which either has something offered."""
    good = [f for f in made if not f.failed and np.all(np.isfinite(f.force))]
    out = []
    for a, b in combinations(good, 2):
        if a.flight != b.flight or not (_offers(a) or _offers(b)):
            continue
        before = float(np.linalg.norm(a.force - b.force))
        after = float(np.linalg.norm(felt(a, _set_to(a)) - felt(b, _set_to(b))))
        out.append(Apart(a.flight, (a.imu, b.imu), before, after))
    return out


def _same(a: Fit, b: Fit) -> bool:
    return (a.vehicle, a.imu) == (b.vehicle, b.imu)


def _offers(fit: Fit) -> bool:
    return fit.offer is not None and fit.offer.offered


def _set_to(fit: Fit) -> Array:
    return fit.in_force if fit.offer is None else fit.offer.six


def table(made: Sequence[Fit]) -> str:
    """One line for each accelerometer."""
    head = (
        f"{'flight, IMU':17}{'set':>3}{'change':>8}{'error':>7}{'then':>7}{'sure':>7}{'odds':>8}"
        "  against"
    )
    lines = []
    for f in made:
        o = f.offer
        if o is None:
            continue
        lines.append(
            f"{f.flight.removeprefix('real-')[:14]:15}{f.imu:2}{o.numbers:3}"
            f"{o.change:8.3f}{o.before:7.3f}{o.after:7.3f}{o.probability:7.3f}{o.gain:8.1f}"
            f"  {_against(o)}".rstrip()
        )
    return "\n".join([head, *lines])


def _against(offer: Offer) -> str:
    """The first objection, and how many more there are."""
    first, *more = offer.objections or ("",)
    return f"{first} +{len(more)}" if more else first


def summary(made: Sequence[Fit], others: Sequence[Elsewhere], beside: Sequence[Apart]) -> list[str]:
    """What all say together."""
    offered = sum(map(_offers, made))
    lines = [f"offered: {offered} of {len(made)}"]
    for horizon in HORIZONS_S:
        some = [e for e in others if e.horizon_s == horizon]
        if some:
            better = sum(e.offered < e.in_force for e in some)
            before = np.median([e.in_force for e in some])
            after = np.median([e.offered for e in some])
            lines.append(
                f"set for another flight, {horizon:.0f} s without GPS: better in {better} of "
                f"{len(some)}; drift {before:.2f} in force, {after:.2f} as offered"
            )
    if beside:
        closer = sum(a.offered < a.in_force for a in beside)
        before, after = (
            float(np.sqrt(np.mean(np.square([getattr(a, n) for a in beside]))))
            for n in ("in_force", "offered")
        )
        lines.append(
            f"beside another accelerometer: closer in {closer} of {len(beside)}; "
            f"{before:.3f} in force, {after:.3f} as offered, m/s^2"
        )
    return lines


def show(made: Sequence[Fit]) -> None:
    """Print the table and what it comes to."""
    print(table(made))
    print("\n".join(summary(made, elsewhere(made), apart(made))))


def main(arguments: list[str] | None = None) -> None:
    """Command line."""
    fit_and_show("What real flights offer, on flights that they have not seen.", show, arguments)


if __name__ == "__main__":
    main()
