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

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.limits import INSTRUMENT_WINDOWS, PATH_WINDOWS, THRUST_AXIS
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.noise import AxisNoise, whitened
from onboard.core.vehicle.windows import windows_of

LEAST_TOLD = 1e-8
"""Singular values below this share of the largest tell nothing: the arithmetic's own [physics]."""


def whitened_rows(
    model: ForceModel,
    residual: Array,
    jacobian: Array | None,
    noise: Sequence[AxisNoise],
    sensitivity: Array,
    level: Array | None = None,
) -> list[Array]:
    """For each axis (r, 1 + m): whitened residual and regressors, of means over windows.

    Args:
        model: of k axes and m unknowns.
        residual: (n, k) measured less predicted, m/s^2.
        jacobian: (n, k, m) of the prediction; None: residuals alone, (r, 1).
        noise: by axis.
        sensitivity: (n, k) to gusts, 1/s.
        level: (n, k, m) of the prediction without a tilt; where axes are instrumented.
    """
    windows = windows_of(model.flight)
    out = []
    for k, its in enumerate(noise):
        columns = [residual[:, k, None]]
        instrumented = model.axes[k] in model.instrumented
        sideways = instrumented and model.axes[k] != THRUST_AXIS and level is not None
        if jacobian is not None:
            columns.append(jacobian[:, k])
            if sideways and level is not None:
                columns.append(level[:, k])
        rows = windows.mean(np.hstack(columns))
        sensitive = windows.mean(sensitivity[:, k])
        made = whitened(rows, its, sensitive, windows.piece, windows.length_s)
        if jacobian is not None and instrumented:
            m = jacobian.shape[-1]
            mine, other = made[:, 1 : 1 + m], made[:, 1 + m :]
            before = (other, PATH_WINDOWS) if sideways else (mine, INSTRUMENT_WINDOWS)
            by = _past(before[0], windows.piece, before[1])
            made = np.hstack([made[:, :1], told_by(mine, by)])
        out.append(made)
    return out


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
