"""The whitening filter: from integrals and GPS epochs to independent rows of unit variance.

The state (:mod:`onboard.core.filter.state`) is an error of what the inertial samples alone would
give; the filter runs over the measurement *and over every column* at once, so that its mean is
``x0 + Xc theta`` (Friedland 1969).

Attitude is carried by the *gyroscope* and corrected by the filter's own estimate after each
epoch (the recorded attitude, an EKF's, errs with the manoeuvre and with the very accelerometer
that is calibrated; it only enters as a slow, loose measurement).  With all noise but the GPS's
set to zero and the recorded attitude taken as it is, the rows are those of the paper's integral
criterion with V(0) eliminated.

Several noise levels run side by side as a *bank* (leading axis); they share attitude and
linearisation, those of member 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.innovation_gates import InnovationGates
from onboard.core.filter.innovations import Epoch, Rows, Step
from onboard.core.filter.noise import ATTITUDE_TIME_S, COLOUR_TIME_S, NoiseLevels
from onboard.core.filter.regressor_noise import ColumnNoise
from onboard.core.filter.state import ATT, BIAS, CH, CV, PSI, STATES, H, V
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY, carried_and_turning
from onboard.core.maths.small_turns import angle_of, skew_of, turn_by

_EYE = np.eye(STATES)
_DOWN = np.array([0.0, 0.0, STANDARD_GRAVITY])


Index = NDArray[np.intp]
Read = tuple[Index, Index, Index]
"""The two states whose sum each row reads, and which of the noise variances is its own."""


@cache
def _read(kinds: str) -> Read:
    """For rows of these kinds: ``v`` velocities, ``h`` height, ``aaa`` attitude."""
    n, h, a = kinds.count("v"), kinds.count("h"), kinds.count("a")
    state = [*range(STATES)]
    return (
        np.array([*state[V][:n], *[H] * h, *state[PSI][:a]]),
        np.array([*state[CV][:n], *[CH] * h, *state[ATT][:a]]),
        np.array([*[0, 1, 2][:n], *[3] * h, *[4, 5, 6][:a]]),
    )


def _diagonal(matrices: Array) -> Array:
    """The diagonals of matrices (..., n, n), to be written to: (..., n)."""
    view: Array = np.einsum("...ii->...i", matrices)
    return view


@dataclass(frozen=True, slots=True)
class Uses:
    """Which measurements and states the filter uses; all but the paper's special case: all."""

    height: bool = True
    attitude: bool = True
    recorded_attitude: bool = False
    earth: bool = True
    gates: bool = True


