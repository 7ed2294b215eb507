"""Parts of a flight against each other: whether a pair knows its difference as well as it says.

Both accelerometers of a board feel one force, so that their own comparison
(:mod:`onboard.core.estimate.relative`) needs neither GPS nor attitude, and knows a mean difference
to a few mm/s^2.  What it is compared with here is itself: each half of the flight calibrates the
pair alone, and so does each third and quarter, about the mean of them.  If sigmas are right,
chi-square is its freedom.  Of several accelerometers each is compared with the first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.real.flights import Fit
from benchmarks.real.pairs import Mean, apart
from onboard.core.estimate.relative import Relative, relative_of
from onboard.core.estimate.shared_windows import SharedWindows, shared_windows

Array = NDArray[np.float64]
COUNTS = (2, 3, 4)
"""Of parts, all as long."""
WORDS = {2: "halves", 3: "thirds", 4: "quarters"}


@dataclass(frozen=True, slots=True)
class PairInParts:
    """One pair of one flight.

    Attributes:
        flight: its name.
        imus: which two.
        count: parts.
        sigma: (3,) of the difference in a part, the mean of them, m/s^2.
        chi_square: of the parts about their mean.
        freedom: of it.
    """

    flight: str
    imus: tuple[int, int]
    count: int
    sigma: Array
    chi_square: float
    freedom: int


def run(made: Sequence[Fit]) -> list[PairInParts]:
    """Every accelerometer with the first of its flight, as long as parts have enough windows."""
    out = []
    for flight in dict.fromkeys(f.flight for f in made):
        fits = [f for f in made if f.flight == flight and not f.failed]
        for other in fits[1:]:
            before = np.concatenate([fits[0].prior, other.prior])
            prior = np.concatenate([fits[0].prior_sigma, other.prior_sigma])
            windows = shared_windows(fits[0].batches, other.batches)
            imus = (fits[0].imu, other.imu)
            whole = relative_of(imus, windows, before, prior)
            for count in COUNTS if whole is not None else ():
                cut = (relative_of(imus, part, before, prior) for part in _cut(windows, count))
                parts = [part for part in cut if part is not None]
                if len(parts) == count:
                    out.append(_compared(flight, whole, parts))
    return out


def _compared(flight: str, whole: Relative, parts: Sequence[Relative]) -> PairInParts:
    """All are asked for the same: the difference at the flight's mean force."""
    J = whole.weights
    asked = [Mean(J @ part.theta, J @ part.covariance[:12, :12] @ J.T) for part in parts]
    sigma = np.mean([np.sqrt(np.diag(m.covariance)) for m in asked], axis=0)
    count = len(parts)
    return PairInParts(flight, whole.imus, count, sigma, apart(asked), 3 * (count - 1))


def _cut(windows: SharedWindows, count: int) -> Iterator[SharedWindows]:
    n = len(windows)
    for k in range(count):
        chosen = np.zeros(n, dtype=bool)
        chosen[k * n // count : (k + 1) * n // count] = True
        yield windows.where(chosen)


def table(found: Sequence[PairInParts]) -> str:
    """One line for each pair and each number of parts that it has."""
    lines = [f"{'flight, IMUs':17}{'parts':>9}{'sigma x':>9}{'y':>8}{'z':>8}{'chi2':>8}   for"]
    for p in found:
        label = f"{p.flight.removeprefix('real-')[:13]:13} {p.imus[0]}-{p.imus[1]}"
        sigma = "".join(f"{x:8.4f}" for x in p.sigma)
        lines.append(f"{label:17}{WORDS[p.count]:>9} {sigma}{p.chi_square:8.1f}{p.freedom:6d}")
    for count in COUNTS:
        some = [p for p in found if p.count == count]
        if some:
            chi, freedom = sum(p.chi_square for p in some), sum(p.freedom for p in some)
            lines.append(
                f"{WORDS[count]}: chi-square {chi:.1f} for {freedom}, {chi / freedom:.2f} of it"
            )
    return "\n".join(lines)
