"""A multicopter's airframe in the keys of ArduPilot's frame files, and what follows from them.

Drag is given by a test: at ``refSpd`` (over ground, no wind) the vehicle tilts by ``refAngle``.
What the momentum of the rotors' inflow does not explain of it is drag of the body, of which
ArduPilot knows one area for all axes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from sitl.builtin.airframe.air import GRAVITY, SEA_LEVEL_DENSITY, density
from sitl.builtin.smoothing import Array

OWN_KEYS = ("motor_lag", "ground_effect", "payload", "payload_until", "motor_vector")
"""Fields that no frame file of ArduPilot's has; its SITL reads over them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Airframe:
    """One multicopter; names and defaults are those of ArduPilot's frame files.

    Attributes:
        motor_vector: direction of every motor's thrust, body axes; (0, 0, -1) is straight up.
        motor_lag: time constant from output to thrust, s.
        ground_effect: factor on the rotor's radius in Cheeseman and Bennett's formula; 0 is none.
        payload: what is carried on top of ``mass`` until ``payload_until``, kg.
        payload_until: s since the start of the flight.
    """

    mass: float = 3.0
    diagonal_size: float = 0.35
    refSpd: float = 15.08  # noqa: N815
    refAngle: float = 45.0  # noqa: N815
    refVoltage: float = 12.09  # noqa: N815
    refCurrent: float = 29.3  # noqa: N815
    refAlt: float = 593.0  # noqa: N815
    refTempC: float = 25.0  # noqa: N815
    refBatRes: float = 0.01  # noqa: N815
    maxVoltage: float = 12.6  # noqa: N815
    battCapacityAh: float = 0.0  # noqa: N815
    propExpo: float = 0.65  # noqa: N815
    refRotRate: float = 120.0  # noqa: N815
    hoverThrOut: float = 0.39  # noqa: N815
    pwmMin: float = 1000.0  # noqa: N815
    pwmMax: float = 2000.0  # noqa: N815
    spin_min: float = 0.15
    spin_max: float = 0.95
    slew_max: float = 150.0
    disc_area: float = 0.385
    mdrag_coef: float = 0.2
    num_motors: int = 4
    motor_vector: tuple[float, float, float] = (0.0, 0.0, -1.0)
    motor_lag: float = 0.0
    ground_effect: float = 0.0
    payload: float = 0.0
    payload_until: float = 0.0

    # -- files -----------------------------------------------------------------------------

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Airframe:
        """Of a frame file's object; keys that are not known here are left out."""
        known = {f.name for f in fields(cls)}
        chosen: dict[str, Any] = {k: v for k, v in values.items() if k in known}
        chosen["num_motors"] = int(chosen.get("num_motors", 4))
        vector = values.get("motor1_vector", chosen.get("motor_vector", (0.0, 0.0, -1.0)))
        chosen["motor_vector"] = tuple(float(x) for x in vector)
        return cls(**chosen)

    @classmethod
    def load(cls, path: str | Path) -> Airframe:
        """A frame file."""
        return cls.from_dict(json.loads(Path(path).read_text(encoding="utf-8")))

    def as_dict(self) -> dict[str, Any]:
        """The object of a frame file."""
        out = asdict(self)
        vector = list(out.pop("motor_vector"))
        if vector != [0.0, 0.0, -1.0]:
            out |= {f"motor{i + 1}_vector": vector for i in range(self.num_motors)}
        nominal = {f.name: f.default for f in fields(self)}
        for key in OWN_KEYS:
            if key in out and out[key] == nominal[key]:
                del out[key]
        return out

    def save(self, path: str | Path) -> None:
        """Writes a frame file that ArduPilot's SITL loads."""
        text = json.dumps(self.as_dict(), indent=1, sort_keys=True)
        Path(path).write_text(text + "\n", encoding="utf-8")

    # -- drag ------------------------------------------------------------------------------

    @property
    def ref_density(self) -> float:
        """Air density of the test, kg/m^3."""
        return float(density(np.array(self.refAlt)))

    def _test_drag(self) -> tuple[float, float]:
        """Horizontal force in the test, N: all of it, and the rotors' part."""
        weight = self.mass * GRAVITY
        tilt = np.radians(self.refAngle)
        along = self.refSpd * np.cos(tilt)
        thrust = weight / np.cos(tilt)
        flow = np.sqrt(thrust * self.ref_density * self.disc_area)
        return float(weight * np.tan(tilt)), float(np.cos(tilt) * self.mdrag_coef * along * flow)

    @property
    def momentum_coefficient(self) -> float:
        """``mdrag_coef`` in force: never more than the test's whole drag."""
        whole, rotors = self._test_drag()
        return self.mdrag_coef * min(1.0, whole / rotors) if rotors > 0.0 else self.mdrag_coef

    @property
    def area_cd(self) -> float:
        """Drag area of the body, m^2."""
        whole, rotors = self._test_drag()
        return max(whole - rotors, 0.0) / (0.5 * self.ref_density * self.refSpd**2)

    @property
    def mcoef(self) -> float:
        """EK3_DRAG_MCOEF, 1/s: momentum drag over mass and speed, hovering at 1.225 kg/m^3."""
        flow = np.sqrt(SEA_LEVEL_DENSITY * self.disc_area * self.mass * GRAVITY)
        return float(self.momentum_coefficient * flow / self.mass)

    @property
    def bcoef(self) -> float:
        """EK3_DRAG_BCOEF_X and _Y, kg/m^2; infinite where the body has no drag."""
        return self.mass / self.area_cd if self.area_cd > 0.0 else float("inf")

    def with_drag(self, mcoef: float | None = None, bcoef: float | None = None) -> Airframe:
        """The same vehicle with other drag, by the EKF's two numbers; None keeps what it has.

        The test's angle follows, so that a frame file says the same.

        Raises:
            ValueError: no angle below 80 degrees has so much drag.
        """
        wanted_b = self.bcoef if bcoef is None else bcoef
        wanted_m = self.mcoef if mcoef is None else mcoef
        flow = np.sqrt(SEA_LEVEL_DENSITY * self.disc_area * self.mass * GRAVITY)
        area = 0.0 if np.isinf(wanted_b) else self.mass / wanted_b
        plain = replace(self, mdrag_coef=float(wanted_m * self.mass / flow))

        def missing(angle: float) -> float:
            whole, rotors = replace(plain, refAngle=angle)._test_drag()  # noqa: SLF001
            return whole - rotors - area * 0.5 * plain.ref_density * plain.refSpd**2

        low, high = 0.0, 80.0
        if missing(high) < 0.0:
            raise ValueError("no test below 80 degrees has so much drag")
        for _ in range(200):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if missing(middle) < 0.0 else (low, middle)
        return replace(plain, refAngle=0.5 * (low + high))

    # -- thrust ----------------------------------------------------------------------------

    @property
    def outflow_max(self) -> float:
        """Speed of the air behind the rotors at full command and full voltage, m/s."""
        return float(self._hover_outflow / np.sqrt(self.hoverThrOut))

    @property
    def _hover_outflow(self) -> float:
        return 2.0 * self.refVoltage * self.refCurrent / (self.mass * GRAVITY)

    @property
    def effective_area(self) -> float:
        """Area of all rotors that makes the hover thrust of the hover power, m^2."""
        hover = self.mass * GRAVITY
        return float(hover / (0.5 * self.ref_density * self._hover_outflow**2))

    @property
    def power_factor(self) -> float:
        """Electric power per thrust, W/N."""
        return self.refVoltage * self.refCurrent / (self.mass * GRAVITY)

    @property
    def inertia(self) -> tuple[float, float, float]:
        """Moments of inertia, kg m^2: half of the mass on a ring, as ArduPilot takes it."""
        r2 = (0.5 * self.diagonal_size) ** 2
        return 0.25 * self.mass * r2, 0.25 * self.mass * r2, 0.5 * self.mass * r2

    @property
    def rotor_radius(self) -> float:
        """Of one rotor, m."""
        return float(np.sqrt(self.disc_area / (self.num_motors * np.pi)))

    def mass_over(self, t: Array) -> Array:
        """(n,) mass at times since the start of the flight, kg; a payload goes within 0.1 s."""
        left = np.clip((self.payload_until - t) / 0.1, 0.0, 1.0)
        out: Array = self.mass + self.payload * left**2 * (3.0 - 2.0 * left)
        return out
