"""What really happens: the motion of a rigid body on a 1 kHz grid, and its specific force."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from sitl.builtin import rotation
from sitl.builtin.airframe.outputs import Outputs
from sitl.builtin.smoothing import DT, RATE, Array, derivative

STANDARD_GRAVITY = 9.80665
"""What ArduPilot's filters assume everywhere on earth, m/s^2."""

EARTH_RATE = 7.292115e-5
"""Rotation of the earth, rad/s (WGS 84)."""

EARTH_RADIUS = 6_371_000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Environment:
    """Where it flies: home on the earth, gravity, wind (NED, m/s, constant)."""

    latitude_deg: float = -35.3632621
    longitude_deg: float = 149.1652374
    altitude: float = 584.0
    gravity: float = STANDARD_GRAVITY
    wind_n: tuple[float, float, float] = (2.0, -1.0, 0.0)


@dataclass(frozen=True, slots=True)
class Start:
    """State at the start of a piece of trajectory: parked at a place, nose somewhere."""

    position_n: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw: float = 0.0


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Motion of the body's reference point; arrays have one row per millisecond.

    ``R_nb`` (n, 3, 3), ``w_b`` (n, 3) angular rate against inertial space, rad/s;
    ``v_n``, ``p_n`` (n, 3) velocity over ground and position from home, NED; ``f_b`` (n, 3)
    specific force of the reference point; ``throttle`` 0 ... 1; ``airspeed`` m/s;
    ``landed`` and ``armed`` flags.  ``outputs`` are those of a vehicle with an airframe.
    """

    R_nb: Array
    w_b: Array
    v_n: Array
    p_n: Array
    f_b: Array
    throttle: Array
    airspeed: Array
    armed: np.ndarray[tuple[int], np.dtype[np.bool_]]
    landed: np.ndarray[tuple[int], np.dtype[np.bool_]]
    environment: Environment
    outputs: Outputs | None = None

    @property
    def n(self) -> int:
        """Number of samples."""
        return len(self.throttle)

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self.n * DT

    def first(self, n: int) -> Trajectory:
        """The first ``n`` samples."""
        arrays = (f.name for f in fields(self) if f.name not in ("environment", "outputs"))
        outputs = None if self.outputs is None else self.outputs.first(n)
        return replace(self, outputs=outputs, **{name: getattr(self, name)[:n] for name in arrays})

    def unwritable(self) -> Trajectory:
        """Itself, to be shared: who writes to an array gets a ValueError."""
        for f in fields(self):
            x = getattr(self, f.name)
            if isinstance(x, np.ndarray):
                x.flags.writeable = False
        return self

    @property
    def end(self) -> Start:
        """Where the next piece starts."""
        north, east, down = (float(x) for x in self.p_n[-1])
        yaw = float(np.arctan2(self.R_nb[-1, 1, 0], self.R_nb[-1, 0, 0]))
        return Start((north, east, down), yaw)


def earth_rate_n(environment: Environment) -> Array:
    """Rotation of the earth in NED at home, (3,) rad/s."""
    latitude = np.radians(environment.latitude_deg)
    return EARTH_RATE * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])


def transport_rate_n(v_n: Array, environment: Environment) -> Array:
    """Rotation of the NED frame as it is carried over a round earth, (n, 3) rad/s."""
    tangent = np.tan(np.radians(environment.latitude_deg))
    rate = np.zeros_like(v_n)
    rate[:, 0] = v_n[:, 1]
    rate[:, 1] = -v_n[:, 0]
    rate[:, 2] = -v_n[:, 1] * tangent
    return rate / EARTH_RADIUS


def specific_force_n(v_n: Array, environment: Environment) -> Array:
    """``f_n = dv/dt + (2 w_ie + w_en) x v - g`` (Groves 2013, eq. 5.53), (n, 3) m/s^2."""
    turning = 2.0 * earth_rate_n(environment) + transport_rate_n(v_n, environment)
    f_n = derivative(v_n) + rotation.crossed(turning, v_n)
    f_n[:, 2] -= environment.gravity
    return f_n


def body_rate(R_nb: Array, v_n: Array, environment: Environment) -> Array:
    """Angular rate against inertial space from ``R^T dR/dt`` and the earth's, (n, 3) rad/s."""
    R = np.ascontiguousarray(np.moveaxis(R_nb, 0, -1))  # element by element: quick to go through
    dR = [[derivative(x) for x in row] for row in R]

    def omega(i: int, k: int) -> Array:
        out: Array = R[0, i] * dR[0][k] + R[1, i] * dR[1][k] + R[2, i] * dR[2][k]
        return out

    w_b = 0.5 * np.column_stack(
        [omega(2, 1) - omega(1, 2), omega(0, 2) - omega(2, 0), omega(1, 0) - omega(0, 1)]
    )
    carried = earth_rate_n(environment) + transport_rate_n(v_n, environment)
    return w_b + rotation.rotate_back(R_nb, carried)


def whole_samples(seconds: float) -> int:
    """Samples of about so many seconds, a whole number of attitude-filter steps of 40 ms."""
    step = RATE // 25
    return max(1, int(seconds * RATE + step // 2) // step) * step


def envelope(n: int, begin_s: float, end_s: float, ramp_s: float) -> Array:
    """(n,) 0 on the ground, 1 aloft, three times differentiable in between."""
    t = np.arange(n) * DT
    rise = np.clip((t - begin_s) / ramp_s, 0.0, 1.0)
    fall = np.clip((end_s - t) / ramp_s, 0.0, 1.0)
    x = np.minimum(rise, fall)
    out: Array = x**4 * (35.0 - 84.0 * x + 70.0 * x**2 - 20.0 * x**3)
    return out


def parked(start: Start, seconds: float, environment: Environment) -> Trajectory:
    """Standing still, level, disarmed."""
    n = whole_samples(seconds)
    zero = np.zeros((n, 3))
    R = np.broadcast_to(rotation.about_z(np.array([start.yaw]))[0], (n, 3, 3))
    return Trajectory(
        R_nb=R,
        w_b=rotation.rotate_back(R, np.broadcast_to(earth_rate_n(environment), (n, 3))),
        v_n=zero,
        p_n=np.broadcast_to(np.array(start.position_n), (n, 3)),
        f_b=np.broadcast_to(np.array([0.0, 0.0, -environment.gravity]), (n, 3)),
        throttle=np.zeros(n),
        airspeed=np.zeros(n),
        armed=np.zeros(n, dtype=np.bool_),
        landed=np.ones(n, dtype=np.bool_),
        environment=environment,
    )
