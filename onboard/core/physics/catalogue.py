"""Every effect that is looked for with columns; the order is that of the documentation."""

from __future__ import annotations

from onboard.core.physics.attitude import HeadingByThrottle
from onboard.core.physics.effect import EffectColumns, Origin
from onboard.core.physics.gains import CrossAxis, LoadFlex, ScaleNonlinearity
from onboard.core.physics.mount import ForceTilt
from onboard.core.physics.offsets import (
    BiasRamp,
    Gravity,
    TemperatureDrift,
    ThrottleCoupling,
    VibrationRectification,
)
from onboard.core.physics.receiver import ClockSkew, LeverArm

CATALOGUE: tuple[type[EffectColumns], ...] = (
    LeverArm,
    CrossAxis,
    ForceTilt,
    HeadingByThrottle,
    TemperatureDrift,
    BiasRamp,
    ScaleNonlinearity,
    VibrationRectification,
    ThrottleCoupling,
    ClockSkew,
    Gravity,
    LoadFlex,
)


def catalogue(origin: Origin) -> list[EffectColumns]:
    """One instance of each, about ``origin``."""
    return [make(origin) for make in CATALOGUE]  # type: ignore[call-arg] # all take an origin
