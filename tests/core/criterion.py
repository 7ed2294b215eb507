"""The integral criterion as published: six unknowns, nothing else, in sums of a few hundred bytes.

Pashayev and Sabziev (2023): with the specific force ``f = alpha f_hat + beta`` per axis, find
alpha and beta that minimise, over the window in which GPS is trusted,

    J^2 = integral of | V(t) - V_0 - integral_0^t (R_nb (alpha f_hat + beta) + g) dtau |^2 dt.

``V - V_0 - g t = H(t) theta + u(t)`` is linear in ``theta = (alpha, beta)``, so that J^2 is a
quadratic whose coefficients are sums over time.  Here MAVLink's axes are used (the matrices
printed in the paper are of another convention than its text), and the initial velocity, which
the paper drops, has a treatment to choose.  There is no model of timing or attitude errors in
it: on a real autopilot the whitened estimator is the one to use, of which this is the special
case without process noise.
"""

from __future__ import annotations

import struct
from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import Array, Vector3
from onboard.core.maths.earth import STANDARD_GRAVITY

_NOMINAL: Final = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
_UPPER: Final = np.triu_indices(6)
_LAYOUT: Final = struct.Struct("<30d")  # 21 of N, 6 of b, s, weight, rows


class InitialVelocity(Enum):
    """What ``V_0`` is taken for."""

    ZERO = "zero"  # as in the paper: the window begins at rest
    FIRST_FIX = "first fix"  # its noise is then on every row
    ELIMINATED = "eliminated"  # three more unknowns, by Schur complement


class Weighting(Enum):
    """What a velocity epoch counts."""

    TIME = "time"  # the integral over time, by the trapezoidal rule
    EPOCHS = "epochs"  # one each: maximum likelihood for equal, independent noise


@dataclass(frozen=True, slots=True)
class CriterionSolution:
    """The minimum: ``f = alpha f_hat + beta`` in m/s^2, ``J`` there, and the rank of the system.

    With a rank below 6 the directions that the window does not show stay at alpha 1, beta 0.
    """

    alpha: Vector3
    beta: Vector3
    residual_l2: float
    rank: int

    def parameters(self, in_force: SixParameters) -> SixParameters:
        """ArduPilot's scale and offset, where ``f_hat`` was made with those in force."""
        scale = np.asarray(self.alpha) * np.asarray(in_force.scale)
        offset = np.asarray(in_force.offset) - np.asarray(self.beta) / scale
        return SixParameters(scale=_vector3(scale), offset=_vector3(offset))


@dataclass(frozen=True, slots=True, eq=False)
class CriterionSums:
    """``J^2(theta) = s - 2 b theta + theta N theta``; adding two gives that of both windows.

    Attributes:
        N: (6, 6) symmetric.
        b: (6,).
        s: The criterion at theta = 0.
        weight: Total weight of the epochs: s, or their number.
        rows: Velocity epochs that are in the sums.
    """

    N: Array
    b: Array
    s: float
    weight: float
    rows: int

    @classmethod
    def zero(cls) -> CriterionSums:
        """The neutral element of addition."""
        return cls(np.zeros((6, 6)), np.zeros(6), 0.0, 0.0, 0)

    def __add__(self, other: CriterionSums) -> CriterionSums:
        return CriterionSums(
            self.N + other.N,
            self.b + other.b,
            self.s + other.s,
            self.weight + other.weight,
            self.rows + other.rows,
        )

    def value(self, theta: ArrayLike) -> float:
        """``J^2`` at (6,) ``theta`` = (alpha, beta)."""
        x = np.asarray(theta, dtype=np.float64)
        return float(self.s - 2 * self.b @ x + x @ self.N @ x)

    def solve(self) -> CriterionSolution:
        """The minimum, by eigenvalues in units that make the diagonal of N one."""
        size = np.sqrt(np.diag(self.N))
        size = np.where(size > 0, size, 1.0)
        eigenvalues, V = np.linalg.eigh(self.N / np.outer(size, size))
        seen = eigenvalues > 6 * np.finfo(np.float64).eps * max(eigenvalues[-1], 0.0)
        gradient = (self.b - self.N @ _NOMINAL) / size
        inverse = np.where(seen, 1 / np.where(seen, eigenvalues, 1.0), 0.0)
        theta = _NOMINAL + (V @ (inverse * (V.T @ gradient))) / size
        return CriterionSolution(
            alpha=_vector3(theta[:3]),
            beta=_vector3(theta[3:]),
            residual_l2=float(np.sqrt(max(0.0, self.value(theta)))),
            rank=int(np.count_nonzero(seen)),
        )

    def to_bytes(self) -> bytes:
        """240 bytes."""
        return _LAYOUT.pack(*self.N[_UPPER], *self.b, self.s, self.weight, self.rows)

    @classmethod
    def from_bytes(cls, data: bytes) -> CriterionSums:
        """Inverse of :meth:`to_bytes`.

        Raises:
            ValueError: Not as many bytes as that, or not numbers.
        """
        if len(data) != _LAYOUT.size:
            raise ValueError(f"sums of the criterion are {_LAYOUT.size} bytes, not {len(data)}")
        numbers = np.array(_LAYOUT.unpack(data))
        if not np.all(np.isfinite(numbers)):
            raise ValueError("sums of the criterion that are not numbers")
        N = np.zeros((6, 6))
        N[_UPPER] = numbers[:21]
        N = N + np.triu(N, 1).T
        return cls(N, numbers[21:27], float(numbers[27]), float(numbers[28]), int(numbers[29]))


