"""Concealed effects: what can be wrong with a recording beyond the six numbers and the timing.

Names, unknowns and signs are those of the project's catalogue of effects: every number is the
*error of the recording* - what the sensor reads too much, how much too large the recorded
angle is, how late something is.  Each class changes exactly one thing, at sensor level on the
1 kHz grid, before filters and quantisation.  ``imu`` restricts an effect to one
accelerometer; 0 means all of them.

A file that is put here is found: its effects are in :data:`ALL`.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

from sitl.builtin.effects.accelerometer import (
    AccelerometerResolution,
    AccelerometerSpikes,
    AccelerometerTilt,
    BiasRamp,
    BiasStep,
    CrossAxis,
    LoadFlex,
    Nameless,
    OffsetWander,
    Saturation,
    ScaleNonlinearity,
    ScaleStep,
    TemperatureDrift,
    ThrottleCoupling,
    VibrationRectification,
)
from sitl.builtin.effects.attitude import (
    BoardTilt,
    HeadingByThrottle,
    HeadingError,
    ImuDelay,
    MountTilt,
)
from sitl.builtin.effects.base import Effect, Scene, Vector3
from sitl.builtin.effects.receiver import (
    ClockSkew,
    GpsFault,
    GpsLatency,
    GpsLeverArm,
    GpsOvershoot,
    GpsSmoothing,
)
from sitl.builtin.effects.vehicle import Gravity, RotorDrag

ALL: tuple[type[Effect], ...] = tuple(
    kind
    for module in sorted(m.name for m in iter_modules(__path__))
    for kind in vars(import_module(f"{__name__}.{module}")).values()
    if isinstance(kind, type) and issubclass(kind, Effect) and kind.__module__.endswith(module)
    if kind.name
)
"""Every concealed effect."""

__all__ = [
    "ALL",
    "AccelerometerResolution",
    "AccelerometerSpikes",
    "AccelerometerTilt",
    "BiasRamp",
    "BiasStep",
    "BoardTilt",
    "ClockSkew",
    "CrossAxis",
    "Effect",
    "GpsFault",
    "GpsLatency",
    "GpsLeverArm",
    "GpsOvershoot",
    "GpsSmoothing",
    "Gravity",
    "HeadingByThrottle",
    "HeadingError",
    "ImuDelay",
    "LoadFlex",
    "MountTilt",
    "Nameless",
    "OffsetWander",
    "RotorDrag",
    "Saturation",
    "ScaleNonlinearity",
    "ScaleStep",
    "Scene",
    "TemperatureDrift",
    "ThrottleCoupling",
    "Vector3",
    "VibrationRectification",
]