class WhiteningFilter:
    """Runs through epochs; owns the mean, its columns, the covariances and the attitude."""

    def __init__(
        self, unknowns: int, bank: Sequence[NoiseLevels], uses: Uses | None = None
    ) -> None:
        """Take the number of unknowns and the noise levels of each member."""
        self.m = unknowns
        self.bank = tuple(bank)
        self.uses = uses or Uses()
        B = len(self.bank)
        self._X = np.zeros((B, STATES, unknowns + 1))
        self._P = np.zeros((B, STATES, STATES))
        self.R_nb = np.eye(3)
        self.t = float("nan")
        self._density = np.zeros((B, STATES))
        self._attitude_var = np.zeros((B, 3))
        self._colour_var = np.zeros(B)
        self._row_var = np.zeros((B, 7))
        for i, q in enumerate(self.bank):
            self._density[i, V] = q.force_walk**2
            self._density[i, PSI] = q.tilt_walk**2
            self._density[i, BIAS] = q.bias_walk**2
            self._density[i, CH] = q.height_walk**2
            self._attitude_var[i] = (q.attitude**2, q.attitude**2, q.heading**2)
            self._colour_var[i] = q.velocity_colour**2
            self._row_var[i] = (*(q.velocity**2,) * 3, q.height**2, *(q.attitude**2,) * 3)
        self._gates = InnovationGates(self.bank[0]) if self.uses.gates else None
        # Noise in the columns is only wanted where the sums will count, not while levels are tried.
        self.column_noise = ColumnNoise() if B == 1 else None
        self._updates = 0

    def start(self, epoch: Epoch, R_nb: Array, tilt_sigma: float, heading_sigma: float) -> None:
        """Begin at an epoch: its velocity and height are the state, as uncertain as they are.

        A flat prior on V(0) followed by this first measurement: the exact elimination of the
        nuisance V(0).
        """
        B = len(self.bank)
        self.R_nb = R_nb
        self.t = epoch.t
        X, P = np.zeros_like(self._X), np.zeros_like(self._P)
        velocity = np.where(np.isnan(epoch.velocity), 0.0, epoch.velocity)
        X[:, V, 0] = velocity - R_nb @ epoch.known_body
        X[:, V, 1:] = -(R_nb @ epoch.velocity_body + epoch.velocity_ned)
        X[:, H, 0] = epoch.height - epoch.known_height
        X[:, H, 1:] = (
            R_nb[2] @ epoch.position_body
            + epoch.position_ned[2]
            + velocity[2] * epoch.along_velocity
        )
        var = np.empty((B, STATES))
        var[:, V] = self._row_var[:, :3]
        if np.isnan(epoch.velocity[2]):
            var[:, 2] = 10.0**2
        var[:, H] = self._row_var[:, 3]
        if not self.uses.height:
            var[:, H] = 1e8
        var[:, PSI] = (tilt_sigma**2, tilt_sigma**2, heading_sigma**2)
        var[:, BIAS] = 0.01**2
        var[:, ATT] = self._attitude_var
        var[:, CH] = 0.0
        var[:, CV] = self._colour_var[:, None]
        if self.uses.recorded_attitude:
            var[:, PSI] = var[:, BIAS] = var[:, ATT] = 0.0
        P[:, range(STATES), range(STATES)] = var
        # GPS reads velocity + colour: the start inherits the first fix's colour with minus sign.
        for i in range(3):
            c = CV.start + i
            P[:, i, i] += self._colour_var
            P[:, i, c] = P[:, c, i] = -self._colour_var
        self._X, self._P = X, P
        if self._gates is not None:
            self._gates.forget()
        if self.column_noise is not None:
            self.column_noise.forget()

    @property
    def bias_estimate(self) -> tuple[Array, Array]:
        """Mean of the gyroscope bias of member 0: constant part (3,), columns (3, m)."""
        return self._X[0, BIAS, 0], self._X[0, BIAS, 1:]

    def velocity(self, theta: Array) -> Array:
        """(3,) velocity of member 0 at ``theta``, m/s."""
        v: Array = self._X[0, V, 0] + self._X[0, V, 1:] @ theta
        return v

    def shift_bias(self, by: Array) -> None:
        """The caller subtracts ``by`` more from the gyroscope from now on."""
        self._X[:, BIAS, 0] -= by

    def predict(self, step: Step, theta: Array, latitude: float) -> None:
        """Carry mean, columns and covariance through one interval."""
        T, R = step.duration, self.R_nb
        S, S2 = R @ step.force, R @ step.force_to_end
        A = R @ step.mean_turn
        lever = skew_of(S - S2 / T)
        F = _EYE.copy()
        F[V, PSI] = -skew_of(S)
        F[PSI, BIAS] = -A
        F[V, BIAS] = lever @ A
        F[H, 2] = -T
        F[H, PSI] = skew_of(S2)[2]
        keep_att, keep_cv = math.exp(-T / ATTITUDE_TIME_S), math.exp(-T / COLOUR_TIME_S)
        keep = _diagonal(F)
        keep[ATT], keep[CV] = keep_att, keep_cv

        down = _DOWN
        turn_n = None
        if self.uses.earth:
            carried, turn_n = carried_and_turning(
                latitude, self._X[0, V, 0] + self._X[0, V, 1:] @ theta
            )
            down = down + carried

        X = F @ self._X
        turned = R @ step.columns_turn
        X[:, V, 1:] += R @ step.columns - lever @ turned
        X[:, V, 0] += down * T
        X[:, H, 1:] -= R[2] @ step.columns_to_end
        X[:, H, 0] -= down[2] * T * T / 2.0
        X[:, PSI, 1:] += turned
        self._X = X

        Q = self._density * T
        Q[:, ATT] = self._attitude_var * (1.0 - keep_att**2)
        Q[:, CV] = self._colour_var[:, None] * (1.0 - keep_cv**2)
        if self.uses.recorded_attitude:
            Q[:, PSI] = Q[:, BIAS] = Q[:, ATT] = 0.0
        # Walks act along the interval: half of it before, half after the transition.  What decays
        # has its exact share already.
        before = 0.5 * Q
        before[:, ATT] = before[:, CV] = 0.0
        Q -= before
        P = self._P
        _diagonal(P)[:] += before
        P = F @ P @ F.T
        _diagonal(P)[:] += Q
        self._P = P
        if self.column_noise is not None:
            self.column_noise.predict(F, R, T)
        R = R @ step.turn
        self.R_nb = R if turn_n is None else turn_by(-turn_n * T) @ R
        self.t += T

    def update(self, epoch: Epoch, theta: Array, covariance: Array) -> Rows | None:
        """Take an epoch's measurements; None if nothing was usable.

        Args:
            epoch: the measurements.
            theta: (m,) current estimate, for gates and for the attitude's correction.
            covariance: (m, m) of it.
        """
        refused: list[str] = []
        off = np.zeros(0)
        use_v = epoch.trusted and bool(np.all(np.isfinite(epoch.velocity[:2])))
        use_h = self.uses.height and epoch.trusted and bool(np.isfinite(epoch.height))
        use_a = self.uses.attitude and epoch.R_attitude is not None
        while True:
            rows = self._rows(epoch, theta, use_v=use_v, use_h=use_h, use_a=use_a)
            if rows is None:
                break
            kinds, both, index = rows
            E, HP = both[:, :, : self.m + 1], both[:, :, self.m + 1 :]
            S = HP.take(index[0], axis=2) + HP.take(index[1], axis=2)
            _diagonal(S)[:] += self._row_var[:, index[2]]
            L = np.linalg.cholesky(S)
            whitener = np.linalg.inv(L)
            W = whitener @ both
            y, h, gain = W[:, :, 0], W[:, :, 1 : self.m + 1], W[:, :, self.m + 1 :]
            verdict = None
            if self._gates is not None:
                verdict = self._gates.judge(epoch.t, kinds, E[0], y[0], h[0], theta, covariance)
            if verdict is None:
                break
            bad = verdict.name
            refused.append(bad)
            if verdict.renewed:
                self._renew(bad)
            if bad in {"velocity", "recovery"}:
                n = kinds.count("v")
                off = E[0, :n, 0] - E[0, :n, 1:] @ theta
            use_v, use_h, use_a = (
                use_v and bad not in {"velocity", "recovery"},
                use_h and bad != "height",
                use_a and bad != "attitude",
            )
        if rows is None:
            return None if not refused else self._nothing(epoch.t, refused, off)
        n = kinds.count("v")
        first, columns = E[0, :n, 0], E[0, :n, 1:]
        back = np.swapaxes(gain, -1, -2)
        self._X[:, :, :1] += back @ y[:, :, None]
        self._X[:, :, 1:] -= back @ h
        P = self._P - back @ gain
        self._updates += 1
        if self._updates % 16 == 0:
            # Rounding makes it drift from symmetry only slowly.
            P = (P + np.swapaxes(P, -1, -2)) / 2
        self._P = P
        if self.column_noise is not None:
            self.column_noise.update(whitener[0], back[0], index)
        self._correct(theta)
        log_det = 2.0 * np.log(np.diagonal(L, axis1=1, axis2=2)).sum(axis=1)
        return Rows(
            epoch.t,
            y,
            h,
            log_det,
            n,
            "h" in kinds,
            first - columns @ theta,
            first,
            columns,
            tuple(refused),
            off,
        )

    def _nothing(self, t: float, refused: list[str], off: Array) -> Rows:
        B = len(self.bank)
        empty = np.zeros((B, 0))
        return Rows(
            t,
            empty,
            np.zeros((B, 0, self.m)),
            np.zeros(B),
            0,
            False,  # noqa: FBT003 - a record's field
            np.zeros(0),
            np.zeros(0),
            np.zeros((0, self.m)),
            tuple(refused),
            off,
        )

    def _rows(
        self, epoch: Epoch, theta: Array, *, use_v: bool, use_h: bool, use_a: bool
    ) -> tuple[str, Array, Read] | None:
        """Innovations with their columns and ``H P``, side by side, and what each row reads."""
        X, P, R = self._X, self._P, self.R_nb
        kinds = ""
        if use_v:
            kinds += "vvv" if np.isfinite(epoch.velocity[2]) else "vv"
        if use_h:
            kinds += "h"
        if use_a:
            kinds += "aaa"
        if not kinds:
            return None
        read = first, second, _ = _read(kinds)
        both = np.empty((len(X), len(first), self.m + 1 + STATES))
        E = both[:, :, : self.m + 1]
        np.add(X.take(first, axis=1), X.take(second, axis=1), out=E)
        np.add(P.take(first, axis=1), P.take(second, axis=1), out=both[:, :, self.m + 1 :])
        E[:, :, 0] *= -1.0
        at = 0
        if use_v:
            n = kinds.count("v")
            E[:, :n, 0] += (epoch.velocity - R @ epoch.known_body)[:n]
            E[:, :n, 1:] += (R @ epoch.velocity_body + epoch.velocity_ned)[:n]
            at = n
        if use_h:
            v_down = float(X[0, 2, 0] + X[0, 2, 1:] @ theta)
            E[:, at, 0] += epoch.height - epoch.known_height
            E[:, at, 1:] -= (
                R[2] @ epoch.position_body + epoch.position_ned[2] + v_down * epoch.along_velocity
            )
            at += 1
        if use_a and epoch.R_attitude is not None:
            E[:, at:, 0] += angle_of(epoch.R_attitude @ R.T)
            E[:, at:, 1:] += R @ epoch.attitude_body + epoch.attitude_ned
        return kinds, both, read

    def _renew(self, reference: str) -> None:
        """What it differs by is unknown from here on."""
        if reference == "height":
            self._P[:, CH, CH] += 1e4
        else:
            self._P[:, range(10, 13), range(10, 13)] += 0.3**2

    def _correct(self, theta: Array) -> None:
        """Turn the attitude by the filter's own estimate, so that errors stay small angles."""
        if self.uses.recorded_attitude:
            return
        psi = self._X[0, PSI, 0] + self._X[0, PSI, 1:] @ theta
        self.R_nb = turn_by(psi) @ self.R_nb
        self._X[:, PSI, 0] -= psi
