"""A copter as ArduPilot's simulator describes it, and what its numbers mean for the force.

Names, defaults and meaning of the keys are those of the frame files that the simulator loads
(facts of libraries/SITL/SIM_Frame in ArduPilot 4.7-dev).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.vehicle.airframe_file import with_numbers
from onboard.core.vehicle.atmosphere import SEA_LEVEL_DENSITY, density

POSITIVE = ("mass", "refSpd", "maxVoltage", "hoverThrOut", "disc_area", "refVoltage")
"""Keys of a file that are divided by, or a root is taken of."""
DERIVED = ("reference_density", "rotor_drag", "body_drag", "full_thrust", "inflow")
LEAST_BODY_DRAG = 1e-4
"""m^2/kg; a file cannot have rotors' drag and none at all of the body: its reference test gives
what is left over to the body."""


@dataclass(frozen=True, slots=True)
class CopterAirframe:
    """Keys of a frame file; units: kg, m, m/s, degrees, V, A, Ah, ohm, microseconds."""

    mass: float = 3.0
    diagonal_size: float = 0.35
    refSpd: float = 15.08  # noqa: N815 - the file's own name, as all below
    refAngle: float = 45.0  # noqa: N815
    refVoltage: float = 12.09  # noqa: N815
    refCurrent: float = 29.3  # noqa: N815
    refAlt: float = 593.0  # noqa: N815
    refTempC: float = 25.0  # noqa: N815
    refBatRes: float = 0.01  # noqa: N815
    maxVoltage: float = 12.6  # noqa: N815
    battCapacityAh: float = 0.0  # noqa: N815
    hoverThrOut: float = 0.39  # noqa: N815
    propExpo: float = 0.65  # noqa: N815
    refRotRate: float = 120.0  # noqa: N815
    pwmMin: float = 1000.0  # noqa: N815
    pwmMax: float = 2000.0  # noqa: N815
    spin_min: float = 0.15
    spin_max: float = 0.95
    slew_max: float = 150.0
    disc_area: float = 0.385
    mdrag_coef: float = 0.2
    num_motors: float = 4.0

    @classmethod
    def of(cls, given: Mapping[str, object]) -> CopterAirframe:
        """The default frame with the numbers of a frame file in their places.

        Raises:
            ValueError: a key that should be a number is none, or cannot be.
        """
        return with_numbers(cls(), given, POSITIVE, DERIVED)

    @property
    def reference_density(self) -> float:
        """Density at refAlt, kg/m^3."""
        return float(density(self.refAlt))

    @property
    def rotor_drag(self) -> float:
        """``c_m`` of this file's rotors, 1/s: EK3_DRAG_MCOEF at hover thrust and sea level.

        The reference test limits it: momentum drag alone cannot be more than its whole drag.
        """
        hover = self.mass * STANDARD_GRAVITY
        wanted = self.mdrag_coef * math.sqrt(SEA_LEVEL_DENSITY * self.disc_area * hover) / self.mass
        whole, momentum = self._reference_drag()
        return wanted * min(1.0, whole / momentum) if momentum > 0.0 else wanted

    @property
    def body_drag(self) -> float:
        """``1 / b``: area times drag coefficient by mass, m^2/kg: 1 / EK3_DRAG_BCOEF."""
        whole, momentum = self._reference_drag()
        pressure = 0.5 * self.reference_density * self.refSpd**2
        return max(whole - momentum, 0.0) / pressure / self.mass

    @property
    def full_thrust(self) -> float:
        """Specific force at full command, full battery and reference density, m/s^2."""
        return STANDARD_GRAVITY / self.hoverThrOut

    @property
    def inflow(self) -> float:
        """Specific force that inflow takes away, m/s^2 per (m/s)^2 at reference density."""
        outflow = 2.0 * self.refCurrent * self.refVoltage / (self.mass * STANDARD_GRAVITY)
        return STANDARD_GRAVITY / outflow**2 if outflow > 0.0 else 0.0

    def _reference_drag(self) -> tuple[float, float]:
        """Drag of the reference test (N), and that of the rotors in it."""
        tilt = math.radians(self.refAngle)
        weight = self.mass * STANDARD_GRAVITY
        thrust = weight / math.cos(tilt)
        airspeed = self.refSpd * math.cos(tilt)
        root = math.sqrt(thrust * self.reference_density * self.disc_area)
        return weight * math.tan(tilt), math.cos(tilt) * self.mdrag_coef * airspeed * root

    def with_drag(self, rotor_drag: float, body_drag: float) -> CopterAirframe:
        """A frame whose file gives these two: ``mdrag_coef`` and ``refAngle`` are set.

        Args:
            rotor_drag: ``c_m``, 1/s.
            body_drag: ``1 / b``, m^2/kg.
        """
        hover = self.mass * STANDARD_GRAVITY
        root = math.sqrt(SEA_LEVEL_DENSITY * self.disc_area * hover)
        made = replace(self, mdrag_coef=max(rotor_drag, 0.0) * self.mass / root)
        # What the file gives grows with the angle of its reference test: halve the interval.
        low, high = 0.5, 85.0
        for _ in range(60):
            angle = 0.5 * (low + high)
            made = replace(made, refAngle=angle)
            if made.body_drag < max(body_drag, LEAST_BODY_DRAG):
                low = angle
            else:
                high = angle
        return made
