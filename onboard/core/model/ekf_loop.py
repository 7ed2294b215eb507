"""The loop in which an EKF corrects its tilt by velocities, and what both are followed by.

An error of the tilt ``e`` about east makes a velocity north grow by ``-g e``; the velocity's
innovations correct both, as fast as the filter thinks its gyroscope and accelerometer err.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from onboard.core.inputs.segments import Segment, Signal
from onboard.core.maths.arrays import Array
from onboard.core.maths.leaky import leaky_integral

LOOP_RAD_S: Final = 0.35
DAMPING: Final = 0.8
"""Natural frequency and damping of ArduPilot's EKF3: the steady state of Riccati's equation for a
gyroscope of 0.015 rad/s and an accelerometer of 0.35 m/s^2 in each of its steps of 12 ms, and five
velocities a second that are good to 0.3 m/s; with ten of them 0.41 rad/s [physics]."""
POLE: Final = LOOP_RAD_S * complex(-DAMPING, math.sqrt(1.0 - DAMPING**2))


@dataclass(frozen=True, slots=True)
class Recorded:
    """Recorded attitudes inside the samples of a segment.

    Attributes:
        t: (k,) s.
        R: (k - 1, 3, 3) mean of each attitude and the next.
    """

    t: Array
    R: Array

    @classmethod
    def of(cls, segment: Segment) -> Self | None:
        """None of fewer than two."""
        inside = slice(*np.searchsorted(segment.t_attitude, segment.t[[0, -1]]))
        t = segment.t_attitude[inside]
        if len(t) < 2:
            return None
        R = segment.R_attitude[inside]
        return cls(t, 0.5 * (R[1:] + R[:-1]))

    def gained(self, t: Array, x: Array) -> Array:
        """(k - 1, m) integral of samples (n, m) at ``t`` (n,) from each attitude to the next."""
        steps = np.diff(t)[:, None] * (x[1:] + x[:-1])
        total = np.vstack([np.zeros(x.shape[1]), np.cumsum(0.5 * steps, axis=0)])
        out: Array = np.diff([np.interp(self.t, t, column) for column in total.T]).T
        return out

    def start(self, before: Signal | None, size: int) -> Array:
        """(size,) signal of the segment before where this one begins; zeros after a gap."""
        if before is None:
            return np.zeros(size)
        return np.array([np.interp(self.t[0], before[0], x) for x in before[1].T])

    def looped(self, gained: Array, start: Array) -> Array:
        """``z' = p z + x`` with the loop's pole, (k, 2 m): real parts of z, then imaginary ones.

        Args:
            gained: (k - 1, m) integral of x from each attitude to the next.
            start: (2 m,) the same at the first attitude.
        """
        real, imaginary = np.split(start, 2)
        pole = np.full(len(real), POLE)
        z = leaky_integral(self.t, gained, pole, real + 1j * imaginary)
        return np.hstack([z.real, z.imag])


def through_loop(z: Array, zero: float) -> Array:
    """What ``(s + zero) / (s^2 + 2 d w s + w^2)`` makes of x, by partial fractions.

    Args:
        z: (..., 2 m) as :meth:`Recorded.looped` has it.
        zero: rad/s.

    Returns:
        (..., m), times the unit of x the unit of its integral.
    """
    real, imaginary = np.split(z, 2, axis=-1)
    residue = (POLE + zero) / (2j * POLE.imag)
    out: Array = 2.0 * (residue.real * real - residue.imag * imaginary)
    return out
