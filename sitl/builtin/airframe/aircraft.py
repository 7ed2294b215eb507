"""A vehicle with an airframe of its own, and the air that it flies in."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from sitl.builtin.airframe.air import Air
from sitl.builtin.airframe.flight import Craft, flown, idle
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.airframe.mission import mission
from sitl.builtin.airframe.motion import Motion
from sitl.builtin.params import Kind, Parameter
from sitl.builtin.plane import PlaneFlight, plane_trajectory
from sitl.builtin.trajectory import Environment, Start, Trajectory, envelope, parked

MOTOR_1 = 33
"""SERVOn_FUNCTION of the first motor."""
PLANE_FUNCTIONS = (4, 19, 70, 21)
"""Aileron, elevator, throttle, rudder."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Aircraft:
    """What flies, where.

    Attributes:
        craft: a multicopter's airframe or a plane's coefficients.
        air: wind and density.
        fastest: speed over ground of a multicopter's fastest legs, m/s.
        motion: what it is told to fly; a mission by chance of the seed without.
    """

    craft: Craft = field(default_factory=Airframe)
    air: Air = field(default_factory=Air)
    fastest: float = 11.0
    motion: Motion | None = None

    def fly(
        self,
        environment: Environment,
        start: Start,
        *,
        seed: int,
        duration: float,
        dull: bool = False,
        stop_at: float | None = None,
    ) -> Trajectory:
        """A flight, ground to ground; the arguments are those of every simulated flight."""
        motion = self.motion
        if motion is not None:
            motion = replace(motion, start=start)
        elif isinstance(self.craft, Airframe):
            motion = mission(
                seed, duration, start, fastest=self.fastest, stop_at=stop_at, dull=dull
            )
        else:
            flight = PlaneFlight(seed=seed, duration=duration, dull=dull, stop_at=stop_at)
            motion = self._plane(flight, environment, start)
        return flown(motion, self.craft, self.air, environment)

    def _plane(self, flight: PlaneFlight, environment: Environment, start: Start) -> Motion:
        wind = (self.air.north, self.air.east, 0.0)
        base = plane_trajectory(flight, replace(environment, wind_n=wind), start)
        flying = np.flatnonzero(~base.landed) / 1000.0
        aloft = envelope(base.n, flying[0] + 1.0, flying[-1] - 0.999, 3.0)
        return Motion.of_plane(base, np.outer(aloft, wind), start)

    def stand(
        self, environment: Environment, start: Start, seconds: float, consumed: float
    ) -> Trajectory:
        """Standing still, disarmed, after it has used so many mAh."""
        still = parked(start, seconds, environment)
        altitude = environment.altitude - start.position_n[2]
        return replace(still, outputs=idle(self.craft, still.n, altitude, consumed))

    def parameters(self) -> list[Parameter]:
        """What the autopilot of such a vehicle is configured to, ArduPilot's defaults."""
        if isinstance(self.craft, Airframe):
            out = _copter_parameters(self.craft.num_motors)
        else:
            out = _plane_parameters()
        capacity = self.craft.battCapacityAh if isinstance(self.craft, Airframe) else 0.0
        out.append(Parameter("BATT_MONITOR", 4, Kind.INT8))
        out.append(Parameter("BATT_CAPACITY", round(1000.0 * capacity) or 3300, Kind.INT32))
        return out


def _servos(functions: tuple[int, ...]) -> list[Parameter]:
    out = []
    for i, function in enumerate(functions, start=1):
        out.append(Parameter(f"SERVO{i}_FUNCTION", function, Kind.INT16))
        out.append(Parameter(f"SERVO{i}_MIN", 1000, Kind.INT16))
        out.append(Parameter(f"SERVO{i}_MAX", 2000, Kind.INT16))
        out.append(Parameter(f"SERVO{i}_TRIM", 1500, Kind.INT16))
        out.append(Parameter(f"SERVO{i}_REVERSED", 0, Kind.INT8))
    return out


def _copter_parameters(num_motors: int) -> list[Parameter]:
    return [
        Parameter("FRAME_CLASS", {4: 1, 6: 2, 8: 3}.get(num_motors, 1), Kind.INT8),
        Parameter("FRAME_TYPE", 1, Kind.INT8),
        Parameter("MOT_SPIN_ARM", 0.1),
        Parameter("MOT_SPIN_MIN", 0.15),
        Parameter("MOT_SPIN_MAX", 0.95),
        Parameter("MOT_THST_EXPO", 0.65),
        Parameter("MOT_THST_HOVER", 0.39),
        Parameter("MOT_PWM_MIN", 1000, Kind.INT16),
        Parameter("MOT_PWM_MAX", 2000, Kind.INT16),
        Parameter("MOT_PWM_TYPE", 0, Kind.INT8),
        Parameter("MOT_BAT_VOLT_MAX", 0.0),
        Parameter("MOT_BAT_VOLT_MIN", 0.0),
        Parameter("EK3_DRAG_MCOEF", 0.0),
        Parameter("EK3_DRAG_BCOEF_X", 0.0),
        Parameter("EK3_DRAG_BCOEF_Y", 0.0),
        *_servos(tuple(MOTOR_1 + i for i in range(num_motors))),
    ]


def _plane_parameters() -> list[Parameter]:
    return [
        Parameter("ARSPD_TYPE", 2, Kind.INT8),
        Parameter("ARSPD_USE", 1, Kind.INT8),
        Parameter("ARSPD_RATIO", 2.0),
        Parameter("TRIM_THROTTLE", 45, Kind.INT8),
        *_servos(PLANE_FUNCTIONS),
    ]
