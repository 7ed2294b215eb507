"""The autopilot's attitude: a small inertial/GPS Kalman filter, so that it errs as one does.

Run in error form about the true motion, which to first order is the same as running the
whole filter: attitude error ``phi`` (NED, ``R_estimated = exp(phi x) R``), velocity error and
position error grow with the errors of gyroscope and accelerometer less their estimated
biases, and are pulled back by GPS as it arrives: late, noisy, and dated by the delay that
the autopilot believes in.  Process noise and initial uncertainty are EKF3's defaults.
"""

from __future__ import annotations

from copy import deepcopy
from functools import lru_cache

import numpy as np

from sitl.builtin import rotation
from sitl.builtin.smoothing import Array
from sitl.builtin.trajectory import STANDARD_GRAVITY

STEP = 0.04
"""Prediction interval, s."""

GYRO_NOISE = 2.7e-6
"""EK3_GYRO_P_NSE 0.015 rad/s per 12 ms step, as a rate of variance, rad^2/s."""
ACCEL_NOISE = 1.5e-3
"""EK3_ACC_P_NSE 0.35 m/s^2 per 12 ms step, (m/s)^2/s."""
GYRO_BIAS_NOISE = 1.2e-8
ACCEL_BIAS_NOISE = 4.8e-6
VELOCITY_SIGMA = 0.3
HEIGHT_VELOCITY_SIGMA = 0.5
POSITION_SIGMA = 0.5
HEIGHT_SIGMA = 2.0
HEADING_SIGMA = 0.07
"""rad, five times a second: EK3_MAG_M_NSE, 0.05 gauss of half a gauss, ten times a second."""
GATE = 5.0
SMOOTHING = 0.25
"""Time in which the output predictor takes over a correction, s."""

PHI, VEL, POS, BG, BA = (slice(i, i + 3) for i in range(0, 15, 3))
_INITIAL_SIGMA = np.repeat([0.1, 0.3, 0.5, 0.005, 0.2], 3)
_GPS = slice(3, 9)
_GPS_SIGMA = np.array(
    [VELOCITY_SIGMA] * 2 + [HEIGHT_VELOCITY_SIGMA] + [POSITION_SIGMA] * 2 + [HEIGHT_SIGMA]
)
_GPS_NOISE = np.diag(_GPS_SIGMA**2)
_HEADING = 2
FUSE_EVERY = 5
"""Steps from fix to fix, while it stands."""
STOOD_STEPS = 1500
"""A vehicle has stood for a minute before it is told to fly."""


