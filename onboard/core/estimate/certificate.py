"""The uniform guarantee behind the integral criterion: from an L2 norm to a maximum.

Pashayev and Sabziev (2023) prove that a residual u on [0, 1] with ``|u'| <= K`` obeys
``max|u|^(3/2) <= sqrt(3 K) ||u||_L2``, provided that the steepest triangle under its maximum
fits into the window: ``max|u| <= K T``.  Without that proviso the inequality is false (take u
constant and K = 0).  What always holds on a window of length T is, with ``m = max|u|``,

    m^3 - max(0, m - K T)^3  <=  3 K ||u||^2,

for the lowest function with that maximum is the triangle, or what fits of it, with its apex at
an end of the window, and its squared norm is the left side over 3 K.  The left side grows with
m, so that the largest m allowed solves the equation.  It holds for the length of a vector too,
because ``| |u|' | <= |u'|``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from onboard.core.estimate.result import Certificate


def uniform_bound(l2: float, acceleration: float, duration: float) -> float:
    """The largest ``max|u|`` that a function with this norm and slope can have.

    Where the triangle fits it is ``(3 K l2^2)^(1/3)``; else the cubic terms cancel and a
    quadratic remains, ``m^2 - K T m + (K T)^2 / 3 = l2^2 / T``.  Both are exact at ``m = K T``,
    and the second has the constant function, ``m = l2 / sqrt(T)``, as its limit for K to 0.

    Args:
        l2: ``||u||`` on the window, in the unit of u times sqrt(s).
        acceleration: Bound K of ``|u'|``, unit of u per s; may be infinite.
        duration: T, s.

    Returns:
        The bound, in the unit of u; infinite where nothing follows (T = 0, or K infinite).

    Raises:
        ValueError: An argument is negative or not a number.
    """
    if not (l2 >= 0 and acceleration >= 0 and duration >= 0):
        raise ValueError(
            f"norm, slope and duration must not be negative: {l2}, {acceleration}, {duration}"
        )
    if duration == 0 or math.isinf(l2):
        return math.inf
    if l2 == 0:
        return 0.0
    rise = acceleration * duration if acceleration else 0.0  # not 0 times infinity
    if rise**2 * duration >= 3 * l2**2:
        return math.cbrt(3 * acceleration) * math.cbrt(l2) ** 2
    return 0.5 * rise + math.sqrt(max(0.0, l2**2 / duration - rise**2 / 12))


@dataclass(frozen=True, slots=True)
class ResidualWindow:
    """The norms of a velocity residual on one window without gaps.

    ``l2_squared`` in m^2/s, ``acceleration`` the bound on its slope in m/s^2, ``observed_max``
    in m/s, ``duration`` in s.
    """

    duration: float
    l2_squared: float
    acceleration: float
    observed_max: float

    @property
    def uniform_bound(self) -> float:
        """Bound on the length of the residual anywhere in the window, m/s."""
        return uniform_bound(math.sqrt(self.l2_squared), self.acceleration, self.duration)

    @classmethod
    def of(
        cls, t: ArrayLike, residual: ArrayLike, acceleration: float | None = None
    ) -> ResidualWindow:
        """Norms of the straight lines through residuals at epochs, integrated exactly.

        Args:
            t: (n,) s, strictly increasing, n >= 2.
            residual: (n, d) or (n,) m/s.
            acceleration: A bound known from elsewhere; None: the steepest line.  One below
                the steepest line is refuted by the data, which then count.

        Raises:
            ValueError: Fewer than two epochs, or times that do not increase.
        """
        times = np.asarray(t, dtype=np.float64)
        u = np.asarray(residual, dtype=np.float64).reshape(len(times), -1)
        dt = np.diff(times)
        if len(dt) == 0 or not np.all(dt > 0):
            raise ValueError("a window needs two epochs or more, in increasing order")
        before, after = u[:-1], u[1:]
        squares = np.sum(before * before + before * after + after * after, axis=1) / 3
        steepest = float(np.max(np.linalg.norm(after - before, axis=1) / dt))
        return cls(
            duration=float(times[-1] - times[0]),
            l2_squared=float(dt @ squares),
            acceleration=steepest if acceleration is None else max(steepest, acceleration),
            observed_max=float(np.max(np.linalg.norm(u, axis=1))),
        )


def combine(windows: Iterable[ResidualWindow]) -> Certificate | None:
    """One certificate for all windows: the bound holds in each, so the worst holds in all.

    A window of its own length and norm is bounded sharper than the sum of norms would bound it.

    Returns:
        None where there is no window.
    """
    all_windows = list(windows)
    if not all_windows:
        return None
    return Certificate(
        window_s=sum(w.duration for w in all_windows),
        residual_l2=math.sqrt(sum(w.l2_squared for w in all_windows)),
        acceleration_bound=max(w.acceleration for w in all_windows),
        uniform_bound=max(w.uniform_bound for w in all_windows),
        observed_max=max(w.observed_max for w in all_windows),
    )


def certify(
    t: ArrayLike, residual: ArrayLike, *, gap: float, acceleration: float | None = None
) -> Certificate | None:
    """Certificate of residuals at epochs, cut into windows wherever they are too far apart.

    Args:
        t: (n,) s, strictly increasing.
        residual: (n, d) m/s.
        gap: Epochs further apart than this (s) belong to different windows.
        acceleration: As in :meth:`ResidualWindow.of`.

    Returns:
        None where no window has two epochs.

    Raises:
        ValueError: Times that do not increase.
    """
    times = np.asarray(t, dtype=np.float64)
    u = np.asarray(residual, dtype=np.float64)
    if not np.all(np.diff(times) > 0):
        raise ValueError("epochs must be in increasing order")
    cuts = np.flatnonzero(np.diff(times) > gap) + 1
    pieces = zip(np.split(times, cuts), np.split(u, cuts), strict=True)
    return combine(ResidualWindow.of(a, b, acceleration) for a, b in pieces if len(a) > 1)
