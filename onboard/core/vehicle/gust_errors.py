"""How far gusts may have turned the unknowns: regressors that are in error.

The velocity through the air is known but for the gusts.  A vehicle that answers them (a plane that
keeps its lift turns its nose against a gust) makes least squares take the scatter of the angle for
a law that hardly depends on it.  That is no scatter of the estimate, which the blocks' sums would
tell, but a step towards zero in every block: :mod:`onboard.core.vehicle.turned` has what it can be.

How large the gusts are an airspeed sensor tells along the flow.  Across it no gust is larger than
what is left of the force: an error of the angle that shortens the law of the force by L leaves
``1 / L`` of the error's square in the residual, over the law as it was found.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import AHEAD, UP
from onboard.core.vehicle.effects.lift import Lift
from onboard.core.vehicle.felt import Felt
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.model import GUST
from onboard.core.vehicle.turned import Turned
from onboard.core.vehicle.windows import windows_of

LEAST_SLOPE = 1e-6
"""1/s: a force that no gust changes tells nothing of gusts [physics]."""


def rising(fit: Fit) -> float:
    """RMS of the air up and down that would do what a plane's model leaves, m/s.

    Zero for what has no wing.
    """
    if not fit.model.indices(Lift.name) or UP not in fit.model.axes:
        return 0.0
    k, windows = fit.model.axes.index(UP), windows_of(fit.model.flight)
    here = fit.model.predicted(fit.theta)
    gust = GUST * fit.model.flight.R_bn[:, UP]
    slope = windows.mean(fit.model.predicted(fit.theta, gust) - here)[:, k] / GUST
    least = max(float(np.sqrt(np.mean(slope**2))), LEAST_SLOPE)
    return float(np.sqrt(np.mean(windows.mean(fit.residual[:, k]) ** 2))) / least


def turned_by_gusts(fit: Fit, rms: float, felt: Felt | None = None) -> Turned:
    """What gusts of this RMS along the flow, m/s, and at most as large across it, may have done.

    Args:
        fit: of everything.
        rms: along the flow, m/s.
        felt: what the force ahead has told, which has no gusts in it.
    """
    m = len(fit.theta)
    clear = () if felt is None else felt.places
    lean = np.zeros((m, 0)) if felt is None else felt.lean
    windows = windows_of(fit.model.flight)
    here = fit.model.predicted(fit.theta)
    sizes = [its.size(windows.mean(fit.sensitivity[:, k])) for k, its in enumerate(fit.noise)]
    E, b = np.zeros((m, m)), np.zeros(m)
    for axis in range(3):
        gust = GUST * fit.model.flight.R_bn[:, axis]
        slope = windows.mean(fit.model.predicted(fit.theta, gust) - here) / GUST
        with_gust = fit.model.jacobian(fit.theta, gust)
        apart = replace(with_gust, by=with_gust.by - fit.jacobian.by)
        turned = apart.means(windows).whole / GUST
        level = _level(fit, sizes, slope, axis, rms)
        for k, size in enumerate(sizes):
            if felt is not None and felt.ahead and k == AHEAD:
                continue
            # Gusts have the colour of the noise: what whitens it leaves them as they are.
            rows = level * turned[:, k] / size[:, None]
            E += rows.T @ rows
            b += rows.T @ (level * slope[:, k] / size)
    # The mean wind is what gusts are about.
    for place in (*fit.model.indices("wind"), *fit.model.indices("wind_profile"), *clear):
        E[place] = E[:, place] = b[place] = 0.0
    return Turned(E, b, fit.prior, lean)


def _level(fit: Fit, sizes: list[Array], slope: Array, axis: int, rms: float) -> float:
    """RMS of the gusts along a body axis, m/s."""
    if axis not in fit.model.axes:
        return rms
    k = fit.model.axes.index(axis)
    slope_of = float(np.sqrt(np.mean(slope[:, k] ** 2)))
    if axis == AHEAD or slope_of < LEAST_SLOPE:
        # Ahead the sensor tells; drag hardly shows a gust.
        return rms
    return min(rms, float(np.sqrt(np.mean(sizes[k] ** 2))) / slope_of)
