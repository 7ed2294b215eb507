"""How far gusts may have turned the unknowns: regressors that are in error.

The velocity through the air is known but for the gusts.  A vehicle that answers them (a plane that
keeps its lift turns its nose against a gust) makes least squares take the scatter of the angle for
a law that hardly depends on it.  How much of that happened is not seen; the most that can have
happened is: with regressors H of which the gusts make ``E = sum dH^T dH``, an estimate is short by
``(N - E)^-1 b``, ``b`` the mean of ``dH^T`` times what the gusts do to the force.  W. A. Fuller,
*Measurement Error Models* (1987), section 1.2.
"""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.limits import MOST_BY_GUSTS
from onboard.core.vehicle.model import GUST
from onboard.core.vehicle.windows import windows_of


def gust_doubt(fit: Fit, rms: float) -> Array:
    """(m,) the most that gusts of this RMS along each axis, m/s, may have turned the unknowns."""
    m = len(fit.theta)
    if not rms > 0.0:
        return np.zeros(m)
    windows = windows_of(fit.model.flight)
    slope = windows.mean(fit.model.gust_slope(fit.theta))
    E, b = np.zeros((m, m)), np.zeros(m)
    sizes = [its.size(windows.mean(fit.sensitivity[:, k])) / rms for k, its in enumerate(fit.noise)]
    for direction, gust in enumerate(GUST * np.eye(3)):
        turned = windows.mean(fit.model.jacobian(fit.theta, gust) - fit.jacobian) / GUST
        for k, size in enumerate(sizes):
            # Gusts have the colour of the noise: what whitens it leaves them as they are.
            rows = turned[:, k] / size[:, None]
            E += rows.T @ rows
            b += rows.T @ (slope[:, k, direction] / size)
    root = np.linalg.cholesky(fit.information)
    inverse = np.linalg.inv(root)
    share, axes = np.linalg.eigh(inverse @ E @ inverse.T)
    short = axes @ ((axes.T @ (inverse @ b)) / (1.0 - np.minimum(share, MOST_BY_GUSTS)))
    out: Array = np.abs(inverse.T @ short)
    # The mean wind is what gusts are about.
    out[[*fit.model.indices("wind"), *fit.model.indices("wind_profile")]] = 0.0
    return out
