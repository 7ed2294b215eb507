"""How far the velocity drifts when the model alone flies on, from many starts."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.limits import ALONE_EVERY_S, ALONE_S


def drift_alone(flight: Flight, error_b: Array, slope: Array) -> Array:
    """(k,) RMS over the starts of the velocity error after each step, m/s; empty if none fits.

    The last is that after :data:`ALONE_S`.

    The attitude is the recorded one; the model feels its own velocity: ``d(dv)/dt = R (e + G dv)``
    with the force's error e and its slope G over the velocity.

    Args:
        flight: n steps.
        error_b: (n, 3) predicted less measured specific force, m/s^2.
        slope: (n, 3, 3) change of the force by the velocity over ground, NED, 1/s.
    """
    h = flight.step_s
    length, every = round(ALONE_S / h), round(ALONE_EVERY_S / h)
    starts = [
        k
        for k in range(0, len(flight) - length, every)
        if flight.piece[k] == flight.piece[k + length]
        and flight.t[k + length] - flight.t[k] < 1.2 * ALONE_S
    ]
    if not starts:
        return np.zeros(0)
    at = np.array(starts)
    drift = np.zeros((len(at), 3))
    out = np.empty(length)
    for k in range(length):
        i = at + k
        R_nb = np.swapaxes(flight.R_bn[i], -1, -2)
        # Implicit: a plane's lift answers faster than a step.
        damped = np.eye(3) - h * R_nb @ slope[i]
        pushed = drift + h * np.einsum("nij,nj->ni", R_nb, error_b[i])
        drift = np.linalg.solve(damped, pushed[..., None])[..., 0]
        out[k] = np.sqrt(np.mean(np.sum(drift**2, axis=1)))
    return out
