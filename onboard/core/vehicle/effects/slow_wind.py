"""The slow part of gusty air: a wind that wanders about its mean for tens of seconds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.flight import Flight

EVERY_S = 12.0
"""s between the nodes of the wind: what is faster is the noise's, whose longest memory is this
[cost]."""
MOST = 32
"""Such spans; of a longer flight they are longer [cost]."""
TOLD = 0.95
"""Of the variance of the process, that its slowest modes have; the rest is the noise's [cost]."""


@dataclass(frozen=True, slots=True)
class Wander:
    """A process of first order towards north and towards east: Dryden's spectrum along the wind.

    ``rms`` of a component, m/s; ``time_s`` of correlation, s (MIL-F-8785C, 1980, section 3.7).
    """

    rms: float
    time_s: float


def may_wander(flight: Flight) -> bool:
    """Whether it is asked of a flight: it is one, and nobody measured its wind."""
    return flight.parts == 1 and not bool(np.isfinite(flight.measured_wind).any())


def nodes_of(flight: Flight) -> Array:
    """(k,) s, at which the slow wind of a flight is told; straight lines between them."""
    lasted = float(flight.t[-1] - flight.t[0])
    count = 1 + min(max(math.ceil(lasted / EVERY_S), 1), MOST)
    out: Array = flight.t[0] + np.linspace(0.0, lasted, count)
    return out


def covariance_of(nodes: Array, wander: Wander) -> Array:
    """(k, k) of the process at the nodes, m^2/s^2."""
    apart = np.abs(nodes[:, None] - nodes[None, :])
    out: Array = wander.rms**2 * np.exp(-apart / wander.time_s)
    return out


def shares_of(flight: Flight, nodes: Array) -> Array:
    """(k,) of the nodes' winds in the mean over the flight; they add up to one."""
    unit = np.eye(len(nodes))
    return np.array([float(np.mean(np.interp(flight.t, nodes, row))) for row in unit])


def doubt_of(flight: Flight, wander: Wander | None) -> float:
    """By how much the mean over a flight is off that of a wind for ever, m/s: standard deviation.

    For a flight of D s and a wander of T s, long beside it, that is ``rms sqrt(2 T / D)``.
    """
    if wander is None:
        return 0.0
    nodes = nodes_of(flight)
    shares = shares_of(flight, nodes)
    return math.sqrt(float(shares @ covariance_of(nodes, wander) @ shares))


class SlowWind(Effect):
    """The process without its mean over the flight, by modes with the variance that each has.

    They are estimated beside the effects (K. Karhunen, *Annales Academiae Scientiarum Fennicae*
    37, 1947).  The mean is the wind's of the flight; that of a wind for ever it is as far from as
    :func:`doubt_of` says.
    """

    def __init__(self, flight: Flight, wander: Wander) -> None:
        """Take a single flight, and how its wind wanders."""
        self.wander = wander
        self._nodes = nodes_of(flight)
        without = np.eye(len(self._nodes)) - shares_of(flight, self._nodes)
        inside = without @ covariance_of(self._nodes, wander) @ without.T
        variances, modes = (x[..., ::-1] for x in np.linalg.eigh(inside))
        told = 1 + int(np.searchsorted(np.cumsum(variances), TOLD * np.sum(variances)))
        self._modes = modes[:, :told]
        sizes = np.sqrt(variances[:told]).tolist()
        super().__init__(
            [
                Unknown(f"slow_{way}_{k}", 0.0, size, 0.0, "m/s")
                for way in ("north", "east")
                for k, size in enumerate(sizes)
            ]
        )

    def wind(self, flight: Flight, values: Sequence[float]) -> Array:
        """(n, 2) towards north and east, m/s, beside the constant one."""
        at_nodes = self._modes @ np.reshape(np.asarray(values), (2, -1)).T
        lines = [np.interp(flight.t, self._nodes, column) for column in at_nodes.T]
        return np.stack(lines, axis=1)

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Move the air."""
        air.wind_n[:, :2] += self.wind(air.flight, values)

    def missing(self, air: Air) -> str:
        """It takes one flight, and a wind that nobody measured."""
        asked = may_wander(air.flight)
        return "" if asked else "of several flights, or of a wind that was measured"
