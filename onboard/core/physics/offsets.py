"""Effects that add to the accelerometer's reading: temperature, time, vibration, throttle."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import Unknown
from onboard.core.physics.effect import AXES, EffectColumns, Origin, on_axes


class TemperatureDrift(EffectColumns):
    """Offset that follows the sensor's temperature, linear about ArduPilot's 35 degC."""

    name = effect = "temperature_drift"
    tilts_ekf = True
    needs = ("temperature",)
    source = "AP_InertialSensor_tempcal: polynomial about 35 degC; its linear term"
    cure = "calibrate the IMU's temperature drift: INS_TCAL1_ENABLE = 2, cold start, let it warm up"
    apart = "fly once cold and once warm"

    def __init__(self, origin: Origin) -> None:
        """Take the reference temperature."""
        self._reference = origin.temperature
        self._three("m/s^2/K", 0.1)

    def available(self, nodes: Signals) -> bool:
        """Needs a temperature that changes by more than half a kelvin."""
        t = nodes.slow("temperature")
        return t is not None

    def acceleration(self, nodes: Signals) -> Array:
        """``-(T - T0) e_i``."""
        T = nodes.slow("temperature")
        excess = (np.zeros(nodes.t.shape) if T is None else T) - self._reference
        return on_axes(np.repeat(excess[..., None], 3, axis=-1))


class BiasRamp(EffectColumns):
    """Offset that grows with time."""

    name = effect = "bias_ramp"
    tilts_ekf = True
    source = "first-order drift, IEEE Std 1293"
    cure = "recalibrate; look for a cause that grows with time (warming, moisture, a loose mount)"
    apart = "fly longer, once cold and once warm"

    def __init__(self, origin: Origin) -> None:
        """Take the time from which it counts."""
        self._t0 = origin.t0
        self._three("m/s^3", 0.01)

    def acceleration(self, nodes: Signals) -> Array:
        """``-(t - t0) e_i``."""
        return on_axes(np.repeat((nodes.t - self._t0)[..., None], 3, axis=-1))


class BiasStep(EffectColumns):
    """Offset that jumps at one moment."""

    effect = "bias_step"
    tilts_ekf = True
    source = "step in the offset: a shock, a mount that gave way"
    cure = "inspect the mount of the autopilot; recalibrate on the ground"
    apart = "fly on: a step stays"

    def __init__(self, at: float) -> None:
        """Take the moment, s on the boot clock."""
        self.at = at
        self.name = f"bias_step_{at:.2f}"
        self._three("m/s^2", 3.0)

    def acceleration(self, nodes: Signals) -> Array:
        """``-e_i`` from the moment on."""
        after = (nodes.t >= self.at).astype(np.float64)
        return on_axes(np.repeat(after[..., None], 3, axis=-1))


class VibrationRectification(EffectColumns):
    """Offset that grows with the square of vibration."""

    name = effect = "vibration_rectification"
    tilts_ekf = True
    needs = ("vibration",)
    source = "vibration rectification error, IEEE Std 1293 and MEMS data sheets"
    cure = "damp the autopilot's mount, balance propellers"
    apart = "change the vibration level: hover, cruise, full throttle"

    def __init__(self, origin: Origin) -> None:
        """No reference is needed."""
        del origin
        self._three("s^2/m", 0.1)

    def acceleration(self, nodes: Signals) -> Array:
        """``-vibe_i^2 e_i``."""
        vibe = nodes.slow("vibration")
        return on_axes(np.zeros((*nodes.t.shape, 3)) if vibe is None else vibe**2)


class ThrottleCoupling(EffectColumns):
    """Offset proportional to throttle: supply voltage, airframe twist."""

    name = effect = "throttle_coupling"
    tilts_ekf = True
    needs = ("throttle",)
    source = "linear in the throttle"
    cure = "separate the autopilot's power wiring from the motors', stiffen its mount"
    apart = "change the throttle at constant attitude"

    def __init__(self, origin: Origin) -> None:
        """No reference is needed."""
        del origin
        self._three("m/s^2", 3.0)

    def acceleration(self, nodes: Signals) -> Array:
        """``-throttle e_i``."""
        throttle = nodes.slow("throttle")
        level = np.zeros(nodes.t.shape) if throttle is None else throttle
        return on_axes(np.repeat(level[..., None], 3, axis=-1))


class Gravity(EffectColumns):
    """Gravity that differs from 9.80665 m/s^2."""

    name = effect = "gravity"
    source = "Somigliana's formula says what to expect"
    cure = "none: the autopilot integrates with 9.80665 everywhere"
    apart = "fly steep banked turns: an offset turns with the body, gravity does not"
    keys = ("delta_g",)
    # Poles to equator, and 5 km up, it is between 0.03 more and 0.045 less than the standard.
    plausible = (0.045,)
    unknowns = (Unknown("delta_g", "m/s^2", 0.0, 0.06),)

    def __init__(self, origin: Origin) -> None:
        """No reference is needed."""
        del origin

    def acceleration(self, nodes: Signals) -> Array:
        """Down, in body axes by the recorded attitude."""
        flat, _ = nodes.segment.attitude_at(nodes.t.ravel())
        down = flat[:, 2, :].reshape(*nodes.t.shape, 3)
        return down[..., None]


__all__ = [
    "AXES",
    "BiasRamp",
    "BiasStep",
    "Gravity",
    "TemperatureDrift",
    "ThrottleCoupling",
    "VibrationRectification",
]
