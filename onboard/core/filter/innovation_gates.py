"""Gates on the filter's innovations: what a measurement may differ by, and when it is back.

Velocity that is impossible is refused until it has been right, and steady, for a while.  Height
and attitude that stay off are no fault but a new reference, which is what the caller is told.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onboard.core.filter.noise import NoiseLevels
from onboard.core.maths.arrays import Array

GATE_VELOCITY = 30.0
"""Chi-square of the velocity innovation past which a fix is refused (3 dof: p of 1e-6)."""
GATE_HEIGHT = 30.0
GATE_ATTITUDE = 60.0
PATIENCE_S = {"height": 3.0, "attitude": 5.0}
"""What stays off for longer is a new reference (a new satellite), not a fault."""
RECOVERY_FIXES, RECOVERY_S = 3, 1.0
"""A velocity is believed again after so many fixes, and so long, inside the gate."""
RECOVERY_SIGMAS, RECOVERY_DRIFT = 7.0, 0.3
"""Between two of them the innovation changes by the receiver's noise (5 sigma of a difference) and
by what the accelerometer is off, m/s^2."""

GATES = (
    ("v", "velocity", GATE_VELOCITY),
    ("h", "height", GATE_HEIGHT),
    ("a", "attitude", GATE_ATTITUDE),
)


@dataclass(frozen=True, slots=True)
class Refusal:
    """What is refused, by name, and whether it has been off so long that it is a new reference."""

    name: str
    renewed: bool = False


class InnovationGates:
    """Judges innovations; remembers since when each kind has been off."""

    def __init__(self, levels: NoiseLevels) -> None:
        """Take the noise levels that the innovations were whitened with."""
        self._noise = float(np.hypot(levels.velocity, levels.velocity_colour))
        self.forget()

    def forget(self) -> None:
        """A new start: nothing has been off."""
        self._velocity_off = False
        self._good: list[tuple[float, Array]] = []
        self._off_since: dict[str, float] = {}

    def judge(
        self, t: float, kinds: str, E: Array, y: Array, h: Array, theta: Array, C: Array
    ) -> Refusal | None:
        """The first group whose innovation is impossible, given all uncertainty.

        Args:
            t: of the epoch, s.
            kinds: one letter a row: ``v``, ``h``, ``a``, in this order.
            E: (r, m + 1) innovations and their columns, not whitened.
            y: (r,) whitened innovations.
            h: (r, m) their columns.
            theta: (m,) estimate.
            C: (m, m) covariance of it.
        """
        at = 0
        for kind, name, limit in GATES:
            n = kinds.count(kind)
            if n == 0:
                continue
            r, D = y[at : at + n] - h[at : at + n] @ theta, h[at : at + n]
            at += n
            chi2 = float(r @ r)
            if chi2 > limit:
                # Only now the estimate's own uncertainty matters: it can but lower the figure.
                chi2 = float(r @ np.linalg.solve(np.eye(n) + D @ C @ D.T, r))
            if chi2 > limit:
                if kind != "v":
                    return Refusal(name, self._outlasts(name, t))
                self._velocity_off, self._good = True, []
                return Refusal(name)
            if kind != "v":
                self._off_since.pop(name, None)
            elif self._velocity_off and self._recovers(t, E[:n, 0] - E[:n, 1:] @ theta):
                return Refusal("recovery")
        return None

    def _recovers(self, t: float, innovation: Array) -> bool:
        """True while a receiver that was off has not been right, and steady, for long enough.

        After seconds of coasting the gate is wide; a receiver that is only noisy falls into it,
        but then its errors jump, while those of the coasting filter cannot.
        """
        if self._good:
            before, last = self._good[-1]
            most = RECOVERY_SIGMAS * self._noise + RECOVERY_DRIFT * (t - before)
            if len(last) != len(innovation) or float(np.abs(innovation - last).max()) > most:
                self._good = []
        self._good.append((t, innovation))
        if len(self._good) < RECOVERY_FIXES or t - self._good[0][0] < RECOVERY_S:
            return True
        self._velocity_off, self._good = False, []
        return False

    def _outlasts(self, name: str, t: float) -> bool:
        """True when a height or attitude has been off for longer than a fault lasts."""
        since = self._off_since.setdefault(name, t)
        if t - since < PATIENCE_S[name]:
            return False
        del self._off_since[name]
        return True
