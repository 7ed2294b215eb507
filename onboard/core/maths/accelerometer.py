"""The autopilot's own accelerometer model: parameter names and their algebra.

ArduPilot applies ``f_b = R_bs diag(scale) (raw - offset)`` (AP_InertialSensor), so that the
scale and offset estimated against raw units *are* the parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Vector3

AXES = ("X", "Y", "Z")


@dataclass(frozen=True, slots=True)
class ParameterNames:
    """Names of the parameters of one accelerometer and of the gyroscope of the same number."""

    scale: tuple[str, str, str]
    offset: tuple[str, str, str]
    device_id: str
    gyro_id: str

    @property
    def six(self) -> tuple[str, ...]:
        """Scale x, y, z, then offset x, y, z: the order of every six-vector here."""
        return self.scale + self.offset


def parameter_names(imu: int) -> ParameterNames:
    """Names for accelerometer 1 ... 5.

    Raises:
        ValueError: ``imu`` is not 1 ... 5.
    """
    if not 1 <= imu <= 5:
        raise ValueError(f"ArduPilot has accelerometers 1 to 5, not {imu}")
    if imu <= 3:
        n = "" if imu == 1 else str(imu)
        scale, offset, device = f"INS_ACC{n}SCAL_", f"INS_ACC{n}OFFS_", f"INS_ACC{n}_ID"
    else:
        scale, offset, device = f"INS{imu}_ACCSCAL_", f"INS{imu}_ACCOFFS_", f"INS{imu}_ACC_ID"
    x, y, z = AXES
    return ParameterNames(
        scale=(scale + x, scale + y, scale + z),
        offset=(offset + x, offset + y, offset + z),
        device_id=device,
        gyro_id=device.replace("ACC", "GYR"),
    )


@dataclass(frozen=True, slots=True)
class SixParameters:
    """Scale and offset of one accelerometer, sensor axes: ``f = scale * (raw - offset)``."""

    scale: Vector3 = (1.0, 1.0, 1.0)
    offset: Vector3 = (0.0, 0.0, 0.0)

    def as_vector(self) -> NDArray[np.float64]:
        """(6,) scale x, y, z, offset x, y, z."""
        return np.array(self.scale + self.offset, dtype=np.float64)

    def apply(self, raw_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Raw sensor reading (..., 3) to specific force, both in sensor axes, m/s^2."""
        return np.array(self.scale, np.float64) * (raw_s - np.array(self.offset, np.float64))

    def undo(self, f_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Inverse of :meth:`apply`."""
        return f_s / np.array(self.scale, np.float64) + np.array(self.offset, np.float64)
