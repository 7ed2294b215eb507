"""ArduPilot's DCM in error form: what errors of its sensors do to its attitude.

The filter of firmware before the EKFs, and where AHRS_EKF_TYPE is 0.  It turns by the gyroscope and
is pulled to where two directions agree: that of the force that it reads, ``a``, and that of the
force that the change of GPS velocity asks for, ``e``.  With both of length one, ``w_P = k_P a x e``
turns it, and ``w_I``, the integral of ``k_I a x e``, is what it takes for the gyroscope's bias
(AP_AHRS_DCM.cpp, drift_correction).  With ``u`` the true direction, an attitude that is off by
``phi`` and forces that err by ``d_a`` and ``d_e``,

    a x e = -(phi - u (u . phi)) + (d_a - d_e) x u / |f|.

Unlike an EKF it has no state for the accelerometer's bias: an offset tilts it by as much as gravity
turned would, and for good.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from onboard.core.inputs.reported_attitude import DCM_GAIN
from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import skew
from onboard.core.maths.kalman_errors import FIRST, kalman_errors
from onboard.core.model.sensor_errors import ERRORS, GRAVITY, Steps

SIZE: Final = 6
"""States: attitude (rad), NED; bias of the gyroscope (rad/s), body."""
INTEGRAL_GAIN: Final = 0.0087
"""1/s^2: k_I [physics]."""
QUICK_RAD_S: Final = np.deg2rad(50.0)
"""rad/s past which it is pulled the more, the quicker it turns [physics]."""
MOST_PULL: Final = 10.0
"""Times as much at the most [physics]."""
LEARNS_RAD_S: Final = np.deg2rad(20.0)
"""rad/s up to which it learns the gyroscope's bias [physics]."""


@dataclass(frozen=True, slots=True)
class Dcm:
    """The filter.

    Attributes:
        gain: AHRS_RP_P, 1/s.
    """

    gain: float = DCM_GAIN

    def at_rest(self, R_bs: Array) -> Array:
        """Levelled by the force that it reads; its gyroscope's bias is known."""
        force = Steps.at_rest(R_bs, 1, 1.0).force[0]
        x = np.zeros((SIZE, ERRORS))
        x[0], x[1] = -force[1] / GRAVITY[2], force[0] / GRAVITY[2]
        return _packed(x, np.zeros((3, ERRORS)))

    def headed(self, states: Array, R: Array) -> Array:
        """The same with another heading: R (3, 3)."""
        x, told_n = _unpacked(states)
        x[:3], told_n = R @ x[:3], R @ told_n
        return _packed(x, told_n)

    def through(
        self, steps: Steps, states: Array, stop_after: Sequence[int]
    ) -> tuple[Array, list[Array]]:
        """The attitude before and after each step, and states after some."""
        x, before = _unpacked(states)
        told_n = steps.told_n
        moves, pushed = self._linear(steps, steps.force + _changes(told_n, before))
        nothing = np.zeros((len(moves), SIZE)), np.zeros(0, np.int64), np.zeros((len(moves), 0))
        attitude, kept, P = [x[None, :FIRST].copy()], [], np.zeros((SIZE, SIZE))
        for k, stop in pairwise([0, *stop_after]):
            cut = slice(k, stop)
            noise, observed, variance = nothing[0][cut], nothing[1], nothing[2][cut]
            attitude.append(kalman_errors(moves[cut], pushed[cut], noise, observed, variance, x, P))
            kept.append(_packed(x, told_n[stop - 1]))
        whole = np.concatenate(attitude)
        return whole.reshape(len(whole), -1), kept

    def _linear(self, steps: Steps, apart: Array) -> tuple[Array, Array]:
        """(n, 6, 6) what moves errors, and (n, 6, m) what is added to them.

        Args:
            steps: n.
            apart: (n, 3, m) by how much the velocity read gains on the one that is told, m/s.
        """
        h, f_n = steps.h[:, None, None], steps.f_n
        size = np.linalg.norm(f_n, axis=1)[:, None, None]
        u = f_n[:, :, None] / size
        spin = np.linalg.norm(steps.turn, axis=1) / steps.h
        pull = np.clip(spin / QUICK_RAD_S, 1.0, MOST_PULL)[:, None, None]
        learns = INTEGRAL_GAIN * (spin < LEARNS_RAD_S)[:, None, None]
        # Of the heading a compass is believed, the more the leveller the vehicle is.
        share = np.ones((len(f_n), 3, 1))
        across = np.hypot(steps.R[:, 2, 1], steps.R[:, 2, 2])
        share[:, 2, 0] = np.abs(steps.R[:, 2, 1]) / np.maximum(across, 1e-9)
        agree = share * (np.swapaxes(u, 1, 2) * u - np.eye(3))
        asked = share * (-skew(u[..., 0]) @ apart) / size
        moves = np.zeros((len(f_n), SIZE, SIZE))
        moves[:, :3, :3] = h * pull * self.gain * agree
        moves[:, 2, 2] -= (h * pull)[:, 0, 0] * DCM_GAIN
        moves[:, :3, 3:] = h * steps.R
        R_bn = np.swapaxes(steps.R, 1, 2)
        moves[:, 3:, :3] = h * learns * (R_bn @ agree)
        pushed = np.zeros((len(f_n), SIZE, ERRORS))
        pushed[:, :3] = pull * self.gain * asked + steps.turned
        pushed[:, 3:] = learns * (R_bn @ asked)
        return moves, pushed


def _changes(told_n: Array, before: Array) -> Array:
    """(n, 3, m) by how much each velocity told (n, 3, m) is slower than the one before it."""
    out: Array = np.diff(np.concatenate([before[None], told_n]), axis=0)
    return out


def _packed(x: Array, told_n: Array) -> Array:
    return np.concatenate([x.ravel(), told_n.ravel()])


def _unpacked(states: Array) -> tuple[Array, Array]:
    x, told_n = np.split(states, [SIZE * ERRORS])
    return x.reshape(SIZE, ERRORS).copy(), told_n.reshape(3, ERRORS).copy()
