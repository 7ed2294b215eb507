"""What the actuators and the battery of a vehicle do while it flies: one row per millisecond."""

from __future__ import annotations

from dataclasses import dataclass, fields

from sitl.builtin.smoothing import Array


@dataclass(frozen=True, slots=True)
class Outputs:
    """Actuators, battery and air of a flight, n rows at 1 kHz.

    Attributes:
        pwm: (n, k) output of each servo rail from the first on, us.
        voltage: (n,) at the battery's terminals, V.
        current: (n,) out of the battery, A.
        consumed: (n,) charge since power-on, mAh.
        indicated: (n,) airspeed that the autopilot tells, m/s.
        told_wind: (n, 2) wind north and east that the autopilot believes in, m/s.
        wind_n: (n, 3) true wind at the vehicle, where the air goes to, NED, m/s.
        density: (n,) of the air, kg/m^3.
        mass: (n,) of the vehicle, kg.
        thrust_b: (n, 3) force of the motors, body axes, N.
        drag_b: (n, 3) force of the air on everything else, body axes, N.
    """

    pwm: Array
    voltage: Array
    current: Array
    consumed: Array
    indicated: Array
    told_wind: Array
    wind_n: Array
    density: Array
    mass: Array
    thrust_b: Array
    drag_b: Array

    def first(self, n: int) -> Outputs:
        """The first ``n`` rows."""
        return Outputs(*(getattr(self, f.name)[:n] for f in fields(self)))
