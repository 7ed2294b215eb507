"""What every concealed effect has: its name, its hook into the simulated sensor, its sizes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sitl.builtin import rotation
from sitl.builtin.trajectory import Trajectory

Array: TypeAlias = NDArray[np.float64]
Vector3: TypeAlias = tuple[float, float, float]
Sizes: TypeAlias = Mapping[str, float]
"""Sizes of unknowns by their names."""


@dataclass(frozen=True, slots=True)
class Scene:
    """What an accelerometer goes through, n samples at 1 kHz.

    Attributes:
        f_b: (n, 3) the true specific force, body axes, m/s^2.
        elapsed: (n,) s since the start of the recording.
        temperature: (n,) of the sensor, degC.
        level: (n, 3) vibration as VIBRATION reports it, m/s^2.
        trajectory: the motion.
    """

    f_b: Array
    elapsed: Array
    temperature: Array
    level: Array
    trajectory: Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """Base of all: knows its catalogue name and how it is written in a truth record.

    ``units`` are sizes for the sealed challenge, by vehicle and unknown: about what a clean flight
    of four minutes says five sigma of that unknown are; empty for what is not challenged.  ``most``
    is a size at which the part would be broken and not wrong; effects of one ``kind`` are one
    effect of that kind to any single flight.
    """

    name: ClassVar[str] = ""
    units: ClassVar[Mapping[str, Sizes]] = {}
    most: ClassVar[float] = float("inf")
    kind: ClassVar[str] = ""
    positive: ClassVar[bool] = False
    alone: ClassVar[bool] = False

    def as_record(self) -> dict[str, Any]:
        """Name and unknowns, as a JSON object."""
        return {"name": self.name, **asdict(self)}

    def reads_too_much(self, scene: Scene) -> Array | None:  # noqa: ARG002
        """What an accelerometer reads too much, (n, 3) m/s^2; None if nothing."""
        return None


def turned(roll: float, pitch: float) -> Array:
    """(3, 3) axes turned by roll and pitch (rad): their components times it are the old ones."""
    out: Array = rotation.from_euler(np.array([roll]), np.array([pitch]), np.zeros(1))[0]
    return out
