"""The filter's arithmetic on plain arrays, and the choice of who does it: numpy, or compiled loops.

Everything linear is carried in one array, the *carried* (B, STATES, C) of B members: side by side

* ``X`` (m + 1 columns): the state's mean at ``theta = 0``, then its regressors, so that the mean
  at ``theta`` is ``X @ (1, -theta)``;
* ``P`` (STATES columns): its covariance;
* none or three more matrices of STATES columns: the covariance that the velocity's walk along each
  body axis has given the state of member 0 (:mod:`onboard.core.filter.regressor_noise`).

A transition multiplies all of them from the left by the same matrix, and an update adds to all of
them the same gain times their own innovation; only the covariances are then multiplied from the
right, too.

numpy's functions are here and are what the others are held to.  Compiled ones
(:mod:`onboard.core.filter.compiled`) do the same two to five times as fast where numba is installed
and :func:`~onboard.core.maths.compiling.prefer_compiled` was called.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from onboard.core.filter.innovations import Epoch, Step
from onboard.core.filter.readings import Reading
from onboard.core.filter.state import (
    BIAS,
    ERRORS,
    HEADING,
    MEASURED,
    PSI,
    RATE,
    STATES,
    H,
    V,
)
from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import prefer_compiled, preferred

_EYE = np.eye(MEASURED, ERRORS)


class Process(NamedTuple):
    """What a step does to every member besides its motion.

    Attributes:
        fall: (MEASURED,) what is added to the states at ``theta = 0``.
        decay: (B, MEASURED) factors that the slow errors decay by.
        swing: (B, 3) what the rate of the heading's error adds to it, what that error leaves of the
            rate, and what the rate leaves of itself.
        before: (B, STATES) process noise before the transition, unit of the state squared; the
            velocity's along body axes.
        after: (B, STATES) the same after it.
    """

    fall: Array
    decay: Array
    swing: Array
    before: Array
    after: Array


class Whitening(NamedTuple):
    """Innovations of r measured numbers before and after whitening.

    Attributes:
        E: (r, m + 1) innovations of member 0 at ``theta = 0`` and their regressors.
        W: (B, r, C) whitened innovations of all that is carried: ``y`` (column 0), its regressors
            ``h``, then the transposed Kalman gain with the sign changed, then others.
        whitener: (r, r) of member 0: inverse of ``L``, with ``L L^T`` the innovations' covariance.
        log_var: (B, r) log variances of the innovations before whitening, each given those before
            it: their sum is the log determinant of the covariance.
    """

    E: Array
    W: Array
    whitener: Array
    log_var: Array


Run = Callable[..., int]
"""Type of :func:`onboard.core.filter.runs.run`."""


class Kernel(NamedTuple):
    """Who does the filter's arithmetic: the functions of these names here, or others.

    ``run`` goes through many epochs that are like most; None: they are gone through one by one.
    """

    measured: Callable[[Array, Epoch, float, Array], Array]
    predict: Callable[[Array, Array, Step, Process], None]
    whiten: Callable[[Array, Array, Reading, Array], Whitening]
    take: Callable[[Array, Whitening, Reading, Array | None], None]
    run: Run | None = None


def diagonal(carried: Array, m1: int) -> Array:
    """The diagonals of ``P``, to be written to: (B, STATES)."""
    view: Array = np.einsum("bii->bi", carried[:, :, m1 : m1 + STATES])
    return view


def covariances(carried: Array, m1: int) -> Array:
    """``P`` and what follows it, to be written to: (B, 1 or 4, STATES, STATES)."""
    members, _, columns = carried.shape
    count = (columns - m1) // STATES
    return carried[:, :, m1:].reshape(members, STATES, count, STATES).transpose(0, 2, 1, 3)


def stack_to_ned(R_nb: Array, stack: Array) -> Array:
    """A stack (9, m + 1) in body axes, turned by ``R_nb`` (3, 3) to NED: (MEASURED, m + 1)."""
    turn = np.zeros((MEASURED, 9))
    turn[0:3, 0:3] = turn[PSI, 6:9] = R_nb
    turn[H, 3:6] = R_nb[2]
    return turn @ stack


def measured(R_nb: Array, epoch: Epoch, v_down: float, turned: Array) -> Array:
    """What an epoch measures at ``theta = 0``, and the direct regressors of it.

    Args:
        R_nb: (3, 3) attitude of the filter.
        epoch: the measurements.
        v_down: present velocity down, m/s, for what depends on it.
        turned: (3,) rotation vector from the filter's attitude to the recorded one, NED, rad.

    Returns:
        (MEASURED, m + 1), NaN for what is not there.
    """
    z = stack_to_ned(R_nb, epoch.body)
    z += epoch.ned
    z[H, 1:] -= v_down * epoch.along_velocity
    z[PSI, 0] += turned
    return z


def transition(R_nb: Array, step: Step) -> Array:
    """How the first states follow from those before: (MEASURED, ERRORS)."""
    moved = R_nb @ step.moved
    (sx, x), (sy, y), (sz, _) = moved[:, :2].tolist()
    F = _EYE.copy()
    F[0:4, PSI] = ((0.0, sz, -sy), (-sz, 0.0, sx), (sy, -sx, 0.0), (-y, x, 0.0))
    F[H, 2] = -step.duration
    F[0:3, BIAS] = moved[:, 5:8]
    F[PSI, BIAS] = -moved[:, 2:5]
    return F


def predict(carried: Array, R_nb: Array, step: Step, process: Process) -> None:
    """Carry everything through one step, in place.

    Args:
        carried: (B, STATES, C).
        R_nb: (3, 3) attitude at the beginning of the step.
        step: integrals over it.
        process: noise, decay and fall.
    """
    m1 = step.columns.shape[1]
    F = transition(R_nb, step)
    P = covariances(carried, m1)
    var = diagonal(carried, m1)
    var[:, H:] += process.before[:, H:]
    P[:, 0, V, V] += along_axes(R_nb, process.before[:, V])
    carried[:, :MEASURED] = F @ carried[:, :ERRORS]
    added, back, kept = process.swing.T[:, :, None]
    rate = back * carried[:, HEADING] + kept * carried[:, RATE]
    carried[:, ERRORS:RATE] *= process.decay[:, :, None]
    carried[:, HEADING] += added * carried[:, RATE]
    carried[:, RATE] = rate
    P[..., :MEASURED] = P[..., :ERRORS] @ F.T
    added, back, kept = added[..., None], back[..., None], kept[..., None]
    rate = back * P[..., HEADING] + kept * P[..., RATE]
    P[..., ERRORS:RATE] *= process.decay[:, None, None]
    P[..., HEADING] += added * P[..., RATE]
    P[..., RATE] = rate
    var[:, H:] += process.after[:, H:]
    P[:, 0, V, V] += along_axes(R_nb, process.after[:, V])
    carried[:, :MEASURED, :m1] += stack_to_ned(R_nb, step.columns)
    carried[:, :MEASURED, 0] += process.fall
    if step.missed.any():
        P[:, 0, V, V] += along_axes(R_nb, step.missed[:3])
        P[:, 0, PSI, PSI] += along_axes(R_nb, step.missed[3:])
    if P.shape[1] > 1:
        walk = (process.before + process.after)[0, V]
        P[:, 1:, :3, :3] += walk[:, None, None] * R_nb.T[:, :, None] * R_nb.T[:, None, :]


def along_axes(R_nb: Array, var: Array) -> Array:
    """Covariances (..., 3, 3) in NED of what has variances (..., 3) along body axes."""
    return (R_nb * var[..., None, :]) @ R_nb.T


def innovations(carried: Array, z: Array, reading: Reading) -> Array:
    """Measurements less what is expected of them, for all that is carried: (B, r, C).

    Args:
        carried: (B, STATES, C).
        z: (MEASURED, m + 1) what is measured, and its regressors.
        reading: which r of them to use.
    """
    E: Array = carried[:, reading.first] + carried[:, reading.second]
    np.negative(E, out=E)
    E[:, :, : z.shape[1]] += z[reading.first]
    return E


def whiten(carried: Array, z: Array, reading: Reading, noise: Array) -> Whitening:
    """Multiply innovations by the inverse Cholesky factor of their covariance.

    Args:
        carried: (B, STATES, C).
        z: (MEASURED, m + 1) what is measured, and its regressors.
        reading: which r of them to use.
        noise: (B, MEASURED) variances of the white noise of each.

    Raises:
        numpy.linalg.LinAlgError: a covariance is not positive.
    """
    m1 = z.shape[1]
    E = innovations(carried, z, reading)
    PH = E[:, :, m1 : m1 + STATES]
    S = -PH[:, :, reading.first] - PH[:, :, reading.second]
    np.einsum("bii->bi", S)[:] += noise[:, reading.first]
    L = np.linalg.cholesky(S)
    whitener = np.linalg.inv(L)
    log_var = 2.0 * np.log(np.einsum("bii->bi", L))
    return Whitening(E[0, :, :m1], whitener @ E, whitener[0], log_var)


def take(carried: Array, made: Whitening, reading: Reading, gram: Array | None) -> None:
    """Update everything by whitened innovations, in place.

    Args:
        carried: (B, STATES, C).
        made: the innovations.
        reading: which r numbers they are of.
        gram: (3,) what the squares of the whitened noise are added to, if noise is carried.
    """
    m1 = made.E.shape[1]
    gain = -made.W[:, :, m1 : m1 + STATES].transpose(0, 2, 1)
    carried += gain @ made.W
    if gram is None:
        return
    r = len(made.whitener)
    noise = made.W[0, :, m1 + STATES :].reshape(r, 3, STATES)
    square = noise[:, :, reading.first] + noise[:, :, reading.second]
    # The trace of a product of matrices, one of them transposed: the sum of products.
    gram -= (square * made.whitener[:, None, :]).sum(axis=(0, 2))
    Xi = covariances(carried, m1)[0, 1:]
    K = gain[0] @ made.whitener
    Xi -= (Xi[:, :, reading.first] + Xi[:, :, reading.second]) @ K.T


NUMPY = Kernel(measured, predict, whiten, take)


def chosen() -> Kernel:
    """Who does the arithmetic of a filter that begins now.

    Compiled loops if they are preferred, numba is installed and there is a place to keep them.
    """
    if not preferred():
        return NUMPY
    try:
        from onboard.core.filter import compiled  # noqa: PLC0415 - a second, and only if wanted
    except ImportError:
        prefer_compiled(yes=False)
        return NUMPY
    return compiled.COMPILED
