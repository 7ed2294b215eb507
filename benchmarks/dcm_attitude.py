"""The attitude that ArduPilot's DCM would have reported in a recorded flight.

It goes through the samples of the first accelerometer and its gyroscope, and the fixes of the first
receiver, as AP_AHRS_DCM does (its drift correction, the compass that keeps the heading apart): of
ArduPilot's simulator, whose logs have DCM's own attitude beside the EKF's (AHR2), it is within 4 to
6 mrad of it on a copter and 10 to 16 on a plane that is flown hard, where DCM is 30 to 50 mrad off.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.samples import (
    FIX_3D,
    AttitudeSample,
    GpsFix,
    ImuSample,
    ParameterValue,
    Sample,
)
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import euler_from_rotation, rotation_from_euler, rotation_from_vector

Array = NDArray[np.float64]
CHOICE = "AHRS_EKF_TYPE"
PULL, HEADING_PULL, LEARNS = 0.2, 0.18, 0.0087
"""AHRS_RP_P and AHRS_YAW_P with its gain at rest, 1/s, and the integral's, 1/s^2."""
DRIFT_RAD_S2 = np.deg2rad(0.5 / 60.0)
"""By how much a gyroscope's bias may change."""


@dataclass(slots=True)
class Dcm:
    """Its state; ``R`` is None until an attitude is known to begin with."""

    R: Array | None = None
    bias: Array = field(default_factory=lambda: np.zeros(3))
    pull: Array = field(default_factory=lambda: np.zeros(3))
    learned: Array = field(default_factory=lambda: np.zeros(3))
    learning_s: float = 0.0
    gained: Array = field(default_factory=lambda: np.zeros(3))
    since_s: float = 0.0
    late: Array | None = None
    velocity: Array | None = None
    heading: float = 0.0
    w: Array = field(default_factory=lambda: np.zeros(3))
    t: float = np.nan

    def turn(self, s: ImuSample) -> None:
        """Take a sample; a gap is none of its time."""
        if s.w_b is None or self.R is None:
            return
        step = min(max(s.t - self.t, 0.0), 0.3) if np.isfinite(self.t) else 0.0
        self.t, self.w = s.t, np.array(s.w_b)
        self.R = self.R @ rotation_from_vector((self.w + self.bias + self.pull) * step)
        off = np.sin(self.heading - np.arctan2(self.R[1, 0], self.R[0, 0]))
        self.R = rotation_from_vector(np.array([0.0, 0.0, HEADING_PULL * off * step])) @ self.R
        self.gained = self.gained + self.R @ np.array(s.f_b) * step
        self.since_s += step

    def hear(self, v_n: Array) -> None:
        """Take the velocity of a fix: the force that was read before the last one is compared."""
        if self.R is None or self.since_s <= 0.0:
            return
        before, self.velocity = self.velocity, v_n
        asked = np.array([0.0, 0.0, -STANDARD_GRAVITY])
        if before is not None:
            asked = asked + (v_n - before) / self.since_s
        now = self.gained / np.linalg.norm(self.gained)
        read, self.late = (now if self.late is None else self.late), now
        apart = np.cross(read, asked / np.linalg.norm(asked))
        apart[2] *= abs(np.sin(np.arctan2(self.R[2, 1], self.R[2, 2])))
        body, spin = self.R.T @ apart, np.rad2deg(np.linalg.norm(self.w))
        self.pull = body * PULL * np.clip(spin / 50.0, 1.0, 10.0)
        if spin < 20.0:
            self.learned = self.learned + LEARNS * body * self.since_s
            self.learning_s += self.since_s
        if self.learning_s >= 5.0:
            most = DRIFT_RAD_S2 * self.learning_s
            self.bias = self.bias + np.clip(self.learned, -most, most)
            self.learned, self.learning_s = np.zeros(3), 0.0
        self.gained, self.since_s = np.zeros(3), 0.0


def by_dcm(samples: Iterable[Sample]) -> Iterator[Sample]:
    """The samples with attitudes by DCM, which begins with the first that was reported."""
    dcm, last = Dcm(), None
    yield ParameterValue(CHOICE, 0.0)
    for s in samples:
        if isinstance(s, ParameterValue) and s.name == CHOICE:
            continue
        if isinstance(s, ImuSample) and s.imu == 1:
            dcm.turn(s)
        elif isinstance(s, GpsFix) and s.receiver == 1 and s.fix_type >= FIX_3D:
            if last is None or s.t > last.t:
                dcm.hear(_velocity(s, last))
                last = s
        elif isinstance(s, AttitudeSample):
            dcm.heading = s.yaw
            if dcm.R is None:
                dcm.R = rotation_from_euler(s.roll, s.pitch, s.yaw)
            roll, pitch, yaw = (float(x) for x in euler_from_rotation(dcm.R))
            yield replace(s, roll=roll, pitch=pitch, yaw=yaw)
            continue
        yield s


def _velocity(s: GpsFix, last: GpsFix | None) -> Array:
    """(3,) NED, m/s; down by the heights where the receiver does not say."""
    down = s.v_d
    if down is None:
        down = 0.0 if last is None else (last.altitude - s.altitude) / (s.t - last.t)
    return np.array([s.v_n, s.v_e, down])
