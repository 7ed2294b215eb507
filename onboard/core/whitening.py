"""The whitening filter: from integrals and GPS epochs to independent rows of unit variance.

State, an error of what the inertial samples alone would give (Friedland 1969: the filter runs
over the measurement *and over every column* at once, so that its mean is ``x0 + Xc theta``):

=======  =======================================  =============================
slice    what                                     model
=======  =======================================  =============================
V        velocity, NED, m/s                       random walk (accelerometer)
H        height, m                                integral of -v_down
PSI      attitude error, NED rotation vector      random walk (gyroscope)
BIAS     gyroscope bias, body, rad/s              random walk
ATT      slow error of the recorded attitude      Gauss-Markov
CH       wander of GPS height, m                  random walk
CV       coloured GPS velocity error, m/s         Gauss-Markov
=======  =======================================  =============================

Attitude is carried by the *gyroscope* and corrected by the filter's own estimate after each
epoch (the recorded attitude, an EKF's, errs with the manoeuvre and with the very accelerometer
that is calibrated; it only enters as a slow, loose measurement).  With all noise but the GPS's
set to zero and the recorded attitude taken as it is, the rows are those of the paper's integral
criterion with V(0) eliminated.

Several noise levels run side by side as a *bank* (leading axis); they share attitude and
linearisation, those of member 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.earth import EARTH_RATE, SEMI_MAJOR_AXIS, STANDARD_GRAVITY
from onboard.core.noise import ATTITUDE_TIME_S, COLOUR_TIME_S, NoiseLevels

Array = NDArray[np.float64]

V = slice(0, 3)
H = 3
PSI = slice(4, 7)
BIAS = slice(7, 10)
ATT = slice(10, 13)
CH = 13
CV = slice(14, 17)
STATES = 17

GATE_VELOCITY = 30.0
"""Chi-square of the velocity innovation past which a fix is refused (3 dof: p of 1e-6)."""
GATE_HEIGHT = 30.0
GATE_ATTITUDE = 60.0
HEIGHT_PATIENCE_S = 3.0
"""A height that stays off is a new reference (a new satellite), not a fault."""
ATTITUDE_PATIENCE_S = 5.0
RECOVERY_FIXES, RECOVERY_S = 3, 1.0
"""A velocity is believed again after so many fixes, and so long, inside the gate."""
RECOVERY_SIGMAS, RECOVERY_DRIFT = 7.0, 0.3
"""Between two of them the innovation changes by the receiver's noise (5 sigma of a difference) and
by what the accelerometer is off, m/s^2."""


@dataclass(frozen=True, slots=True)
class Step:
    """What one interval brings, in body axes of its start (m unknowns)."""

    duration: float
    turn: Array
    force: Array
    force_to_end: Array
    mean_turn: Array
    columns: Array
    columns_to_end: Array
    columns_turn: Array


@dataclass(frozen=True, slots=True)
class Epoch:
    """What one GPS epoch measures, and the direct columns there.

    ``known_body`` (m/s) and ``known_height`` (m) are what the report differs by, as far as known:
    the receiver's averaging and the place of its antenna.
    """

    t: float
    velocity: Array
    height: float
    latitude: float
    R_attitude: Array | None
    known_body: Array
    known_height: float
    velocity_body: Array
    velocity_ned: Array
    position_body: Array
    position_ned: Array
    along_velocity: Array
    attitude_body: Array
    attitude_ned: Array
    trusted: bool


@dataclass(frozen=True, slots=True)
class Rows:
    """Whitened rows of one epoch for every member of the bank.

    ``y`` (B, r), ``h`` (B, r, m); ``log_det`` (B,); the first ``velocities`` rows are velocity,
    then height if ``height``, then attitude.  ``innovation`` (v rows, m/s) is that of member 0 at
    the current estimate, not whitened, ``raw_innovation`` and ``raw_columns`` its two parts,
    ``refused_by`` that of a velocity that was refused.
    """

    t: float
    y: Array
    h: Array
    log_det: Array
    velocities: int
    height: bool
    innovation: Array
    raw_innovation: Array
    raw_columns: Array
    refused: tuple[str, ...]
    refused_by: Array


_EYE = np.eye(STATES)
_DIAGONAL = np.arange(STATES)
_DOWN = np.array([0.0, 0.0, STANDARD_GRAVITY])


def _earth(latitude: float, v_n: Array) -> tuple[Array, Array]:
    """Coriolis acceleration and turning of NED, for one vector (:mod:`onboard.core.earth`)."""
    north, east, down = (float(x) for x in v_n)
    c, s = np.cos(latitude), np.sin(latitude)
    # A sphere's radius does: half a per cent of 1e-6 rad/s.
    w = (east / SEMI_MAJOR_AXIS, -north / SEMI_MAJOR_AXIS, -east * s / c / SEMI_MAJOR_AXIS)
    x, y, z = 2.0 * EARTH_RATE * c + w[0], w[1], -2.0 * EARTH_RATE * s + w[2]
    carried = np.array([z * east - y * down, x * down - z * north, y * north - x * east])
    return carried, np.array([EARTH_RATE * c + w[0], w[1], -EARTH_RATE * s + w[2]])


def _skew(a: Array) -> Array:
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _turn(phi: Array) -> Array:
    """Rodrigues for one vector (the vectorised one costs five times as much)."""
    angle2 = float(phi @ phi)
    K = _skew(phi)
    if angle2 < 1e-8:
        return np.eye(3) + K + 0.5 * (K @ K)
    angle = np.sqrt(angle2)
    out: Array = (
        np.eye(3) + (np.sin(angle) / angle) * K + ((1.0 - np.cos(angle)) / angle2) * (K @ K)
    )
    return out


def _angle(R: Array) -> Array:
    """Rotation vector of one rotation, |angle| well below pi."""
    v = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    s = float(np.sqrt(v @ v))
    if s < 1e-9:
        return v
    c = 0.5 * (float(np.trace(R)) - 1.0)
    out: Array = v * (np.arctan2(s, c) / s)
    return out


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
        self._height_off: float | None = None
        self._attitude_off: float | None = None
        self._velocity_off: float | None = None
        self._good: list[tuple[float, Array]] = []
        self.noise_gram = np.zeros(3)
        # Noise in the columns is only wanted where the sums will count, not while levels are tried.
        self._one = B == 1
        self._updates = 0
        self._Xi = np.zeros((3, STATES, STATES))

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
        self._height_off = self._attitude_off = self._velocity_off = None
        self._Xi[:] = 0.0

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
        lever = _skew(S - S2 / T)
        F = _EYE.copy()
        F[V, PSI] = -_skew(S)
        F[PSI, BIAS] = -A
        F[V, BIAS] = lever @ A
        F[H, 2] = -T
        F[H, PSI] = _skew(S2)[2]
        keep_att, keep_cv = np.exp(-T / ATTITUDE_TIME_S), np.exp(-T / COLOUR_TIME_S)
        F[range(10, 13), range(10, 13)] = keep_att
        F[range(14, 17), range(14, 17)] = keep_cv

        down = _DOWN
        turn_n = None
        if self.uses.earth:
            carried, turn_n = _earth(latitude, self._X[0, V, 0] + self._X[0, V, 1:] @ theta)
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
        P, diagonal = self._P, _DIAGONAL
        P[:, diagonal, diagonal] += before
        Ft = F.T
        P = F @ P @ Ft
        P[:, diagonal, diagonal] += Q
        self._P = P
        if self._one:
            self._Xi = F @ self._Xi @ Ft
            self._Xi[:, V, V] += T * R.T[:, :, None] * R.T[:, None, :]
        R = R @ step.turn
        self.R_nb = R if turn_n is None else _turn(-turn_n * T) @ R
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
            kinds, E, HP, index = rows
            L = np.linalg.cholesky(HP[:, :, index[0]] + HP[:, :, index[1]] + self._noise(kinds))
            W = np.linalg.solve(L, np.concatenate([E, HP], axis=2))
            y, h, gain = W[:, :, 0], W[:, :, 1 : self.m + 1], W[:, :, self.m + 1 :]
            bad = self._gate(epoch.t, kinds, E[0], y[0], h[0], theta, covariance)
            if bad is None:
                break
            refused.append(bad)
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
        if self._one:
            self._noise_rows(L[0], back[0], index)
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
    ) -> tuple[str, Array, Array, tuple[list[int], list[int]]] | None:
        """Innovations with their columns, ``H P``, and the two states that each row reads."""
        X, R = self._X, self.R_nb
        kinds, first, second = "", [], []
        if use_v:
            n = 3 if np.isfinite(epoch.velocity[2]) else 2
            kinds += "v" * n
            first += [0, 1, 2][:n]
            second += [14, 15, 16][:n]
        if use_h:
            kinds += "h"
            first.append(H)
            second.append(CH)
        if use_a:
            kinds += "aaa"
            first += [4, 5, 6]
            second += [10, 11, 12]
        if not kinds:
            return None
        E = X[:, first] + X[:, second]
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
            E[:, at:, 0] += _angle(epoch.R_attitude @ R.T)
            E[:, at:, 1:] += R @ epoch.attitude_body + epoch.attitude_ned
        HP = self._P[:, first] + self._P[:, second]
        return kinds, E, HP, (first, second)

    def _noise(self, kinds: str) -> Array:
        columns = [0, 1, 2][: kinds.count("v")] + [3] * kinds.count("h")
        columns += [4, 5, 6] * (kinds.count("a") // 3)
        out: Array = self._row_var[:, columns, None] * np.eye(len(columns))
        return out

    def _gate(
        self, t: float, kinds: str, E: Array, y: Array, h: Array, theta: Array, C: Array
    ) -> str | None:
        """Name of the first group whose innovation is impossible, given all uncertainty."""
        if not self.uses.gates:
            return None
        at = 0
        for kind, name, limit in (
            ("v", "velocity", GATE_VELOCITY),
            ("h", "height", GATE_HEIGHT),
            ("a", "attitude", GATE_ATTITUDE),
        ):
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
                if kind == "v":
                    self._velocity_off = t if self._velocity_off is None else self._velocity_off
                    self._good = []
                    return name
                if not self._patient(kind, t):
                    return name
            elif kind == "v":
                if self._recovers(t, E[:n, 0] - E[:n, 1:] @ theta):
                    return "recovery"
            elif kind == "h":
                self._height_off = None
            elif kind == "a":
                self._attitude_off = None
        return None

    def _recovers(self, t: float, innovation: Array) -> bool:
        """True while a receiver that was off has not been right, and steady, for long enough.

        After seconds of coasting the gate is wide; a receiver that is only noisy falls into it,
        but then its errors jump, while those of the coasting filter cannot.
        """
        if self._velocity_off is None:
            return False
        if self._good:
            before, last = self._good[-1]
            noise = float(np.hypot(self.bank[0].velocity, self.bank[0].velocity_colour))
            most = RECOVERY_SIGMAS * noise + RECOVERY_DRIFT * (t - before)
            if len(last) != len(innovation) or float(np.abs(innovation - last).max()) > most:
                self._good = []
        self._good.append((t, innovation))
        if len(self._good) < RECOVERY_FIXES or t - self._good[0][0] < RECOVERY_S:
            return True
        self._velocity_off, self._good = None, []
        return False

    def _patient(self, kind: str, t: float) -> bool:
        """True when a height or attitude that stays off is taken as a new reference."""
        if kind == "h":
            since, patience = self._height_off, HEIGHT_PATIENCE_S
            self._height_off = t if since is None else since
        else:
            since, patience = self._attitude_off, ATTITUDE_PATIENCE_S
            self._attitude_off = t if since is None else since
        if since is None or t - since < patience:
            return False
        if kind == "h":
            self._P[:, CH, CH] += 1e4
            self._height_off = None
        else:
            self._P[:, range(10, 13), range(10, 13)] += 0.3**2
            self._attitude_off = None
        return False

    def _noise_rows(self, L: Array, back: Array, index: tuple[list[int], list[int]]) -> None:
        """What unit white noise on each accelerometer axis leaves in the rows, squared."""
        first, second = index
        picked = self._Xi[:, first] + self._Xi[:, second]
        W = np.linalg.solve(L, picked)
        square = W[:, :, first] + W[:, :, second]
        white = np.linalg.solve(L, np.swapaxes(square, -1, -2))
        self.noise_gram += np.trace(white, axis1=-2, axis2=-1)
        # (I - K H) Xi (I - K H)^T with K = back L^-1.
        gain = np.eye(STATES)
        K = np.linalg.solve(L.T, back.T).T
        gain[:, first] -= K
        gain[:, second] -= K
        self._Xi = gain @ self._Xi @ gain.T

    def _correct(self, theta: Array) -> None:
        """Turn the attitude by the filter's own estimate, so that errors stay small angles."""
        if self.uses.recorded_attitude:
            return
        psi = self._X[0, PSI, 0] + self._X[0, PSI, 1:] @ theta
        self.R_nb = _turn(psi) @ self.R_nb
        self._X[:, PSI, 0] -= psi
