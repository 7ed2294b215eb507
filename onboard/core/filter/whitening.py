"""The whitening filter: from integrals and fixes to independent innovations of unit variance.

The state (:mod:`onboard.core.filter.state`) is an error of what the inertial samples alone would
give.  The filter runs over the measurement *and over every regressor* at once, so that its mean is
``x0 + Xc theta`` (Friedland 1969), and its innovations are linear in the unknowns ``theta``.

Attitude is carried by the *gyroscope* and corrected by the filter's own estimate after each
epoch.  The recorded attitude, an EKF's, errs with the manoeuvre and with the very accelerometer
that is calibrated; it only enters as a loose measurement with a Gauss-Markov error.  With all
noise but the GPS's set to zero and the recorded attitude taken as it is, the innovations are those
of the published integral criterion with V(0) eliminated.

Several noise levels run side by side as a *filter bank* (leading axis); they share attitude and
linearisation, those of member 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.filter.innovation_gates import InnovationGates
from onboard.core.filter.innovations import Epoch, Step, WhitenedInnovations
from onboard.core.filter.limits import (
    ATTITUDE_TIME_S,
    COLOUR_TIME_S,
    RENEWED_ATTITUDE_VAR,
    RENEWED_HEIGHT_VAR,
    SYMMETRY_UPDATES,
)
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.readings import innovations, kinds_of, reading
from onboard.core.filter.regressor_noise import RegressorNoise
from onboard.core.filter.state import ATT, BIAS, CH, CV, PSI, STATES, H, V
from onboard.core.filter.variances import Variances
from onboard.core.filter.whitened import Whitened, nothing, whiten
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY, carried_and_turning
from onboard.core.maths.small_turns import skew_of, turn_by

_EYE = np.eye(STATES)
_DOWN = np.array([0.0, 0.0, STANDARD_GRAVITY])
_LETTER = {"velocity": "v", "recovery": "v", "height": "h", "attitude": "a"}


def _diagonal(matrices: Array) -> Array:
    """The diagonals of matrices (..., n, n), to be written to: (..., n)."""
    view: Array = np.einsum("...ii->...i", matrices)
    return view


@dataclass(frozen=True, slots=True)
class Uses:
    """Which measurements and states a filter uses; all, except to show a special case.

    Attributes:
        height: of the fixes.
        attitude: the recorded one, as a loose measurement.
        recorded_attitude: take it for exact instead.
        earth: rotation of the earth and of the local frame.
        gates: refuse what is impossible.
    """

    height: bool = True
    attitude: bool = True
    recorded_attitude: bool = False
    earth: bool = True
    gates: bool = True


class WhiteningFilter:
    """Runs through epochs; owns the mean, its regressors, the covariances and the attitude.

    Attributes:
        m: number of unknowns.
        bank: noise levels of the B members.
        R_nb: (3, 3) attitude, body axes to NED.
        t: time on the boot clock, s.
        regressor_noise: noise in the regressors; None while several levels are tried, for only
            the sums that count need it.
    """

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
        self._variances = Variances(self.bank)
        self._gates = InnovationGates(self.bank[0]) if self.uses.gates else None
        self.regressor_noise = RegressorNoise() if B == 1 else None
        self._updates = 0

    def start(self, epoch: Epoch, R_nb: Array, tilt_sigma: float, heading_sigma: float) -> None:
        """Begin at an epoch: its velocity and height are the state, as uncertain as they are.

        A flat prior on V(0) followed by this first measurement is the exact elimination of the
        nuisance V(0).

        Args:
            epoch: has a velocity to be believed.
            R_nb: (3, 3) attitude there.
            tilt_sigma: of its roll and pitch, rad.
            heading_sigma: of its heading, rad.
        """
        self.R_nb = R_nb
        self.t = epoch.t
        X = np.zeros_like(self._X)
        velocity = np.where(np.isnan(epoch.velocity), 0.0, epoch.velocity)
        X[:, V, 0] = velocity - R_nb @ epoch.known_body
        X[:, V, 1:] = -(R_nb @ epoch.velocity_body + epoch.velocity_ned)
        X[:, H, 0] = epoch.height - epoch.known_height
        X[:, H, 1:] = (
            R_nb[2] @ epoch.position_body
            + epoch.position_ned[2]
            + velocity[2] * epoch.along_velocity
        )
        self._X = X
        self._P = self._variances.at_start(
            tilt_sigma,
            heading_sigma,
            down=not np.isnan(epoch.velocity[2]),
            height=self.uses.height,
            attitude=not self.uses.recorded_attitude,
        )
        if self._gates is not None:
            self._gates.forget()
        if self.regressor_noise is not None:
            self.regressor_noise.forget()

    @property
    def bias_estimate(self) -> tuple[Array, Array]:
        """Gyroscope bias of member 0, rad/s: (3,) at ``theta = 0``, and its regressors (3, m)."""
        return self._X[0, BIAS, 0], self._X[0, BIAS, 1:]

    def velocity(self, theta: Array) -> Array:
        """(3,) velocity of member 0 at ``theta`` (m,), NED, m/s."""
        v: Array = self._X[0, V, 0] + self._X[0, V, 1:] @ theta
        return v

    def shift_bias(self, by: Array) -> None:
        """The caller subtracts ``by`` (3,), rad/s, more from the gyroscope from now on."""
        self._X[:, BIAS, 0] -= by

    def predict(self, step: Step, theta: Array, latitude: float) -> None:
        """Carry mean, regressors and covariance through one step.

        Args:
            step: integrals over it.
            theta: (m,) current estimate, for the velocity that the earth's rotation acts on.
            latitude: rad.
        """
        T, R = step.duration, self.R_nb
        S, S2 = R @ step.force, R @ step.force_to_end
        A = R @ step.mean_turn
        arm = skew_of(S - S2 / T)
        keep_att, keep_cv = math.exp(-T / ATTITUDE_TIME_S), math.exp(-T / COLOUR_TIME_S)
        F = _EYE.copy()
        F[V, PSI] = -skew_of(S)
        F[PSI, BIAS] = -A
        F[V, BIAS] = arm @ A
        F[H, 2] = -T
        F[H, PSI] = skew_of(S2)[2]
        keep = _diagonal(F)
        keep[ATT], keep[CV] = keep_att, keep_cv

        down, turn_n = _DOWN, None
        if self.uses.earth:
            carried, turn_n = carried_and_turning(latitude, self.velocity(theta))
            down = down + carried

        X = F @ self._X
        turned = R @ step.columns_turn
        X[:, V, 1:] += R @ step.columns - arm @ turned
        X[:, V, 0] += down * T
        X[:, H, 1:] -= R[2] @ step.columns_to_end
        X[:, H, 0] -= down[2] * T * T / 2.0
        X[:, PSI, 1:] += turned
        self._X = X

        before, after = self._variances.over(
            T, keep_att, keep_cv, attitude=not self.uses.recorded_attitude
        )
        P = self._P
        _diagonal(P)[:] += before
        P = F @ P @ F.T
        _diagonal(P)[:] += after
        self._P = P
        if self.regressor_noise is not None:
            self.regressor_noise.predict(F, R, T)
        R = R @ step.turn
        self.R_nb = R if turn_n is None else turn_by(-turn_n * T) @ R
        self.t += T

    def update(self, epoch: Epoch, theta: Array, covariance: Array) -> WhitenedInnovations | None:
        """Take an epoch's measurements, without those that a gate refuses.

        Args:
            epoch: the measurements.
            theta: (m,) current estimate, for gates and for the attitude's correction.
            covariance: (m, m) of it.

        Returns:
            None if there was nothing to take and nothing to refuse.
        """
        refused: list[str] = []
        off = np.zeros(0)
        kinds = kinds_of(
            epoch,
            velocity=epoch.trusted,
            height=self.uses.height and epoch.trusted,
            attitude=self.uses.attitude,
        )
        while kinds:
            made = self._whitened(epoch, theta, kinds)
            refusal = None
            if self._gates is not None:
                refusal = self._gates.judge(
                    epoch.t, kinds, made.E[0], made.y[0], made.h[0], theta, covariance
                )
            if refusal is None:
                self._take(made, theta)
                return made.innovations(epoch.t, theta, refused, off)
            refused.append(refusal.name)
            if refusal.renewed:
                self._renew(refusal.name)
            letter = _LETTER[refusal.name]
            if letter == "v":
                n = kinds.count("v")
                off = made.E[0, :n, 0] - made.E[0, :n, 1:] @ theta
            kinds = kinds.replace(letter, "")
        return nothing(len(self.bank), self.m, epoch.t, refused, off) if refused else None

    def expected_velocity(
        self, epoch: Epoch, theta: Array, covariance: Array
    ) -> tuple[Array, Array] | None:
        """Compare an epoch's velocity with dead reckoning, without taking it.

        Args:
            epoch: the measurement, to be believed or not.
            theta: (m,) current estimate.
            covariance: (m, m) of it.

        Returns:
            Innovation (v,), NED, m/s, and its covariance (v, v), all uncertainty included; None
            where the epoch has no velocity.
        """
        kinds = kinds_of(epoch, velocity=True, height=False, attitude=False)
        if not kinds:
            return None
        first, second, noise = reading(kinds)
        both = innovations(self._X, self._P, self.R_nb, epoch, theta, kinds)
        E, HP = both[0, :, : self.m + 1], both[0, :, self.m + 1 :]
        S = HP[:, first] + HP[:, second] + np.diag(self._variances.reading[0, noise])
        D = E[:, 1:]
        return E[:, 0] - D @ theta, S + D @ covariance @ D.T

    def _whitened(self, epoch: Epoch, theta: Array, kinds: str) -> Whitened:
        both = innovations(self._X, self._P, self.R_nb, epoch, theta, kinds)
        return whiten(both, self._variances.reading, kinds)

    def _take(self, made: Whitened, theta: Array) -> None:
        """Update mean, regressors and covariance; turn the attitude by what was found."""
        back = np.swapaxes(made.gain, -1, -2)
        self._X[:, :, :1] += back @ made.y[:, :, None]
        self._X[:, :, 1:] -= back @ made.h
        P = self._P - back @ made.gain
        self._updates += 1
        if self._updates % SYMMETRY_UPDATES == 0:
            P = (P + np.swapaxes(P, -1, -2)) / 2
        self._P = P
        if self.regressor_noise is not None:
            self.regressor_noise.update(made.whitener[0], back[0], made.read)
        if self.uses.recorded_attitude:
            return
        # Turned by the filter's own estimate, so that errors stay small angles.
        psi = self._X[0, PSI, 0] + self._X[0, PSI, 1:] @ theta
        self.R_nb = turn_by(psi) @ self.R_nb
        self._X[:, PSI, 0] -= psi

    def _renew(self, reference: str) -> None:
        """What a reference (``height`` or ``attitude``) differs by is unknown from here on."""
        if reference == "height":
            self._P[:, CH, CH] += RENEWED_HEIGHT_VAR
        else:
            _diagonal(self._P)[:, ATT] += RENEWED_ATTITUDE_VAR
