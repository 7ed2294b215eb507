"""What the simulated hardware is really like: the numbers that a calibration has to find."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np

from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.effects import Effect, Vector3
from sitl.builtin.trajectory import Environment

BOARD = "2a0045000b51383437363138000000000000"
"""Unique id of the simulated board, hex: 96 bits as an STM32 has them, in a field of 144."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuTruth:
    """One inertial sensor.

    The sensor gives ``raw = f / scale + offset``, so that the right INS_ACCSCAL and
    INS_ACCOFFS are exactly ``scale`` and ``offset`` (m/s^2).  Noise densities are one-sided,
    m/s^2/sqrt(Hz) and rad/s/sqrt(Hz); ``bias_walk`` is in m/s^2/sqrt(s).  ``vibration`` is the
    amplitude of the motor tone per axis at hover or cruise throttle (m/s^2),
    ``vibration_hz`` its frequency there; tones beyond 500 Hz fold into the 1 kHz samples by
    themselves.  ``gyro_scale`` is the relative error of the gyroscope, ``gyro_turn`` the
    small rotation, rad, by which its axes are turned against those of the accelerometer.
    """

    scale: Vector3 = (1.0, 1.0, 1.0)
    offset: Vector3 = (0.0, 0.0, 0.0)
    accel_noise: float = 1.5e-3
    bias_walk: float = 1.0e-4
    vibration: Vector3 = (0.6, 0.6, 0.9)
    vibration_hz: float = 130.0
    broadband: float = 0.25
    gyro_noise: float = 1.0e-4
    gyro_bias: Vector3 = (0.002, -0.001, 0.0015)
    gyro_walk: float = 1.5e-5
    gyro_scale: Vector3 = (0.004, -0.004, 0.003)
    gyro_turn: Vector3 = (0.0, 0.0, 0.0)
    position: Vector3 = (0.0, 0.0, 0.0)
    temperature_start: float = 25.0
    temperature_end: float = 45.0
    temperature_time: float = 180.0


Response: TypeAlias = Literal["mean", "filter", "two moments"]


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsTruth:
    """The receiver: how late, how noisy, where its antenna is.

    ``delay`` is the mean time from validity of a fix to its arrival; the autopilot stamps a
    fix ``stamped_early`` before its arrival, as ArduPilot does when it takes the transport
    time off.  What it reports is spread in time as a mean over ``smoothing``, s, in the shape of
    its ``response``: that mean, a filter of first order, or two moments.  Noise: white and
    first-order coloured, per axis; ``vertical`` multiplies both.
    """

    rate: float = 5.0
    delay: float = 0.14
    stamped_early: float = 0.02
    jitter: float = 0.008
    smoothing: float = 0.0
    response: Response = "mean"
    antenna: Vector3 = (0.0, 0.0, 0.0)
    velocity_noise: float = 0.03
    velocity_coloured: float = 0.03
    velocity_time: float = 15.0
    position_noise: float = 0.02
    position_coloured: float = 0.5
    position_time: float = 100.0
    vertical: float = 1.5
    losses: tuple[tuple[float, float], ...] = ()
    glitches: tuple[tuple[float, float, float, float], ...] = ()
    jamming: tuple[tuple[float, float], ...] = ()

    @property
    def net_delay(self) -> float:
        """How late GPS_RAW_INT's stamp is, s."""
        return self.delay - self.stamped_early


@dataclass(frozen=True, slots=True, kw_only=True)
class CompassTruth:
    """Error of the magnetic heading: constant, with the heading, slowly wandering (rad)."""

    constant: float = 0.0
    per_heading: float = 0.006
    wandering: float = 0.004
    wandering_time: float = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """Everything that is true; ``attitude_errors=False`` reports the true attitude.

    ``board`` is the unique id that AUTOPILOT_VERSION tells, in hex of 18 bytes at most; empty
    for a board that tells none.  ``aircraft`` gives the vehicle an airframe with physics of its
    own; without, it flies as it is told to.
    """

    imus: tuple[ImuTruth, ...] = (ImuTruth(),)
    gps: GpsTruth = field(default_factory=GpsTruth)
    compass: CompassTruth = field(default_factory=CompassTruth)
    environment: Environment = field(default_factory=Environment)
    effects: tuple[Effect, ...] = ()
    attitude_errors: bool = True
    orientation: int = 0
    board: str = BOARD
    seed: int = 0
    aircraft: Aircraft | None = None


def random_imus(seed: int, count: int = 1) -> tuple[ImuTruth, ...]:
    """Accelerometers that are clearly off: scales by 1.2 to 3.5 %, offsets by 0.12 to 0.34 m/s^2.

    Each number is off by more than an estimate may err, so that finding it says something; two
    such accelerometers still agree well enough for arming.
    """
    rng = np.random.default_rng([seed, 61])

    def off(low: float, high: float) -> Vector3:
        x, y, z = rng.uniform(low, high, 3) * rng.choice([-1.0, 1.0], 3)
        return (round(float(x), 4), round(float(y), 4), round(float(z), 4))

    def imu() -> ImuTruth:
        sx, sy, sz = off(0.012, 0.035)
        return ImuTruth(scale=(1.0 + sx, 1.0 + sy, 1.0 + sz), offset=off(0.12, 0.34))

    return tuple(imu() for _ in range(count))
