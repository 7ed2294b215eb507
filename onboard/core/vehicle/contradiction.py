"""Whether force, attitude and velocity of a recording are of one flight.

Turned by the attitude, the force is what the velocity changes by, gravity taken off: no airframe
and no air has a part in that.  Where it is not so by far, one of the three is wrong (a marker that
cameras took for another, a filter that was lost), and what a model finds there is nothing.  Level
alone: many a receiver has no vertical speed, and what is made of its height lags in a climb.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.limits import CONTRADICTION_M_S2, CONTRADICTION_S, MOST_OUTLYING


@dataclass(frozen=True, slots=True)
class Contradiction:
    """How much of a flight contradicts itself.

    Attributes:
        seconds: in which it does, s.
        of_s: that were looked at, s.
        worst: mean over the worst of them, m/s^2; zero where there is none.
    """

    seconds: float = 0.0
    of_s: float = 0.0
    worst: float = 0.0

    @property
    def hopeless(self) -> bool:
        """Whether it is more than a few outliers."""
        return self.seconds > MOST_OUTLYING * self.of_s

    def __str__(self) -> str:
        """As a part of a sentence; empty where there is none."""
        if not self.seconds:
            return ""
        return (
            f"force, attitude and velocity contradict each other for {self.seconds:.0f} of "
            f"{self.of_s:.0f} s, by up to {self.worst:.0f} m/s^2: one of them is not as the "
            "vehicle flew"
        )


def contradiction(pieces: Sequence[tuple[Array, Array]]) -> Contradiction:
    """Of uninterrupted pieces of flight.

    Args:
        pieces: times (k,), s, and by how much the velocity is off the integral of force, attitude
            and gravity there, (k, 3), m/s, NED, but for a constant; NaN where it is not believed.
    """
    sizes: list[float] = []
    for t, apart in pieces:
        known = np.all(np.isfinite(apart[:, :2]), axis=1)
        at, off = t[known], apart[known, :2]
        if len(at) == 0:
            continue
        for start in np.arange(at[0], at[-1] - CONTRADICTION_S, CONTRADICTION_S):
            first, last = np.searchsorted(at, [start, start + CONTRADICTION_S])
            span = at[last] - at[first] if last < len(at) else 0.0
            if 0.5 * CONTRADICTION_S < span < 2.0 * CONTRADICTION_S:
                sizes.append(float(np.linalg.norm(off[last] - off[first])) / span)
    wrong = [size for size in sizes if size > CONTRADICTION_M_S2]
    return Contradiction(
        CONTRADICTION_S * len(wrong), CONTRADICTION_S * len(sizes), max(wrong, default=0.0)
    )
