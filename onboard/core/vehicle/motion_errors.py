"""What the recorded motion is off by, in sizes that are known, and what that does to a fit.

Velocity, attitude and calibration are those of the sensor level, and are not right.  What they are
off by changes slowly: a receiver's velocity wanders within its sigma, a bias of the gyroscope turns
the heading between two turns, a scale that was not told from its offset leans the attitude in
a climb another way than in a descent.  On a long flight such errors come in many signs, and blocks
of it that contradict each other show them.  A short one has one climb and one descent: as many
unknowns as phases fit them, and nothing is left that would show.  But their sizes are known.  An
error of known size that is not estimated adds ``N^-1 H^T (its force)`` to the unknowns (the
*consider* covariance; B. D. Tapley, B. E. Schutz and G. H. Born, *Statistical Orbit Determination*,
2004, chapter 6).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.vehicle.columns import Columns
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.limits import BLOCK_S
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.noise import AxisNoise, whitened
from onboard.core.vehicle.windows import windows_of


def errors_of(model: ForceModel, theta: Array, number: int) -> Array:
    """(n, k, l) force, m/s^2, by a standard deviation of each error of one flight's motion.

    Args:
        model: of k axes.
        theta: (m,) unknowns at which it is asked.
        number: which of several recordings; the others' steps are zero.
    """
    flight = model.flight
    mine = flight.part == number
    slope = model.gust_slope(theta)
    u_n = np.einsum("nij,ni->nj", flight.R_bn, model.air(theta).u_b)
    out = []
    for shape in _wanders(flight, number):
        # As seen from the vehicle the air moves the other way: a sign that no square has.
        out += [slope[:, :, j] * (flight.velocity_sigma * shape)[:, None] for j in range(3)]
    unsure = np.where(mine[:, None], flight.unsure - flight.unsure[mine].mean(axis=0), 0.0)
    for j in range(3):
        if np.any(unsure[:, j]):
            f_b = np.zeros((len(flight), 3))
            f_b[:, j] = unsure[:, j]
            out.append(_felt(model, f_b) + _turned(slope, u_n, _levelled(flight, f_b)))
    if np.any(unsure[:, 3]):
        about = np.zeros((len(flight), 3))
        about[:, 2] = unsure[:, 3]
        out.append(_turned(slope, u_n, about))
    return np.stack(out, axis=-1)


def scores_of(
    model: ForceModel,
    theta: Array,
    regressors: Sequence[Columns],
    noise: Sequence[AxisNoise],
    sensitivity: Array,
) -> Array:
    """(m, l) what each of the errors adds to the scores ``H^T y`` of whitened rows.

    Args:
        model: of k axes and m unknowns.
        theta: (m,) at which it is asked.
        regressors: (r, m) whitened, by axis.
        noise: by axis.
        sensitivity: (n, k) to gusts, 1/s.
    """
    windows = windows_of(model.flight)
    part = model.flight.part[windows.first]
    out = []
    for number in range(model.flight.parts):
        force = windows.mean(errors_of(model, theta, number))
        mine, its = part == number, regressors[0].places[number]
        scores = np.zeros((len(theta), force.shape[-1]))
        for k, columns in enumerate(regressors):
            sensitive = windows.mean(sensitivity[:, k])
            rows = whitened(force[:, k], noise[k], sensitive, windows.piece, windows.length_s)
            scores[its] += columns.by[mine].T @ rows[mine]
        out.append(scores)
    return np.hstack(out)


def _wanders(flight: Flight, number: int) -> list[Array]:
    """(n,) shapes of a process of variance one that forgets itself in a block's length."""
    mine = flight.part == number
    t = flight.t - flight.t[mine][0]
    last = max(1, math.ceil(float(t[mine][-1]) / BLOCK_S))
    knots = float(t[mine][-1]) * np.arange(last + 1) / last
    # Straight lines between independent knots have two thirds of their variance in the mean.
    root = math.sqrt(1.5)
    return [
        np.where(mine, root * np.interp(t, knots, unit), 0.0) for unit in np.eye(last + 1)
    ]


def _felt(model: ForceModel, f_b: Array) -> Array:
    """(n, k) of what the accelerometer reads."""
    every = np.hstack([f_b, np.zeros((len(f_b), 1))])
    out: Array = every[:, list(model.axes)]
    return out


def _levelled(flight: Flight, f_b: Array) -> Array:
    """(n, 3) by which an attitude is turned that a receiver holds level, north, east, down, rad.

    A force that is not there is leant away: the velocity shows that it was not.
    """
    f_n = np.einsum("nij,ni->nj", flight.R_bn, f_b)
    zero = np.zeros(len(f_n))
    out: Array = np.stack([-f_n[:, 1], f_n[:, 0], zero], axis=1) / STANDARD_GRAVITY
    return out


def _turned(slope: Array, u_n: Array, about: Array) -> Array:
    """(n, k) by an attitude that is turned too far, as if the air moved."""
    out: Array = -np.einsum("nki,ni->nk", slope, np.cross(about, u_n))
    return out
