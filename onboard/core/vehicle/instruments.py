"""Whitened rows of a fit, and regressors that gusts have no part in (two-stage least squares).

An autopilot answers a gust: along the thrust with its commands, sideways with a tilt, at once.
Then regressors are no longer independent of the disturbance, and least squares would take the
answer for the cause: a copter that leans into a gust changes its own speed along its axes with it,
and drag comes out too small.  Whitening makes that worse, as what is left of a steady speed is
little.  So regressors are taken as far as something tells them that the gust has not reached yet:
commands by what they were before it, speeds through the air by the path over ground and the
heading before it, which a gust moves over seconds.  J. D. Angrist and J.-S. Pischke, *Mostly
Harmless Econometrics* (2009), chapter 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.columns import Columns
from onboard.core.vehicle.limits import INSTRUMENT_WINDOWS, PATH_WINDOWS, THRUST_AXIS
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.noise import AxisNoise, whitened
from onboard.core.vehicle.windows import Windows, windows_of

LEAST_TOLD = 1e-8
"""Singular values below this share of the largest tell nothing: the arithmetic's own [physics]."""


def whitened_rows(
    model: ForceModel,
    residual: Array,
    jacobian: Columns,
    noise: Sequence[AxisNoise],
    sensitivity: Array,
) -> list[Array]:
    """For each axis (r, 1 + m): whitened residual and regressors, of means over windows.

    Args:
        model: of k axes and m unknowns.
        residual: (n, k) measured less predicted, m/s^2.
        jacobian: (n, k) of the prediction.
        noise: by axis.
        sensitivity: (n, k) to gusts, 1/s.
    """
    left = whitened_residual(model, residual, noise, sensitivity)
    by = whitened_regressors(model, jacobian, noise, sensitivity)
    return [np.column_stack([y, h.whole]) for y, h in zip(left, by, strict=True)]


def whitened_residual(
    model: ForceModel, residual: Array, noise: Sequence[AxisNoise], sensitivity: Array
) -> list[Array]:
    """For each axis (r,): the whitened residual (n, k), m/s^2, of means over windows."""
    windows = windows_of(model.flight)
    rows = (
        _whitened(windows, residual[:, k, None], its, sensitivity[:, k])
        for k, its in enumerate(noise)
    )
    return [made[:, 0] for made in rows]


def whitened_regressors(
    model: ForceModel,
    jacobian: Columns,
    noise: Sequence[AxisNoise],
    sensitivity: Array,
    level: Columns | None = None,
) -> list[Columns]:
    """For each axis (r,): whitened regressors, told from the past where it is instrumented.

    Of several flights each is told from its own: what a vehicle did before a gust is a matter of
    who flew it, and how.

    Args:
        model: of k axes and m unknowns.
        jacobian: (n, k) of the prediction.
        noise: by axis.
        sensitivity: (n, k) to gusts, 1/s.
        level: (n, k) of the prediction without a tilt; where axes are instrumented.
    """
    windows = windows_of(model.flight)
    part = model.flight.part[windows.first]
    d, out = jacobian.by.shape[-1], []
    for k, its in enumerate(noise):
        instrumented = model.axes[k] in model.instrumented
        sideways = instrumented and model.axes[k] != THRUST_AXIS and level is not None
        columns = jacobian.by[:, k]
        if sideways and level is not None:
            columns = np.hstack([columns, level.by[:, k]])
        made = _whitened(windows, columns, its, sensitivity[:, k])
        if instrumented:
            mine, other = made[:, :d], made[:, d:]
            before = (other, PATH_WINDOWS) if sideways else (mine, INSTRUMENT_WINDOWS)
            past = _past(before[0], windows.piece, before[1])
            made = np.empty_like(mine)
            for number in np.unique(part).tolist():
                its_own = part == number
                made[its_own] = told_by(mine[its_own], past[its_own])
        out.append(replace(jacobian, by=made, part=part))
    return out


def _whitened(windows: Windows, columns: Array, its: AxisNoise, sensitivity: Array) -> Array:
    """(r, j) means over windows of columns (n, j), whitened; ``sensitivity`` (n,) to gusts."""
    rows, sensitive = windows.mean(columns), windows.mean(sensitivity)
    return whitened(rows, its, sensitive, windows.piece, windows.length_s)


def _past(rows: Array, piece: NDArray[np.int64], lags: Sequence[int]) -> Array:
    """(r, j) the rows as they were so many windows ago; zero where the piece had not begun."""
    past = []
    for lag in lags:
        moved = np.zeros_like(rows)
        moved[lag:] = rows[:-lag]
        moved[np.concatenate([np.ones(lag, dtype=bool), piece[lag:] != piece[:-lag]])] = 0.0
        past.append(moved)
    return np.hstack(past)


def told_by(rows: Array, instruments: Array) -> Array:
    """(r, m) rows as far as a linear combination of the instruments tells them."""
    size = np.linalg.norm(instruments, axis=0)
    instruments = instruments[:, size > 0.0] / size[size > 0.0]
    by, *_ = np.linalg.lstsq(instruments, rows, rcond=LEAST_TOLD)
    out: Array = instruments @ by
    return out
