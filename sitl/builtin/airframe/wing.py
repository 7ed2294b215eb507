"""A fixed-wing aircraft with linear coefficients, in the keys of ArduPilot's plane files.

In wind axes lift is ``q S (c_lift_0 + c_lift_a alpha)``, drag ``q S (c_drag_p + C_L^2 / (pi e
AR))``; side force along body y ``q S (c_y_0 + c_y_b beta + c_y_deltar rudder)``; thrust along body
x.  alpha and beta are ``atan2(w, u)`` and ``atan2(v, u)``, q is ``rho V^2 / 2`` of true airspeed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from sitl.builtin.airframe.air import GRAVITY
from sitl.builtin.smoothing import Array

OWN_KEYS = ("mass", "hover_throttle", "airspeed_ratio", "payload", "payload_until")
"""Fields that no coefficient file of ArduPilot's has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wing:
    """One plane; names and defaults are those of ArduPilot's coefficient files.

    Attributes:
        CGOffset: from the centre of mass to where the air's force attacks, body axes, m.
        mass: kg.
        hover_throttle: at which thrust is weight.
        airspeed_ratio: ARSPD_RATIO that would be right for its airspeed sensor.
        payload: what is carried on top of ``mass`` until ``payload_until``, kg.
        payload_until: s since the start of the flight.
    """

    s: float = 0.45
    b: float = 1.88
    c: float = 0.24
    c_lift_0: float = 0.56
    c_lift_a: float = 6.9
    oswald: float = 0.9
    c_drag_p: float = 0.1
    c_y_0: float = 0.0
    c_y_b: float = -0.98
    c_y_deltar: float = -0.2
    c_l_b: float = -0.12
    c_l_p: float = -1.0
    c_l_r: float = 0.14
    c_l_deltaa: float = 0.25
    c_m_0: float = 0.045
    c_m_a: float = -0.7
    c_m_q: float = -20.0
    c_m_deltae: float = 1.0
    c_n_b: float = 0.25
    c_n_p: float = 0.022
    c_n_r: float = -1.0
    c_n_deltar: float = 0.1
    CGOffset: tuple[float, float, float] = (-0.15, 0.0, -0.05)
    mass: float = 2.0
    hover_throttle: float = 0.7
    airspeed_ratio: float = 2.0
    payload: float = 0.0
    payload_until: float = 0.0

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Wing:
        """Of a coefficient file's object; keys that are not known here are left out."""
        known = {f.name for f in fields(cls)}
        chosen: dict[str, Any] = {
            k: float(v) for k, v in values.items() if k in known and k != "CGOffset"
        }
        if "CGOffset" in values:
            chosen["CGOffset"] = tuple(float(x) for x in values["CGOffset"])
        return cls(**chosen)

    @classmethod
    def load(cls, path: str | Path) -> Wing:
        """A coefficient file."""
        return cls.from_dict(json.loads(Path(path).read_text(encoding="utf-8")))

    def as_dict(self) -> dict[str, Any]:
        """The object of a coefficient file."""
        nominal = {f.name: f.default for f in fields(self)}
        return {k: v for k, v in asdict(self).items() if k not in OWN_KEYS or v != nominal[k]}

    def save(self, path: str | Path) -> None:
        """Writes a coefficient file that ArduPilot's SITL loads."""
        text = json.dumps(self.as_dict(), indent=1, sort_keys=True)
        Path(path).write_text(text + "\n", encoding="utf-8")

    @property
    def aspect(self) -> float:
        """Span squared over area."""
        return self.b**2 / self.s

    @property
    def full_thrust(self) -> float:
        """At full throttle, N."""
        return self.mass * GRAVITY / self.hover_throttle

    def coefficients(self, alpha: Array) -> tuple[Array, Array]:
        """Lift and drag coefficient at (n,) angles of attack, rad."""
        lift = self.c_lift_0 + self.c_lift_a * alpha
        return lift, self.c_drag_p + lift**2 / (np.pi * self.oswald * self.aspect)

    def force(self, alpha: Array, beta: Array, rudder: Array, pressure: Array) -> Array:
        """(n, 3) force of the air, body axes, N.

        Args:
            alpha: (n,) angle of attack, rad.
            beta: (n,) sideslip, rad.
            rudder: (n,) -1 ... 1.
            pressure: (n,) dynamic pressure, Pa.
        """
        lift, drag = self.coefficients(alpha)
        along = -drag * np.cos(alpha) + lift * np.sin(alpha)
        down = -drag * np.sin(alpha) - lift * np.cos(alpha)
        side = self.c_y_0 + self.c_y_b * beta + self.c_y_deltar * rudder
        out: Array = (pressure * self.s)[:, None] * np.column_stack([along, side, down])
        return out

    @property
    def yaw_stiffness(self) -> float:
        """Yawing moment per rad of sideslip, with what the side force does about the mass."""
        return self.c_n_b + self.CGOffset[0] / self.b * self.c_y_b

    @property
    def rudder_power(self) -> float:
        """Yawing moment of the whole rudder, with what its side force does about the mass."""
        return self.c_n_deltar + self.CGOffset[0] / self.b * self.c_y_deltar

    def held_slip(self, slip: Array, yaw_rate: Array, speed: Array) -> tuple[Array, Array]:
        """(n,) sideslip, rad, as much of the wanted as the rudder can hold, and (n,) that rudder.

        Args:
            slip: (n,) wanted, rad.
            yaw_rate: (n,) rad/s.
            speed: (n,) through the air, m/s.
        """
        damping = self.c_n_r * self.b * yaw_rate / (2.0 * speed)
        rudder = np.clip(-(self.yaw_stiffness * slip + damping) / self.rudder_power, -1.0, 1.0)
        return -(self.rudder_power * rudder + damping) / self.yaw_stiffness, rudder

    def elevator_for(self, alpha: Array, pitch_rate: Array, speed: Array) -> Array:
        """(n,) elevator, -1 ... 1, at which an angle of attack is steady."""
        x, _, z = self.CGOffset
        lift, drag = self.coefficients(alpha)
        moment = self.c_m_0 + self.c_m_a * alpha
        moment = moment + self.c_m_q * self.c * pitch_rate / (2.0 * speed)
        moment = moment + (x * lift - z * drag) / self.c  # small angles: lift is up, drag is back
        return np.clip(-moment / self.c_m_deltae, -1.0, 1.0)

    def aileron_for(self, beta: Array, rates: Array, speed: Array) -> Array:
        """(n,) aileron, -1 ... 1, at which roll and yaw rates are steady; ``rates`` (n, 3)."""
        span = self.b / (2.0 * speed)
        moment = self.c_l_b * beta + span * (self.c_l_p * rates[:, 0] + self.c_l_r * rates[:, 2])
        return np.clip(-moment / self.c_l_deltaa, -1.0, 1.0)

    def mass_over(self, t: Array) -> Array:
        """(n,) mass at times since the start of the flight, kg; a payload goes within 0.1 s."""
        left = np.clip((self.payload_until - t) / 0.1, 0.0, 1.0)
        return self.mass + self.payload * left**2 * (3.0 - 2.0 * left)
