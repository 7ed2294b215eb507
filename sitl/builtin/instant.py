"""What the autopilot knows at one instant: the source of everything that a message carries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sitl.builtin import effects as fx
from sitl.builtin import rotation
from sitl.builtin.airframe.outputs import Outputs
from sitl.builtin.attitude import AttitudeFilter
from sitl.builtin.gps import Fix
from sitl.builtin.orientation import board_rotation
from sitl.builtin.params import ParameterStore
from sitl.builtin.sensors import Barometer
from sitl.builtin.smoothing import Array
from sitl.builtin.world import Piece, World

ACCEL_STEMS = ("INS_ACC", "INS_ACC2", "INS_ACC3")


class Corrections:
    """ArduPilot's ``f_b = R_bs diag(SCAL) (raw - OFFS)`` for every IMU.

    Boards sit at right angles: each body axis is one of the sensor's, or against it.
    """

    def __init__(self, parameters: ParameterStore, imus: int) -> None:
        R_bs = board_rotation(int(parameters["AHRS_ORIENTATION"]))
        along = np.argmax(np.abs(R_bs), axis=1).tolist()
        self._axes: list[list[tuple[int, float, float]]] = []
        for stem in ACCEL_STEMS[:imus]:
            scale, offset = parameters.vector(stem + "SCAL_"), parameters.vector(stem + "OFFS_")
            self._axes.append(
                [(j, float(R_bs[i, j]) * scale[j], offset[j]) for i, j in enumerate(along)]
            )
        self.trim = np.array(parameters.vector("AHRS_TRIM_"))

    def apply(self, imu: int, raw: Array) -> list[float]:
        """Raw sensor reading (3,) of IMU ``imu`` (from 0) to body axes, m/s^2."""
        read = raw.tolist()
        return [by * (read[j] - off) + 0.0 for j, by, off in self._axes[imu]]


@dataclass(slots=True)
class Instant:
    """A moment at which messages are sent; ``t_sample`` is the last sample the sensors gave.

    It is not written to; to freeze it would take three times as long, every few milliseconds.
    """

    t: float
    t_sample: float
    world: World
    piece: Piece
    row: int
    corrections: Corrections
    ahrs: AttitudeFilter
    barometer: Barometer
    fix: Fix | None
    fix_new: float
    armed: bool
    mode: int
    vehicle: str
    consumed_mah: float
    capacity_mah: float

    @property
    def milliseconds(self) -> int:
        """Boot time as ArduPilot's millis()."""
        return int(self.t * 1e3)

    @property
    def microseconds(self) -> int:
        """Boot time as ArduPilot's micros64()."""
        return int(self.t * 1e6)

    @property
    def landed(self) -> bool:
        """True on the ground."""
        return bool(self.piece.trajectory.landed[self.row])

    @property
    def throttle(self) -> float:
        """0 ... 1."""
        return float(self.piece.trajectory.throttle[self.row])

    @property
    def outputs(self) -> Outputs | None:
        """Actuators and battery of a vehicle with an airframe, all rows of the piece."""
        return self.piece.trajectory.outputs

    @property
    def imus(self) -> int:
        """Number of IMUs."""
        return len(self.piece.imus)

    def accel(self, imu: int) -> list[float]:
        """Corrected, filtered accelerometer, body, m/s^2."""
        return self.corrections.apply(imu, self.piece.imus[imu].filtered[self.row])

    def gyro(self, imu: int) -> Array:
        """Filtered gyroscope, body, rad/s."""
        out: Array = self.piece.imus[imu].gyro_filtered[self.row]
        return out

    def temperature(self, imu: int) -> float:
        """Temperature of an IMU, degrees Celsius."""
        return float(self.piece.imus[imu].temperature[self.row])

    def attitude(self) -> Array:
        """Estimated attitude with the concealed effects on it, less the trim: (3,) rad."""
        piece, row = self.piece, self.row
        late = sum(e.delay for e in self.world.truth.effects if isinstance(e, fx.ImuDelay))
        if late:
            piece = self.world.at(self.t_sample - late)
            row = piece.index(self.t_sample - late)
        R = piece.trajectory.R_nb[row]
        if self.world.truth.attitude_errors:
            R = rotation.one_from_vector(self.ahrs.phi) @ R
        yaw = 0.0
        for effect in self.world.truth.effects:
            match effect:
                case fx.BoardTilt(roll=roll, pitch=pitch):
                    R = R @ rotation.from_euler(*np.array([[roll], [pitch], [0.0]]))[0]
                case fx.MountTilt(roll=roll, pitch=pitch):
                    R = R @ rotation.one_from_vector(np.array([roll, pitch, 0.0]))
                case fx.HeadingError(yaw=error):
                    yaw += error
                case fx.HeadingByThrottle(yaw_per_throttle=error):
                    yaw += error * float(piece.trajectory.throttle[row])
                case _:
                    pass
        # Angle by angle, as EKF3 does (getEulerAngles); that is no rotation of the body.
        euler: Array = rotation.one_to_euler(R) - self.corrections.trim
        if yaw:
            euler[2] = (euler[2] + yaw + np.pi) % (2.0 * np.pi) - np.pi
        return euler

    def velocity(self) -> Array:
        """Estimated velocity, NED, m/s."""
        out: Array = self.piece.trajectory.v_n[self.row] + self.ahrs.velocity
        return out

    def position(self) -> Array:
        """Estimated position from home, NED, m."""
        out: Array = self.piece.trajectory.p_n[self.row] + self.ahrs.position
        return out