class AttitudeFilter:
    """Error of the attitude, velocity and position that the autopilot reports.

    ``phi``, ``velocity``, ``position``: errors of the output, (3,); ``gyro_bias`` and
    ``accel_bias``: what the filter believes, body axes; ``ratios``: innovations over their
    gates (velocity, position, height, heading), as EKF_STATUS_REPORT gives them.
    """

    def __init__(self) -> None:
        self._error = np.zeros(9)
        self.gyro_bias = np.zeros(3)
        self.accel_bias = np.zeros(3)
        self.phi = np.zeros(3)
        self.covariance = np.diag(_INITIAL_SIGMA**2)
        self.ratios = [0.0, 0.0, 0.0, 0.0]
        self._noise = np.diag(
            np.repeat([GYRO_NOISE, ACCEL_NOISE, 0.0, GYRO_BIAS_NOISE, ACCEL_BIAS_NOISE], 3) * STEP
        )
        self._transition = np.eye(15)
        self._transition[POS, VEL] = STEP * np.eye(3)
        self._rejected = 0

    @property
    def velocity(self) -> Array:
        """Error of the reported velocity, NED, m/s."""
        return self._error[VEL]

    @property
    def position(self) -> Array:
        """Error of the reported position, NED, m."""
        return self._error[POS]

    def align(self, R_nb: Array, f_error_b: Array, heading_error: float) -> None:
        """Levels a fresh filter with the accelerometer at rest: its horizontal error becomes tilt.

        Then it stands, and learns of its biases before it flies.
        """
        stood = _stood(R_nb.tobytes(), f_error_b.tobytes(), heading_error)
        self.__dict__.update(deepcopy(stood.__dict__))

    def level(self, R_nb: Array, f_error_b: Array, heading_error: float) -> None:
        """Takes the errors at rest for its own; see :meth:`align`."""
        f_error_n = R_nb @ f_error_b
        self._error[PHI] = (
            -f_error_n[1] / STANDARD_GRAVITY,
            f_error_n[0] / STANDARD_GRAVITY,
            heading_error,
        )
        zero, gravity = np.zeros(3), np.array([0.0, 0.0, -STANDARD_GRAVITY])
        for k in range(STOOD_STEPS):
            self.predict(R_nb, gravity, f_error_b, zero)
            if k % FUSE_EVERY == 0:
                self.fuse_gps(zero, zero)
                self.fuse_heading(heading_error)
        self.phi = self._error[PHI].copy()

    def predict(self, R_nb: Array, f_n: Array, f_error_b: Array, w_error_b: Array) -> None:
        """One step of ``STEP`` seconds.

        Args:
            R_nb: true attitude in the middle of the step, (3, 3).
            f_n: mean true specific force, NED, (3,).
            f_error_b: mean error of the corrected accelerometer, (3,).
            w_error_b: mean error of the gyroscope, (3,).
        """
        x = self._error
        turned = R_nb @ (w_error_b - self.gyro_bias)
        pushed = rotation.cross(x[PHI], f_n) + R_nb @ (f_error_b - self.accel_bias)
        x[POS] += STEP * x[VEL]
        x[VEL] += STEP * pushed
        x[PHI] += STEP * turned
        F = self._transition
        fx, fy, fz = (STEP * f_n).tolist()
        F[3, 1], F[3, 2], F[4, 0] = fz, -fy, -fz
        F[4, 2], F[5, 0], F[5, 1] = fx, fy, -fx
        F[PHI, BG] = F[VEL, BA] = -STEP * R_nb
        self.covariance = F @ self.covariance @ F.T + self._noise
        self.phi = self.phi + STEP * turned
        self.phi += (x[PHI] - self.phi) * (STEP / SMOOTHING)

    def fuse_gps(self, velocity_n: Array, position_n: Array) -> bool:
        """Fuses a fix given as measured minus true at the time that the autopilot assumes.

        Returns:
            Whether it passed the gate.
        """
        innovation = np.concatenate([velocity_n - self._error[VEL], position_n - self._error[POS]])
        spread = np.sqrt(self.covariance.diagonal()[_GPS] + _GPS_SIGMA**2)
        off = (np.abs(innovation) / spread).tolist()
        self.ratios[:3] = max(off[:3]) / GATE, max(off[3:5]) / GATE, off[5] / GATE
        if max(self.ratios[:2]) > 1.0 and self._rejected < 50:
            self._rejected += 1
            return False
        self._rejected = 0
        read = self.covariance[:, _GPS].copy()
        self._correct(np.linalg.solve(read[_GPS] + _GPS_NOISE, read.T).T, read, innovation)
        return True

    def fuse_heading(self, error: float) -> None:
        """Fuses a magnetic heading whose error is ``error`` (rad)."""
        innovation = error - self._error[_HEADING : _HEADING + 1]
        self.ratios[3] = float(abs(innovation[0]) / (HEADING_SIGMA * GATE))
        read = self.covariance[:, _HEADING : _HEADING + 1].copy()
        gain = read * (1.0 / (read[_HEADING, 0] + HEADING_SIGMA**2))
        self._correct(gain, read, innovation)

    def _correct(self, gain: Array, read: Array, innovation: Array) -> None:
        """Takes an innovation (n,) with a gain (15, n); ``read`` (15, n): P H^T."""
        change = gain @ innovation
        self._error += change[:9]
        self.gyro_bias = self.gyro_bias + change[BG]
        self.accel_bias = np.minimum(np.maximum(self.accel_bias + change[BA], -1.0), 1.0)
        P = self.covariance - gain @ read.T
        self.covariance = 0.5 * (P + P.T)


@lru_cache(maxsize=16)
def _stood(R_nb: bytes, f_error_b: bytes, heading_error: float) -> AttitudeFilter:
    """A filter that has stood: a vehicle that boots again and again stands alike, for 50 ms."""
    made = AttitudeFilter()
    made.level(np.frombuffer(R_nb).reshape(3, 3), np.frombuffer(f_error_b), heading_error)
    return made
