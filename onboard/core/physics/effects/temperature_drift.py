"""An offset that follows the temperature."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Signals
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import REFERENCE_DEGC, Bearing, Effect, Origin, on_axes
from onboard.core.physics.finding import Finding


class TemperatureDrift(Effect):
    """Offset that follows the sensor's temperature, linear about ArduPilot's 35 degC."""

    effect = "temperature_drift"
    code = 9
    title = "The offset follows the temperature"
    sentence = "the offset follows the temperature"
    meaning = "`x`, `y`, `z`, m/s²/K about 35 °C"
    bearing = Bearing.NO_ONE_NUMBER
    source = "AP_InertialSensor_tempcal: polynomial about 35 degC; its linear term"
    cure = "calibrate the IMU's temperature drift: INS_TCAL1_ENABLE = 2, cold start, let it warm up"
    apart = "fly once cold and once warm"
    needs = ("temperature",)
    tilts_ekf = True
    changes_force = True
    response = curves.Response(
        "temperature",
        "°C",
        "offset error",
        "m/s^2",
        curves.slow("temperature"),
        lambda x, about: x - about,
    )

    def __init__(self, origin: Origin) -> None:
        """Take the reference temperature."""
        super().__init__(origin)
        self.take_axes("m/s^2/K", 0.1)

    def acceleration(self, nodes: Signals) -> Array:
        """``-(T - T0) e_i``."""
        T = nodes.slow("temperature")
        excess = (np.zeros(nodes.t.shape) if T is None else T) - self.origin.temperature
        return on_axes(excess[..., None])

    @classmethod
    def condition(cls, found: Finding, offset: float, change: float) -> str:
        """The offset at the reference, its slope, and where that was flown."""
        said = f"{offset:.4f} at {REFERENCE_DEGC:.0f} degC, {change:+.4f} per degree"
        if found.response_curve is None:
            return said
        flown = found.response_curve.x
        low, high = float(np.min(flown)), float(np.max(flown))
        return f"{said}, flown from {low:.0f} to {high:.0f} degC"
