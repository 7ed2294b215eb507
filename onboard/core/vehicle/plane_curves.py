"""Lift, drag and thrust of a plane as curves with the data they were found from."""

from __future__ import annotations

import numpy as np

from onboard.core.vehicle.binning import binned, thinned
from onboard.core.vehicle.matching import Matched
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.core.vehicle.records import Curve

LEAST_PRESSURE = 1.0
"""m/s^2 by coefficient, below which nothing is seen [physics]."""


def plane_curves(m: Matched, frame: PlaneAirframe) -> tuple[Curve, ...]:
    """Every curve that the recording has data for."""
    theta, model = m.fit.theta, m.model
    air = model.air(theta)
    use = air.pressure > LEAST_PRESSURE
    c_lift_0, c_lift_a = theta[model.indices("lift")].tolist()
    curves = []
    if 2 in model.axes:
        left = m.fit.residual[:, model.axes.index(2)]
        data = air.lift - left / np.maximum(air.pressure, LEAST_PRESSURE)
        x, mean, spread = binned(air.alpha[use], data[use])
        fitted, nominal = c_lift_0 + c_lift_a * x, frame.c_lift_0 + frame.c_lift_a * x
        curves.append(
            Curve("lift", "angle of attack", "rad", "lift coefficient", "1", x, mean, spread,
                  fitted, nominal, thinned(air.alpha[use], data[use]))
        )  # fmt: skip
    if 0 in model.axes and model.indices("drag"):
        profile, induced = theta[model.indices("drag")].tolist()
        left = m.fit.residual[:, model.axes.index(0)]
        law = profile + induced * air.lift**2
        data = law - left / np.maximum(air.pressure, LEAST_PRESSURE)
        x, mean, spread = binned(air.lift[use], data[use])
        fitted, nominal = profile + induced * x**2, frame.c_drag_p + frame.induced * x**2
        curves.append(
            Curve("drag", "lift coefficient", "1", "drag coefficient", "1", x, mean, spread,
                  fitted, nominal, thinned(air.lift[use], data[use]))
        )  # fmt: skip
    return tuple(c for c in curves if len(c.x))
