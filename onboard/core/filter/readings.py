"""What the filter expects of an epoch's measurements, and how they differ from it.

A measurement is the sum of two states plus white noise; which states and which noise depends on
its kind: ``v`` a component of velocity, ``h`` height, ``a`` a component of the recorded attitude.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.innovations import Epoch
from onboard.core.filter.state import ATT, CH, CV, PSI, STATES, H, V
from onboard.core.maths.arrays import Array
from onboard.core.maths.small_turns import angle_of

Index = NDArray[np.intp]


class Reading(NamedTuple):
    """Which two states each of r measured numbers reads, and which noise variance is its own."""

    first: Index
    second: Index
    noise: Index


@cache
def reading(kinds: str) -> Reading:
    """For measured numbers of these kinds, in the order ``v...``, ``h``, ``aaa``."""
    n, h, a = kinds.count("v"), kinds.count("h"), kinds.count("a")
    state = [*range(STATES)]
    return Reading(
        np.array([*state[V][:n], *[H] * h, *state[PSI][:a]]),
        np.array([*state[CV][:n], *[CH] * h, *state[ATT][:a]]),
        np.array([*[0, 1, 2][:n], *[3] * h, *[4, 5, 6][:a]]),
    )


def kinds_of(epoch: Epoch, *, velocity: bool, height: bool, attitude: bool) -> str:
    """Kinds of what an epoch has to offer of what is wanted; empty if nothing."""
    kinds = ""
    if velocity and bool(np.all(np.isfinite(epoch.velocity[:2]))):
        kinds += "vvv" if np.isfinite(epoch.velocity[2]) else "vv"
    if height and bool(np.isfinite(epoch.height)):
        kinds += "h"
    if attitude and epoch.R_attitude is not None:
        kinds += "aaa"
    return kinds


def innovations(X: Array, P: Array, R_nb: Array, epoch: Epoch, theta: Array, kinds: str) -> Array:
    """Innovations with their regressors and ``H P``, side by side.

    Args:
        X: (B, STATES, m + 1) mean of the state at ``theta = 0`` and its regressors.
        P: (B, STATES, STATES) covariance.
        R_nb: (3, 3) attitude.
        epoch: the measurements.
        theta: (m,) current estimate, for what depends on the velocity.
        kinds: of the r numbers that are used.

    Returns:
        (B, r, m + 1 + STATES): innovation at ``theta = 0``, m regressors, STATES columns of
        ``H P``.
    """
    m1 = X.shape[2]
    first, second, _ = reading(kinds)
    both = np.empty((len(X), len(first), m1 + STATES))
    E = both[:, :, :m1]
    np.add(X.take(first, axis=1), X.take(second, axis=1), out=E)
    np.add(P.take(first, axis=1), P.take(second, axis=1), out=both[:, :, m1:])
    E[:, :, 0] *= -1.0
    at = n = kinds.count("v")
    if n:
        E[:, :n, 0] += (epoch.velocity - R_nb @ epoch.known_body)[:n]
        E[:, :n, 1:] += (R_nb @ epoch.velocity_body + epoch.velocity_ned)[:n]
    if "h" in kinds:
        v_down = float(X[0, 2, 0] + X[0, 2, 1:] @ theta)
        E[:, at, 0] += epoch.height - epoch.known_height
        E[:, at, 1:] -= (
            R_nb[2] @ epoch.position_body + epoch.position_ned[2] + v_down * epoch.along_velocity
        )
        at += 1
    if "a" in kinds and epoch.R_attitude is not None:
        E[:, at:, 0] += angle_of(epoch.R_attitude @ R_nb.T)
        E[:, at:, 1:] += R_nb @ epoch.attitude_body + epoch.attitude_ned
    return both
