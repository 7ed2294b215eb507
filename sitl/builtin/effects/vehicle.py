"""What can be otherwise around the sensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sitl.builtin.effects.base import Effect


@dataclass(frozen=True, slots=True, kw_only=True)
class Gravity(Effect):
    """Gravity is stronger than the standard 9.80665 by ``delta_g`` (m/s^2)."""

    name: ClassVar[str] = "gravity"
    delta_g: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RotorDrag(Effect):
    """A multicopter's linear drag, 1/s; changes how it flies, not what sensors read."""

    name: ClassVar[str] = "rotor_drag"
    x: float
    y: float
