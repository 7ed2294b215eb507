"""The whitening filter: from integrals and fixes to independent innovations of unit variance.

The state (:mod:`onboard.core.filter.state`) is an error of what the inertial samples alone would
give.  The filter runs over the measurement *and over every regressor* at once, so that its mean is
``x0 + Xc theta`` (Friedland 1969), and its innovations are linear in the unknowns ``theta``.

Attitude is carried by the *gyroscope* and corrected by the filter's own estimate after each
epoch.  The recorded attitude, an EKF's, errs with the manoeuvre and with the very accelerometer
that is calibrated; it only enters as a loose measurement with a slow error.  With all
noise but the GPS's set to zero and the recorded attitude taken as it is, the innovations are those
of the published integral criterion with V(0) eliminated.

Several noise levels run side by side as a *filter bank* (leading axis); they share attitude and
linearisation, those of member 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.filter.innovation_gates import GateRefusal, InnovationGates, tails
from onboard.core.filter.innovations import Epoch, Step, WhitenedInnovations
from onboard.core.filter.kernel import (
    Process,
    Whitening,
    chosen,
    covariances,
    diagonal,
)
from onboard.core.filter.limits import (
    ANEW,
    ANYTHING,
    ATTITUDE_TIME_S,
    COLOUR_TIME_S,
    RENEWED_HEIGHT_VAR,
    SYMMETRY_UPDATES,
)
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.readings import kinds_of, reading
from onboard.core.filter.refused import Refused
from onboard.core.filter.smooth_error import moved
from onboard.core.filter.state import ATT, BIAS, CH, MEASURED, PSI, RATE, STATES, H, V
from onboard.core.filter.uncertainty import Uncertainty
from onboard.core.filter.variances import Variances
from onboard.core.filter.whitened import nothing, whitened
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY, carried_and_turning
from onboard.core.maths.small_turns import angle_of, turn_by

_NOT_TURNED = np.zeros(3)
_LETTER = {"velocity": "v", "recovery": "v", "height": "h"}
_SLOW_ERROR = {"t": slice(ATT.start, ATT.stop - 1), "y": slice(ATT.stop - 1, ATT.stop)}
_SET_ANEW = {"t": "tilt", "y": "heading"}


@dataclass(frozen=True, slots=True)
class Uses:
    """Which measurements and states a filter uses; all, except to show a special case.

    Attributes:
        height: of the fixes.
        attitude: the recorded one, as a loose measurement.
        recorded_attitude: take it for exact instead.
        earth: rotation of the earth and of the local frame.
        gates: refuse what is impossible.
        refused: velocities that are refused whatever they are, and no others; None: those that are
            impossible.  Models can only be compared on the same measurements.
    """

    height: bool = True
    attitude: bool = True
    recorded_attitude: bool = False
    earth: bool = True
    gates: bool = True
    refused: Refused | None = None


class WhiteningFilter:
    """Runs through epochs; owns the mean, its regressors, the covariances and the attitude.

    Attributes:
        m: number of unknowns.
        bank: noise levels of the B members.
        uses: measurements that are used.
        carried: (B, STATES, C) as in :mod:`onboard.core.filter.kernel`, whose functions ``kernel``
            has.
        variances: of the levels.
        gates: None: nothing is refused.
        updates: how many there have been.
        R_nb: (3, 3) attitude, body axes to NED.
        t: time on the boot clock, s.
        taken_t: of the last epoch of which something was taken, s.
        noise_gram: (3,) sum since :meth:`begin_block` of the squares of what the walk along each
            body axis makes of the whitened innovations
            (:mod:`onboard.core.filter.regressor_noise`); None while several levels are tried, for
            only the sums that count need it, and where it is not asked for.
    """

    def __init__(
        self,
        unknowns: int,
        bank: Sequence[NoiseLevels],
        uses: Uses | None = None,
        *,
        walk: bool = True,
    ) -> None:
        """Take the number of unknowns, the levels of each member, and whether a walk is carried."""
        self.m = unknowns
        self.bank = tuple(bank)
        self.uses = uses or Uses()
        B = len(self.bank)
        self.noise_gram = np.zeros(3) if B == 1 and walk else None
        self._m1 = unknowns + 1
        matrices = 1 if self.noise_gram is None else 4
        self.carried = np.zeros((B, STATES, self._m1 + matrices * STATES))
        self.R_nb = np.eye(3)
        self.t = float("nan")
        self.taken_t = self.t
        self.kernel = chosen()
        self.variances = Variances(self.bank, attitude=not self.uses.recorded_attitude)
        self.gates = InnovationGates(self.bank[0]) if self.uses.gates else None
        self.updates = 0

    @property
    def calm(self) -> bool:
        """Whether no velocity was refused that has to recover."""
        return self.gates is None or not self.gates.recovering

    def begin_block(self) -> None:
        """Count :attr:`noise_gram` from here on; the noise that was integrated goes on."""
        if self.noise_gram is not None:
            self.noise_gram = np.zeros(3)

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
        self.t = self.taken_t = epoch.t
        down = float(epoch.velocity[2])
        known = not math.isnan(down)
        z = self.kernel.measured(R_nb, epoch, down if known else 0.0, _NOT_TURNED)
        if not known:
            z[2, 0] = R_nb[2] @ epoch.body[:3, 0]
        m1 = self._m1
        self.carried[:] = 0.0
        self.carried[:, V, :m1] = z[V]
        self.carried[:, H, :m1] = z[H]
        covariances(self.carried, m1)[:, 0] = self.variances.at_start(
            tilt_sigma,
            heading_sigma,
            epoch.stated,
            down=known,
            height=self.uses.height,
        )
        if self.gates is not None:
            self.gates.forget()

    def bias(self, theta: Array) -> Array:
        """(3,) gyroscope bias of member 0 at ``theta`` (m,), body axes, rad/s."""
        return self._mean(BIAS, theta)

    def velocity(self, theta: Array) -> Array:
        """(3,) velocity of member 0 at ``theta`` (m,), NED, m/s."""
        return self._mean(V, theta)

    def _mean(self, states: slice, theta: Array) -> Array:
        X = self.carried[0, states, : self._m1]
        mean: Array = X[:, 0] - X[:, 1:] @ theta
        return mean

    def shift_bias(self, by: Array) -> None:
        """The caller subtracts ``by`` (3,), rad/s, more from the gyroscope from now on."""
        self.carried[:, BIAS, 0] -= by

    def predict(self, step: Step, theta: Array, latitude: float) -> None:
        """Carry mean, regressors and covariance through one step.

        Args:
            step: integrals over it.
            theta: (m,) current estimate, for the velocity that the earth's rotation acts on.
            latitude: rad.
        """
        T, R = step.duration, self.R_nb
        north, east, down, turn_n = 0.0, 0.0, STANDARD_GRAVITY, None
        if self.uses.earth:
            carried, turn_n = carried_and_turning(latitude, self.velocity(theta))
            north, east, more = carried.tolist()
            down += more
        fall = np.array([north * T, east * T, down * T, -0.5 * T * T * down, 0.0, 0.0, 0.0])
        cv, tilt = math.exp(-T / COLOUR_TIME_S), math.exp(-T / ATTITUDE_TIME_S)
        decay = np.empty((len(self.bank), MEASURED))
        decay[:] = (cv, cv, cv, 1.0, tilt, tilt, 1.0)
        decay[:, -1], swing = moved(T, self.variances.heading_time)
        process = Process(
            fall, decay, swing, *self.variances.over(T, decay, step.stated, step.shaken)
        )
        self.kernel.predict(self.carried, R, step, process)
        R = R @ step.turn
        self.R_nb = R if turn_n is None else turn_by(-turn_n * T) @ R
        self.t += T

    def update(
        self, epoch: Epoch, theta: Array, uncertainty: Uncertainty
    ) -> WhitenedInnovations | None:
        """Take an epoch's measurements, without those that a gate refuses.

        Args:
            epoch: the measurements.
            theta: (m,) current estimate, for gates and for the attitude's correction.
            uncertainty: how well it is known.

        Returns:
            None if there was nothing to take and nothing to refuse.
        """
        kinds = kinds_of(
            epoch,
            velocity=epoch.trusted,
            height=self.uses.height and epoch.trusted,
            attitude=self.uses.attitude,
        )
        if not kinds:
            return None
        refused: list[str] = []
        off = np.zeros(0)
        unlikely = np.zeros(len(self.bank))
        z = self._measured(epoch, theta)
        white = self.variances.of_reading(epoch.noise, epoch.moving, epoch.stated)
        while kinds:
            made = self.kernel.whiten(self.carried, z, reading(kinds), white)
            refusal = self._refusal(epoch, kinds, made, theta, uncertainty)
            if refusal is None:
                if self.gates is not None:
                    y, h = made.W[0, :, 0], made.W[0, :, 1 : self._m1]
                    wider = tails(kinds, y - h @ theta, h, uncertainty)
                    refused += [_SET_ANEW[k] for k, x in wider.items() if x > ANEW.get(k, np.inf)]
                    made = self._widened(made, z, kinds, white, wider)
                self._take(made, kinds, theta)
                self.taken_t = epoch.t
                return whitened(made, kinds, epoch.t, theta, refused, off, unlikely)
            if refusal.name not in refused:
                refused.append(refusal.name)
            letter = _LETTER[refusal.name]
            unlikely += self._surprise(z, letter * kinds.count(letter), white, theta)
            if refusal.renewed:
                self._renew_height()
            if letter == "v":
                n = kinds.count("v")
                off = made.E[:n, 0] - made.E[:n, 1:] @ theta
            kinds = kinds.replace(letter, "")
        return nothing(len(self.bank), self.m, epoch.t, refused, off, unlikely)

    def _refusal(
        self, epoch: Epoch, kinds: str, made: Whitening, theta: Array, uncertainty: Uncertainty
    ) -> GateRefusal | None:
        """What the gates say of an epoch's innovations; None where there are none, or nothing."""
        if self.gates is None:
            return None
        refused = self.uses.refused
        return self.gates.judge(
            epoch.t,
            kinds,
            made.E,
            made.W[0, :, 0],
            made.W[0, :, 1 : self._m1],
            theta,
            uncertainty,
            made.whitener,
            wider=math.sqrt(self.variances.times(epoch.stated)[0].max()),
            velocity=None if refused is None else refused.by(epoch.stamp),
        )

    def _widened(
        self, made: Whitening, z: Array, kinds: str, white: Array, wider: Mapping[str, float]
    ) -> Whitening:
        """The same innovations, with more noise for what is in the tail of its distribution.

        Args:
            made: innovations.
            z: as in :func:`~onboard.core.filter.kernel.whiten`.
            kinds: one letter for each, as in :mod:`~onboard.core.filter.readings`.
            white: (B, MEASURED) variances of their white noise.
            wider: by what factor the variance of a kind is larger than it is taken for.
        """
        if not wider:
            return made
        white = white.copy()
        for kind, factor in wider.items():
            if kind in "ty":
                at = kinds.index(kind)
                here = slice(at, at + kinds.count(kind))
                self._move_by_itself(kind, (factor - 1.0) * np.exp(made.log_var[0, here]))
            else:
                white[:, reading(kind * kinds.count(kind)).number] *= factor
        return self.kernel.whiten(self.carried, z, reading(kinds), white)

    def _move_by_itself(self, kind: str, more: Array) -> None:
        """The recorded attitude was set anew since the last epoch, or began to be turned.

        Args:
            kind: tilt (t) or heading (y).
            more: (2,) or (1,) variance of what it moved by, rad^2.
        """
        var = diagonal(self.carried, self._m1)
        var[:, _SLOW_ERROR[kind]] += more
        if kind == "y":
            var[:, RATE] += float(more[0]) / (self.t - self.taken_t) ** 2

    def _surprise(self, z: Array, kinds: str, white: Array, theta: Array) -> Array:
        """What a refused measurement takes off twice the log-likelihood of each member, (B,).

        It is noise, or anything at all, whichever is likelier.  Had it no say, levels would become
        likelier by making the gate refuse more.
        """
        made = self.kernel.whiten(self.carried, z, reading(kinds), white)
        y = made.W[:, :, 0] - made.W[:, :, 1 : self._m1] @ theta
        out: Array = np.minimum(made.log_var.sum(axis=1) + (y * y).sum(axis=1), ANYTHING[kinds])
        return out

    def _measured(self, epoch: Epoch, theta: Array) -> Array:
        turned = _NOT_TURNED
        if self.uses.attitude and epoch.R_attitude is not None:
            turned = angle_of(epoch.R_attitude @ self.R_nb.T)
        down = self.carried[0, 2, : self._m1]
        v_down = float(down[0] - down[1:] @ theta)
        return self.kernel.measured(self.R_nb, epoch, v_down, turned)

    def _take(self, made: Whitening, kinds: str, theta: Array) -> None:
        """Update all that is carried; turn the attitude by what was found."""
        self.kernel.take(self.carried, made, reading(kinds), self.noise_gram)
        self.updates += 1
        if self.updates % SYMMETRY_UPDATES == 0:
            P = covariances(self.carried, self._m1)[:, 0]
            P[:] = (P + np.swapaxes(P, -1, -2)) / 2
        if self.uses.recorded_attitude:
            return
        # Turned by the filter's own estimate, so that errors stay small angles.
        psi = self._mean(PSI, theta)
        self.R_nb = turn_by(psi) @ self.R_nb
        self.carried[:, PSI, 0] -= psi

    def _renew_height(self) -> None:
        """What the reference of heights differs by is unknown from here on."""
        diagonal(self.carried, self._m1)[:, CH] += RENEWED_HEIGHT_VAR
