"""Drag, thrust and sag of a copter as curves with the data they were found from."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.atmosphere import SEA_LEVEL_DENSITY
from onboard.core.vehicle.binning import FEWEST_IN_BIN, binned, thinned
from onboard.core.vehicle.matching import Matched
from onboard.core.vehicle.records import Curve
from onboard.core.vehicle.signals import Signals


def copter_curves(m: Matched, frame: CopterAirframe, signals: Signals) -> tuple[Curve, ...]:
    """Every curve that the recording has data for."""
    curves = [_drag(m, frame, axis) for axis in (0, 1)]
    thrust = _thrust(m, frame)
    if thrust is not None:
        curves.append(thrust)
    sag = _sag(m, frame, signals)
    if sag is not None:
        curves.append(sag)
    return tuple(c for c in curves if len(c.x))


def _drag(m: Matched, frame: CopterAirframe, axis: int) -> Curve:
    """Specific force of drag over the speed through the air, at hover thrust and sea level."""
    theta, model = m.fit.theta, m.model
    c_m = float(theta[model.indices("rotor_drag")[0]])
    k = float(theta[model.indices("body_drag")[axis]])
    u = model.air(theta).u_b[:, axis]

    def law(x: Array, linear: float, quadratic: float) -> Array:
        return -linear * x - 0.5 * SEA_LEVEL_DENSITY * quadratic * np.abs(x) * x

    data = law(u, c_m, k) + m.fit.residual[:, axis]
    x, mean, spread = binned(u, data)
    return Curve(
        f"drag_{'xy'[axis]}",
        "speed through the air",
        "m/s",
        "specific force of drag",
        "m/s^2",
        x,
        mean,
        spread,
        law(x, c_m, k),
        law(x, frame.rotor_drag, frame.body_drag),
        thinned(u, data),
    )


def _thrust(m: Matched, frame: CopterAirframe) -> Curve | None:
    """Specific thrust over the mean command, full battery, reference density, no inflow."""
    theta, model = m.fit.theta, m.model
    if 2 not in model.axes:
        return None
    air = model.air(theta)
    if air.commands is None or air.power is None:
        return None
    expo = float(theta[model.indices("thrust_curve")[0]])
    scale = float(np.exp(theta[model.indices("thrust_scale")[0]]))
    top = frame.full_thrust
    c = air.commands[:, 0]
    column = model.axes.index(2)
    # As if every motor had the mean command: what they differ by bends the law.
    level = (1.0 - expo) * c + expo * c * c
    share = level * (top * scale - m.fit.residual[:, column] / np.maximum(air.power, 1e-3))
    x, mean, spread = binned(c, share)
    return Curve(
        "thrust",
        "mean command of the motors",
        "1",
        "specific thrust",
        "m/s^2",
        x,
        mean,
        spread,
        top * scale * ((1.0 - expo) * x + expo * x * x),
        top * ((1.0 - frame.propExpo) * x + frame.propExpo * x * x),
        thinned(c, share),
    )


def _sag(m: Matched, frame: CopterAirframe, signals: Signals) -> Curve | None:
    """Voltage over the charge that was taken, the nominal one constant."""
    b, flight = signals.battery, m.model.flight
    if not len(b) or b.x.shape[1] < 2 or not np.isfinite(b.x).all():
        return None
    used = np.cumsum(b.x[:, 1] * np.clip(np.diff(b.t, prepend=b.t[0]), 0.0, 5.0)) / 3600.0
    flown = (b.t >= flight.t[0]) & (b.t <= flight.t[-1])
    if np.count_nonzero(flown) < 2 * FEWEST_IN_BIN or float(np.ptp(used[flown])) <= 0.0:
        return None
    x, mean, spread = binned(used[flown], b.x[flown, 0])
    nominal = np.full(len(x), frame.maxVoltage)
    points = thinned(used[flown], b.x[flown, 0])
    return Curve("sag", "charge taken", "Ah", "battery voltage", "V", x, mean, spread,
                 mean.copy(), nominal, points)  # fmt: skip
