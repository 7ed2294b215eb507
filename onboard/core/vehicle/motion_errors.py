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
from onboard.core.vehicle.effects.attitude_error import DRIFTING
from onboard.core.vehicle.flight import DRIFT, Flight
from onboard.core.vehicle.limits import BLOCK_S
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.noise import AxisNoise, whitened
from onboard.core.vehicle.windows import windows_of


def errors_of(model: ForceModel, theta: Array) -> list[Array]:
    """(n, k, l) force, m/s^2, by a standard deviation of each error, of each flight's n steps.

    Args:
        model: of k axes.
        theta: (m,) unknowns at which it is asked.
    """
    flight = model.flight
    slope = model.gust_slope(theta)
    u_n = np.einsum("nij,ni->nj", flight.R_bn, model.air(theta).u_b)
    return [
        _of_flight(model, slope[its], u_n[its], flight.kept(its))
        for its in (flight.part == number for number in range(flight.parts))
    ]


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
    flight, out = model.flight, []
    part = flight.part[windows_of(flight).first]
    for number, errors in enumerate(errors_of(model, theta)):
        its = flight.part == number
        windows = windows_of(flight.kept(its))
        force, sensitive = windows.mean(errors), windows.mean(sensitivity[its])
        places = regressors[0].places[number]
        scores = np.zeros((len(theta), force.shape[-1]))
        for k, columns in enumerate(regressors):
            data = noise[k], sensitive[:, k], windows.piece, windows.length_s
            scores[places] += columns.by[part == number].T @ whitened(force[:, k], *data)
        out.append(scores)
    return np.hstack(out)


def _of_flight(model: ForceModel, slope: Array, u_n: Array, flight: Flight) -> Array:
    """(n, k, l) of one flight, of which all arguments but the model are."""
    out = [
        slope[:, :, j] * (flight.velocity_sigma * shape)[:, None]
        for shape in _wanders(flight)
        for j in range(3)
    ]
    unsure = flight.unsure - flight.unsure.mean(axis=0)
    for j in range(3):
        f_b = np.zeros((len(flight), 3))
        f_b[:, j] = unsure[:, j]
        if np.any(f_b):
            out.append(_felt(model, f_b) + _turned(slope, u_n, _leant(flight, f_b)))
    if np.any(unsure[:, DRIFT]) and all(u.name != DRIFTING for u in model.unknowns):
        about = np.zeros((len(flight), 3))
        about[:, 2] = unsure[:, DRIFT]
        out.append(_turned(slope, u_n, about))
    return np.stack(out, axis=-1)


def _wanders(flight: Flight) -> list[Array]:
    """(n,) shapes of a process of variance one that forgets itself in a block's length."""
    lasted = float(flight.t[-1] - flight.t[0])
    last = max(1, math.ceil(lasted / BLOCK_S))
    knots = flight.t[0] + lasted * np.arange(last + 1) / last
    # Straight lines between independent knots have two thirds of their variance in the mean.
    root = math.sqrt(1.5)
    return [root * np.interp(flight.t, knots, unit) for unit in np.eye(last + 1)]


def _felt(model: ForceModel, f_b: Array) -> Array:
    """(n, k) of what the accelerometer reads."""
    every = np.hstack([f_b, np.zeros((len(f_b), 1))])
    out: Array = every[:, list(model.axes)]
    return out


def _leant(flight: Flight, f_b: Array) -> Array:
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
