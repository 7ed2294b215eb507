"""Gates on the filter's innovations: what a measurement may differ by, and when it is back.

A gate compares the normalised innovation squared (NIS) of a measurement, ``r^T S^-1 r``, with the
chi-square distribution that it has if the filter's model is right.

A velocity outside its gate is refused until it has been inside, and steady, for a while.  A height
that stays outside is no fault but a new reference, and the caller is told so.  The recorded
attitude comes from a filter that carries it with the gyroscope: it is never wrong for one epoch.
But it is set anew at times (an alignment in flight, another compass, another core), or pulled
after a compass that is off by as much as half a radian a second.  So no gate refuses it; what is in
the tail of its distribution is a move of its own, tilt and heading each for itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from onboard.core.filter.limits import (
    GATE_HEIGHT,
    GATE_VELOCITY,
    PATIENCE_S,
    RECEIVER_M_S,
    RECOVERY_DRIFT,
    RECOVERY_FIXES,
    RECOVERY_S,
    RECOVERY_SIGMAS,
    TAIL,
)
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.uncertainty import Uncertainty
from onboard.core.maths.arrays import Array

GATES = (
    ("v", "velocity", GATE_VELOCITY),
    ("h", "height", GATE_HEIGHT),
)


def _nis(r: Array, h: Array, C: Uncertainty) -> float:
    """Normalised innovation squared of whitened ``r`` (n,), the estimate's uncertainty included."""
    return float(r @ np.linalg.solve(np.eye(len(r)) + C.along(h), r))


def _nis_of_any_receiver(E: Array, theta: Array, C: Uncertainty, whitener: Array) -> float:
    """The same of velocities (n), for a receiver that errs as much as a good one may.

    Args:
        E: (n, m + 1) innovations and their regressors, not whitened.
        theta: (m,) estimate.
        C: how well it is known.
        whitener: (n, n) of them.
    """
    r, D = E[:, 0] - E[:, 1:] @ theta, E[:, 1:]
    root = np.linalg.inv(whitener)
    S = root @ root.T + C.along(D) + RECEIVER_M_S**2 * np.eye(len(r))
    return float(r @ np.linalg.solve(S, r))


def tails(kinds: str, innovations: Array, h: Array, C: Uncertainty) -> dict[str, float]:
    """By what factor the variance of a kind of measurement is larger than it is taken for.

    Args:
        kinds: one letter for each of the r innovations, as in
            :mod:`~onboard.core.filter.readings`.
        innovations: (r,) whitened, at the estimate.
        h: (r, m) their regressors.
        C: how well the estimate is known.

    Returns:
        By kind, what is in the tail of its distribution (:data:`~onboard.core.filter.limits.TAIL`).
    """
    out: dict[str, float] = {}
    squares = innovations * innovations
    for kind in "vhty":
        n = kinds.count(kind)
        if n == 0:
            continue
        at = kinds.index(kind)
        here = slice(at, at + n)
        if squares[here].sum() > TAIL[n]:
            nis = _nis(innovations[here], h[here], C)
            if nis > TAIL[n]:
                out[kind] = nis / TAIL[n]
    return out


@dataclass(frozen=True, slots=True)
class GateRefusal:
    """A measurement that a gate refused.

    Attributes:
        name: ``velocity``, ``height``, or ``recovery`` for a velocity inside the gate that was
            outside a moment ago.
        renewed: whether it is a new reference: a height that has been outside for so long.
    """

    name: str
    renewed: bool = False


class InnovationGates:
    """Judges innovations; remembers since when each kind of measurement has been refused."""

    def __init__(self, levels: NoiseLevels) -> None:
        """Take the noise levels that the innovations were whitened with."""
        self._noise = math.hypot(levels.velocity, levels.velocity_colour)
        self.forget()

    def forget(self) -> None:
        """A new start: nothing has been off."""
        self._velocity_off = False
        self._good: list[tuple[float, Array]] = []
        self._height_off_since: float | None = None

    @property
    def recovering(self) -> bool:
        """Whether a velocity was outside, and has not been inside and steady for long enough."""
        return self._velocity_off

    def height_is_inside(self) -> None:
        """A height was inside its gate."""
        self._height_off_since = None

    def judge(
        self,
        t: float,
        kinds: str,
        E: Array,
        y: Array,
        h: Array,
        theta: Array,
        C: Uncertainty,
        whitener: Array,
        *,
        wider: float = 1.0,
        velocity: str | None = None,
    ) -> GateRefusal | None:
        """Find the first measurement whose innovation is impossible, given all uncertainty.

        Args:
            t: time of the epoch, s.
            kinds: one letter for each of the r innovations, as in
                :mod:`~onboard.core.filter.readings`.
            E: (r, m + 1) innovations and their regressors, not whitened.
            y: (r,) whitened innovations at ``theta = 0``.
            h: (r, m) their regressors.
            theta: (m,) estimate.
            C: how well it is known.
            whitener: (r, r) what innovations are multiplied by to be white.
            wider: how many times its usual error the receiver states for the velocity.
            velocity: which gate refuses it, where that is known, empty for none; None: judge it.

        Returns:
            None if all may be used.
        """
        at = 0
        innovations = y - h @ theta
        squares = (innovations * innovations).tolist()
        for kind, name, limit in GATES:
            n = kinds.count(kind)
            if n == 0:
                continue
            here = slice(at, at + n)
            at += n
            if kind == "v" and velocity is not None:
                if velocity:
                    return GateRefusal(velocity)
                continue
            nis = sum(squares[here])
            if nis > limit:
                # Only now the estimate's own uncertainty matters: it can but lower the figure.
                nis = _nis(innovations[here], h[here], C)
            if kind == "v" and nis > limit:
                nis = _nis_of_any_receiver(E[:n], theta, C, whitener[:n, :n])
            if nis > limit:
                return self._outside(kind, name, t)
            if kind == "h":
                self.height_is_inside()
            elif kind == "v" and self._recovers(
                t, E[:n, 0] - E[:n, 1:] @ theta, math.hypot(wider * self._noise, RECEIVER_M_S)
            ):
                return GateRefusal("recovery")
        return None

    def _outside(self, kind: str, name: str, t: float) -> GateRefusal:
        """What becomes of a measurement that its gate refuses."""
        if kind == "v":
            self._velocity_off, self._good = True, []
            return GateRefusal(name)
        return GateRefusal(name, renewed=self._outlasts(t))

    def _recovers(self, t: float, innovation: Array, noise: float) -> bool:
        """True while a receiver that was off has not been right, and steady, for long enough.

        After seconds of dead reckoning the gate is wide; a receiver that is only noisy falls into
        it, but then its errors jump, while those of dead reckoning cannot.
        """
        if not self._velocity_off:
            return False
        if self._good:
            before, last = self._good[-1]
            most = RECOVERY_SIGMAS * noise + RECOVERY_DRIFT * (t - before)
            if len(last) != len(innovation) or float(np.abs(innovation - last).max()) > most:
                self._good = []
        self._good.append((t, innovation))
        if len(self._good) < RECOVERY_FIXES or t - self._good[0][0] < RECOVERY_S:
            return True
        self._velocity_off, self._good = False, []
        return False

    def _outlasts(self, t: float) -> bool:
        """True when a height has been off for longer than a fault lasts."""
        if self._height_off_since is None:
            self._height_off_since = t
        if t - self._height_off_since < PATIENCE_S:
            return False
        self._height_off_since = None
        return True
