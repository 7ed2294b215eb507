"""Where the problem is taken to be linear: timing, and the six that turn forces into rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Linearisation:
    """The point about which the non-linear unknowns are expanded.

    Attributes:
        scale: (3,) of the accelerometer.
        beta: (3,) ``-scale * offset``, m/s^2.
        delay: GPS latency, s.
        window: averaging span of the receiver, s.
        attitude_delay: lateness of the recorded attitude, s.
        skew: growth of the latency, s/s, from ``skew_from`` (s on the boot clock) on.
        skew_from: see ``skew``.
    """

    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    beta: tuple[float, float, float] = (0.0, 0.0, 0.0)
    delay: float = 0.1
    window: float = 0.0
    attitude_delay: float = 0.0
    skew: float = 0.0
    skew_from: float = 0.0

    def true_time(self, stamp: Array) -> Array:
        """When what a fix with these stamps says was true, s."""
        out: Array = stamp - self.delay - self.skew * (stamp - self.skew_from)
        return out

    @property
    def six(self) -> Array:
        """(6,) scale, beta."""
        return np.array(self.scale + self.beta)