class IntegralCriterion:
    """Accumulates the sums of one or several windows, sample by sample.

    The axes are those of ``f_hat``: body with ``R_nb``, or sensor with ``R_nb R_bs``.  Each kind
    of sample comes in order of its time.  A velocity may come ahead, and waits for the specific
    force to reach it; one from before the latest specific force is refused.

    ``horizontal_only`` leaves the vertical out, for receivers that do not tell it (GPS_RAW_INT).
    """

    def __init__(
        self,
        initial_velocity: InitialVelocity = InitialVelocity.ELIMINATED,
        weighting: Weighting = Weighting.TIME,
        gravity: float = STANDARD_GRAVITY,
        *,
        horizontal_only: bool = False,
    ) -> None:
        self._initial_velocity = initial_velocity
        self._weighting = weighting
        self._gravity = gravity
        self._axes = 2 if horizontal_only else 3
        self._closed = CriterionSums.zero()
        self._refused = 0
        self._begin()

    @property
    def refused(self) -> int:
        """Samples and velocities that came too late, or are from before the window."""
        return self._refused

    @property
    def sums(self) -> CriterionSums:
        """Of all windows so far, the present one included."""
        return self._closed + self._window()

    def restart(self) -> None:
        """End the window, as a gap does: the sums stay, integrals and ``V_0`` begin anew."""
        self._closed = self._closed + self._window()
        self._begin()

    def _begin(self) -> None:
        self._start: float | None = None
        self._t = 0.0
        self._integrand = np.zeros((3, 6))
        self._H = np.zeros((3, 6))
        self._waiting: deque[tuple[float, Array]] = deque()
        self._reference: Array | None = None
        self._previous: tuple[float, Array] | None = None
        # Rows are (axes, 7): H and y side by side.  Moments about the mean where it is eliminated.
        self._weight = 0.0
        self._rows = 0
        self._mean = np.zeros((self._axes, 7))
        self._moments = np.zeros((7, 7))

    def specific_force(self, t: float, f_hat: ArrayLike, R_nb: ArrayLike) -> None:
        """One sample; between samples the integrand is taken for a straight line.

        Args:
            t: s.
            f_hat: (3,) m/s^2.
            R_nb: (3, 3) at the same time.
        """
        R = np.asarray(R_nb, dtype=np.float64)
        integrand = np.hstack([R * np.asarray(f_hat, dtype=np.float64), R])
        if self._start is None:
            self._start = self._t = t
            self._integrand = integrand
            # At the very start the integral is zero: a velocity there is a row already.
            self._meet_velocities(t, integrand)
            return
        if t <= self._t:
            self._refused += 1
            return
        self._meet_velocities(t, integrand)
        self._H = self._H + 0.5 * (t - self._t) * (self._integrand + integrand)
        self._t, self._integrand = t, integrand

    def velocity(self, t: float, v_n: ArrayLike) -> None:
        """One velocity over ground.

        Args:
            t: s.
            v_n: (3,) m/s; the third is not looked at where only the horizontal counts.
        """
        newest = self._waiting[-1][0] if self._waiting else -np.inf
        if not self._waiting and self._previous is not None:
            newest = self._previous[0]
        reached = -np.inf if self._start is None else self._t
        if t <= newest or t < reached:
            self._refused += 1
            return
        self._waiting.append((t, np.asarray(v_n, dtype=np.float64)))
        if self._start is not None:
            self._meet_velocities(self._t, self._integrand)

    def _meet_velocities(self, t: float, integrand: Array) -> None:
        """Rows for the velocities that wait, up to ``t``, on the way to the integrand there."""
        start = self._t if self._start is None else self._start
        while self._waiting and self._waiting[0][0] <= t:
            at, v_n = self._waiting.popleft()
            if at < start:
                self._refused += 1
                continue
            h = at - self._t
            share = h / (t - self._t) if t > self._t else 0.0
            there = self._integrand + share * (integrand - self._integrand)
            H = self._H + 0.5 * h * (self._integrand + there)
            y = v_n - np.array([0.0, 0.0, self._gravity * (at - start)])
            self._epoch(at, np.hstack([H, y[:, None]])[: self._axes])

    def _epoch(self, t: float, row: Array) -> None:
        if self._initial_velocity is InitialVelocity.FIRST_FIX:
            if self._reference is None:
                self._reference = row
            row = row - self._reference
        self._rows += 1
        if self._weighting is Weighting.EPOCHS:
            self._add(row, 1.0)
        elif self._previous is not None:
            half = 0.5 * (t - self._previous[0])
            self._add(self._previous[1], half)
            self._add(row, half)
        self._previous = (t, row)

    def _add(self, row: Array, weight: float) -> None:
        if self._initial_velocity is not InitialVelocity.ELIMINATED:
            self._weight += weight
            self._moments += weight * row.T @ row
            return
        # V_0 has a unit column per axis: its Schur complement is the moment about the mean,
        # updated by West's recursion (1979), which never subtracts large numbers.
        total = self._weight + weight
        away = row - self._mean
        self._mean = self._mean + (weight / total) * away
        self._moments += (weight * self._weight / total) * away.T @ away
        self._weight = total

    def _window(self) -> CriterionSums:
        # Symmetric to the last bit: half of it is what is stored.
        M = 0.5 * (self._moments + self._moments.T)
        return CriterionSums(M[:6, :6], M[:6, 6], float(M[6, 6]), float(self._weight), self._rows)


def _vector3(values: Array) -> Vector3:
    x, y, z = values.tolist()
    return (x, y, z)
