"""Compiled loops in the place of the functions of :mod:`onboard.core.filter.kernel`.

Importing this imports numba, and compiles what is not kept from before.
"""

from __future__ import annotations

import numpy as np

from onboard.core.filter import loops, runs
from onboard.core.filter.innovations import Epoch, Step
from onboard.core.filter.kernel import Kernel, Process, Whitening
from onboard.core.filter.readings import Reading
from onboard.core.maths.arrays import Array


def measured(R_nb: Array, epoch: Epoch, v_down: float, turned: Array) -> Array:
    """See :func:`onboard.core.filter.kernel.measured`."""
    z = epoch.ned.copy()
    loops.measured(R_nb, epoch.body, epoch.along_velocity, v_down, turned, z)
    return z


def predict(carried: Array, R_nb: Array, step: Step, process: Process) -> None:
    """See :func:`onboard.core.filter.kernel.predict`."""
    loops.predict(carried, R_nb, step.duration, step.moved, step.columns, step.missed, *process)


def whiten(carried: Array, z: Array, reading: Reading, noise: Array) -> Whitening:
    """See :func:`onboard.core.filter.kernel.whiten`."""
    members, _, columns = carried.shape
    r = len(reading.number)
    made = Whitening(
        np.empty((r, z.shape[1])),
        np.empty((members, r, columns)),
        np.zeros((r, r)),
        np.empty((members, r)),
    )
    if loops.whiten(carried, z, reading.number, noise, *made):
        raise np.linalg.LinAlgError("the covariance of the innovations is not positive")
    return made


def take(carried: Array, made: Whitening, reading: Reading, gram: Array | None) -> None:
    """See :func:`onboard.core.filter.kernel.take`."""
    m1 = made.E.shape[1]
    loops.take(carried, made.W, m1)
    if gram is not None:
        loops.take_noise(carried[0], made.W[0], made.whitener, reading.number, m1, gram)


COMPILED = Kernel(measured, predict, whiten, take, runs.run)
