"""Lift and side force of a plane in gusts: what of them is told without the angles' scatter.

Both are laws of an angle that gusts scatter, and least squares takes the scatter for a law with
little slope.  So they are told by what gusts have no part in:

* **The lift by its mean.** Gusts up and down have none, and what they have by chance the colour of
  the noise says.  Another slope does what it does at the mean angle, and no more.
* **The side force by the rudder.** Sideslip counts as far as the rudder tells it (two-stage least
  squares, :mod:`onboard.core.vehicle.instruments`).  By more than that one, what they tell by
  chance would be of the gusts (C. R. Nelson and R. Startz, *Journal of Business* 63, 1990).

How much of a difference is the slope's, and how much the other number's, stays what it was before
the flight where nothing tells it: the prior has it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import SIDE, UP
from onboard.core.vehicle.effects.lift import Lift
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.instruments import told_by
from onboard.core.vehicle.limits import ROUNDS, SETTLED
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.noise import AxisNoise, fitted_noise, whitened
from onboard.core.vehicle.windows import Windows, windows_of


@dataclass(frozen=True, slots=True)
class Rows:
    """Whitened force along an axis: (r,) what is left, (r, m) regressors, and the noise."""

    left: Array
    regressors: Array
    noise: AxisNoise


def whitened_axis(left: Array, columns: Array, windows: Windows) -> Rows:
    """Of means over windows (r,) and (r, m), by the noise that is left in them."""
    even = np.ones(len(left))
    noise = fitted_noise(left, even, windows.piece, windows.length_s)
    every = np.column_stack([left, columns])
    rows = whitened(every, noise, even, windows.piece, windows.length_s)
    return Rows(rows[:, 0], rows[:, 1:], noise)


def across(fit: Fit, theta: Array) -> tuple[Array, Rows, Rows]:
    """Unknowns (m,) with lift and side force found anew, and rows of the side and upwards."""
    theta = _found(fit, theta, fit.model.indices(Lift.name), upwards)
    theta = _found(fit, theta, side_places(fit.model), sideways)
    return theta, sideways(fit.model, theta), upwards(fit.model, theta)


def side_places(model: ForceModel) -> list[int]:
    """Places of the side force by sideslip and by the rudder, whatever it is called."""
    return [model.index(name) for name in ("c_y_b", "c_y_deltar")]


def upwards(model: ForceModel, theta: Array) -> Rows:
    """Whitened force upwards, to which the slope of the lift is what it is at the mean angle."""
    k = model.axes.index(UP)
    columns = model.jacobian(theta).axis(k).whole
    constant, slope = model.indices(Lift.name)
    columns[:, slope] = float(np.mean(model.air(theta).alpha)) * columns[:, constant]
    windows = windows_of(model.flight)
    left = windows.mean((model.measured() - model.predicted(theta))[:, k])
    return whitened_axis(left, windows.mean(columns), windows)


def sideways(model: ForceModel, theta: Array) -> Rows:
    """Whitened force to the side, with the sideslip as far as the rudder tells it."""
    windows, k = windows_of(model.flight), model.axes.index(SIDE)
    left = windows.mean((model.measured() - model.predicted(theta))[:, k])
    rows = whitened_axis(left, model.jacobian(theta).axis(k).means(windows).whole, windows)
    slope, rudder = side_places(model)
    columns = rows.regressors.copy()
    columns[:, [slope]] = told_by(columns[:, [slope]], columns[:, [rudder]])
    return Rows(rows.left, columns, rows.noise)


def _found(
    fit: Fit, theta: Array, places: list[int], rows_of: Callable[[ForceModel, Array], Rows]
) -> Array:
    """Unknowns (m,) with some of them as these rows and the prior have them."""
    theta = theta.copy()
    prior, nominal = np.diag(fit.prior[places]), fit.model.nominal[places]
    for _ in range(ROUNDS):
        rows = rows_of(fit.model, theta)
        told = rows.regressors[:, places]
        N = told.T @ told + prior
        step = np.linalg.solve(N, told.T @ rows.left + prior @ (nominal - theta[places]))
        theta[places] += step
        if float(step @ N @ step) < SETTLED**2:
            break
    return theta
