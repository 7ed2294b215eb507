"""The autopilot's own accelerometer model: parameter names and their algebra.

ArduPilot applies ``f_b = R_bs diag(scale) (raw - offset)`` (AP_InertialSensor), so that the
scale and offset estimated against raw units *are* the parameters.

The estimator's unknowns are ``scale`` and ``beta = -scale * offset`` instead, because
``f_s = scale * raw + beta`` is linear in them.  The conversion between the two pairs is here, and
nowhere else: :func:`linear_of`, :func:`parameters_of` and :func:`parameters_jacobian`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Vector3

AXES = ("X", "Y", "Z")


@dataclass(frozen=True, slots=True)
class ParameterNames:
    """Names of the parameters of one accelerometer and of the gyroscope of the same number.

    ``correction`` is what names of its correction for temperature begin with, ``reference`` the
    temperature that it corrects towards.
    """

    scale: tuple[str, str, str]
    offset: tuple[str, str, str]
    device_id: str
    gyro_id: str
    correction: str
    reference: str

    @property
    def six(self) -> tuple[str, ...]:
        """Scale x, y, z, then offset x, y, z: the order of every six-vector here."""
        return self.scale + self.offset


@cache
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
        correction, reference = f"INS_TCAL{imu}_", f"INS_ACC{imu}_CALTEMP"
    else:
        scale, offset, device = f"INS{imu}_ACCSCAL_", f"INS{imu}_ACCOFFS_", f"INS{imu}_ACC_ID"
        correction, reference = f"INS{imu}_TCAL_", f"INS{imu}_ACC_CALTEMP"
    x, y, z = AXES
    return ParameterNames(
        scale=(scale + x, scale + y, scale + z),
        offset=(offset + x, offset + y, offset + z),
        device_id=device,
        gyro_id=device.replace("ACC", "GYR"),
        correction=correction,
        reference=reference,
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

    def as_linear(self) -> NDArray[np.float64]:
        """(6,) ``scale`` (1) and ``beta = -scale * offset`` (m/s^2), sensor axes."""
        return linear_of(self.as_vector())


def linear_of(parameters: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scale and offset to the estimator's linear unknowns.

    Args:
        parameters: (6,) scale x, y, z (1), offset x, y, z (m/s^2), sensor axes.

    Returns:
        (6,) scale x, y, z (1), ``beta = -scale * offset`` (m/s^2).
    """
    scale, offset = parameters[:3], parameters[3:6]
    return np.concatenate([scale, -scale * offset])


def parameters_of(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of :func:`linear_of`: what a solution means as parameters.

    Args:
        linear: (6,) or more; scale (1) and beta (m/s^2) come first.

    Returns:
        (6,) scale (1) and ``offset = -beta / scale`` (m/s^2).
    """
    scale, beta = linear[:3], linear[3:6]
    return np.concatenate([scale, -beta / scale])


def parameters_jacobian(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Derivative of :func:`parameters_of`, for covariances.

    Args:
        linear: (6,) or more; scale (1) and beta (m/s^2) come first.

    Returns:
        (6, 6) ``d(scale, offset) / d(scale, beta)``.
    """
    scale, beta = linear[:3], linear[3:6]
    J = np.zeros((6, 6))
    J[range(3), range(3)] = 1.0
    J[range(3, 6), range(3)] = beta / scale**2
    J[range(3, 6), range(3, 6)] = -1.0 / scale
    return J
