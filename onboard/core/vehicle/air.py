"""A prediction in the making: the flight as the effects see it, one acting after the other."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import cross
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.gusts import signed_square

AHEAD, SIDE, UP = 0, 1, 2
"""Axes of the body: x, y, z."""


def speed_of(u_b: Array) -> Array:
    """(n,) length of each of these (n, 2 or 3)."""
    # Sums along an axis of three are several times as slow, and the same to the last bit.
    square = u_b[:, 0] * u_b[:, 0]
    for k in range(1, u_b.shape[1]):
        square = square + u_b[:, k] * u_b[:, k]
    out: Array = np.sqrt(square)
    return out


class Air:
    """What effects read and change on the way from a flight to a predicted force.

    Attributes:
        flight: what was recorded.
        wind_n: (n, 3) towards north, east, down, m/s.
        gust_n: (3,) what is added to it to see how sensitive the force is, m/s.
        gust_variance: of the air along each axis, m^2/s^2; one, or (n,).
        shaken: (n,) mean square of a wing's force across the flow, by gusts within the steps,
            m^2/s^4.
        turned_n: (n, 3) by which the recorded attitude is turned too far, about north, east and
            down, rad; None where it is right.
        through: (n,) flow through the rotors beside that of the velocity through the air, m/s.
        tilt: of the thrust forward and to the right, rad.
        rho: (n,) density, kg/m^3.
        mass: (n,) over that at the start of the flight, or one.
        commands: (n, 3) of a copter's motors, 0 to 1: mean, mean square, and evenness; (n, 4) of a
            plane: throttle, rudder, elevator, flap.  None where they were not recorded.
        volts: (n,) of the battery; None where it was not recorded.
        power: (n,) mean over the motors of the thrust's share of the largest; by thrust_curve.
        thrust: (n,) specific force of the rotors, or of a plane's propeller at a standstill, from
            the commands, m/s^2; None without commands.
        pull: (n,) specific force of the rotors from the accelerometer and z drag, m/s^2.
        force_b: (n, 3 or 4) predicted specific force, m/s^2, and airspeed where there is one, m/s.
        alpha, pressure, lift: (n,) of a plane: angle of attack (rad), specific force by coefficient
            (m/s^2), coefficient of lift.
        scatter, slope: (n,) mean square of what gusts within the steps add to alpha, rad^2, and the
            slope of the lift, 1/rad.
    """

    def __init__(self, flight: Flight, volts: Array | None = None, columns: int = 3) -> None:
        """Begin with standard air, still or in the wind that was measured, and no force."""
        n = len(flight)
        self.flight = flight
        self.wind_n = np.zeros((n, 3))
        if flight.measured_wind.shape[1]:
            self.wind_n[:, :2] += np.nan_to_num(flight.measured_wind[:, :2])
        self.gust_n = np.zeros(3)
        self.gust_variance: Array | float = 0.0
        self.shaken: Array | float = 0.0
        self.turned_n: Array | None = None
        self.through: Array | float = 0.0
        self.tilt = (0.0, 0.0)
        self.rho = flight.rho
        self.mass: Array | float = 1.0
        self.commands: Array | None = flight.commands if flight.commands.shape[1] else None
        self.volts = volts
        self.power: Array | None = None
        self.thrust: Array | None = None
        self.pull = np.zeros(n)
        self.force_b = np.zeros((n, columns))
        self.alpha = self.pressure = self.lift = self.scatter = np.zeros(n)
        self.slope = 0.0
        self._u_b: Array | None = None
        self._square_b: Array | None = None
        self._by_flow: dict[Callable[[Array], Array], Array] = {}

    def copied(self) -> Air:
        """The same, to go on from in another way."""
        out = copy(self)
        out.force_b, out.wind_n = self.force_b.copy(), self.wind_n.copy()
        return out

    @property
    def evenness(self) -> Array | float:
        """(n,) mean root of the motors' thrusts over the root of the mean: 1 where all are one."""
        return 1.0 if self.commands is None else self.commands[:, 2]

    @property
    def u_b(self) -> Array:
        """(n, 3) velocity through the air, body axes, m/s; fixed when it is first asked for."""
        if self._u_b is None:
            moved = np.einsum("nij,nj->ni", self.flight.R_bn, self.wind_n + self.gust_n)
            self._u_b = self.flight.v_b - moved
            if self.turned_n is not None:
                about = np.einsum("nij,nj->ni", self.flight.R_bn, self.turned_n)
                self._u_b = self._u_b + cross(about, self._u_b)
            # Copies from here on have the same flow, and what was made of it; those before do not.
            self._by_flow = {}
        return self._u_b

    def by_flow(self, law: Callable[[Array], Array]) -> Array:
        """(n, ...) what a law makes of ``u_b``, once: a fit tries the others in the same flow."""
        u_b = self.u_b
        if law not in self._by_flow:
            self._by_flow[law] = law(u_b)
        return self._by_flow[law]

    @property
    def square_b(self) -> Array:
        """(n, 3) mean of ``|u| u`` in gusty air, by axis, m^2/s^2; fixed as ``u_b`` is."""
        if self._square_b is None:
            variance = np.reshape(self.gust_variance, (-1, 1))
            self._square_b = signed_square(self.u_b, variance)
        return self._square_b

    @property
    def square_through(self) -> Array:
        """(n,) the same of what comes through the rotors from above."""
        if isinstance(self.through, float) and self.through == 0.0:
            return -self.square_b[:, 2]
        return signed_square(-self.u_b[:, 2] - self.through, self.gust_variance)
