"""Attitude as it was reported: a third of the matrices that it stands for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array, Vector3
from onboard.core.maths.frames import (
    untrimmed_rotation,
    untrimmed_rotation_dcm,
    untrimmed_rotation_quaternion,
)

DCM_GAIN: Final = 0.2
"""1/s: AHRS_RP_P and AHRS_YAW_P where nobody has set them [physics]."""


@dataclass(frozen=True, slots=True)
class ReportedAttitude:
    """Angles of an autopilot: of some of them, as of an array, the matrices are made when asked.

    Attributes:
        angles: (k, 3) roll, pitch, yaw as reported, rad.
        trim: the autopilot's, rad.
        pitch_trim: see :func:`~onboard.core.maths.frames.untrimmed_rotation`.
        dcm_gain: AHRS_RP_P, 1/s, where DCM reports it; None: an EKF does.
        turned: whether the trim was taken off by turning the body; no pitch trim is, then.
    """

    angles: Array
    trim: Vector3
    pitch_trim: float = 0.0
    dcm_gain: float | None = None
    turned: bool = False

    def __len__(self) -> int:
        return len(self.angles)

    def __getitem__(self, some: slice | NDArray[np.bool_]) -> Array:
        """(j, 3, 3) body axes of the accelerometer to NED of those chosen."""
        roll, pitch, yaw = self.angles[some].T
        if self.turned:
            return untrimmed_rotation_quaternion(roll, pitch, yaw, self.trim)
        if self.dcm_gain is not None:
            return untrimmed_rotation_dcm(roll, pitch, yaw, self.trim)
        return untrimmed_rotation(roll, pitch, yaw, self.trim, self.pitch_trim)


Attitudes: TypeAlias = Array | ReportedAttitude
"""Rotations (k, 3, 3), or what they are made of when some of them are asked for."""
