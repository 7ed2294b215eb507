"""The Cramer-Rao bound of the six numbers on a known path with known noise.

A covariance recursion (Riccati) over the true motion at the inertial rate, with every unknown of
the model as a state that does not move: its last covariance is the inverse of the Fisher
information with the prior added (van Trees 1968, section 2.4).  It shares with the estimator the
levels of noise, constants and the list of unknowns, but no code: no columns, no epochs' integrals,
no sums.
"""

from __future__ import annotations

import numpy as np

from benchmarks.matched import GPS_HZ, IMU_HZ, LEVELS, Path, jerk
from benchmarks.recorded import Array
from onboard.core.filter.limits import ATTITUDE_TIME_S, COLOUR_TIME_S
from onboard.core.filter.noise import NoiseLevels
from sitl.builtin.attitude import STEP, AttitudeFilter
from sitl.builtin.rotation import cross_matrix
from sitl.builtin.smoothing import RATE, derivative

V, H, PSI, BIAS = slice(0, 3), 3, slice(4, 7), slice(7, 10)
ATT, WANDER, COLOUR = slice(10, 13), 13, slice(14, 17)
SCALE, BETA = slice(17, 20), slice(20, 23)
DELAY, SPAN, THIRD, ATT_DELAY, H_DELAY, GYRO_LATE = 23, 24, 25, 26, 27, 28
GYRO_SCALE, ROLL, PITCH, YAW, ARM = slice(29, 32), 32, 33, 34, slice(35, 38)
TOLD, TURNING, SIZE = slice(38, 45), 45, 46
"""What an EKF was told that was wrong: a delay, scale and offset of its own accelerometer; and the
rate of the smooth error of the heading."""

PRIOR = (
    (SCALE, 0.03), (BETA, 0.5), (DELAY, 0.5), (SPAN, 0.2), (THIRD, 1e-3), (ATT_DELAY, 0.2),
    (H_DELAY, 0.1), (GYRO_LATE, 0.005), (GYRO_SCALE, 0.01), (ROLL, 0.03), (PITCH, 0.03),
    (YAW, 0.1), (ARM, 0.05), (TOLD, (0.1, *3 * (0.03,), *3 * (0.5,))), (V, 10.0), (H, 100.0),
    (BIAS, 0.01), (WANDER, 0.0),
)  # fmt: skip
"""Standard deviations before the flight, of constants and of what moves; SI."""


def bound(path: Path, levels: NoiseLevels = LEVELS) -> Array:
    """(6,) smallest standard deviation of scale and offset (m/s^2) of an ideal accelerometer.

    For one with scale ``s`` multiply those of scale by ``s``, divide those of offset by it.
    """
    P = _start(levels)
    step = 1.0 / IMU_HZ
    stride = RATE // IMU_HZ
    Q, keep = _walks(levels, step)
    acceleration, jerks = jerk(path)
    rates, tilts = derivative(path.w_b), ekf_tilts(path, acceleration)
    F, eye = np.zeros((SIZE, SIZE)), np.eye(SIZE)
    epochs = path.epochs.tolist()
    per_epoch = (RATE // GPS_HZ) // stride
    for k, row in enumerate(epochs):
        tilt = tilts[round(row / RATE / STEP)]
        P = _updated(P, path, row, levels, acceleration[row], jerks[row], jerks, tilt)
        if k + 1 == len(epochs):
            break
        for i in range(per_epoch):
            # The middle of the step: second order, like the motion between two samples.
            m = row + i * stride + stride // 2
            R, f = path.R_nb[m], path.f_b[m]
            F[:] = eye
            F[range(10, 17), range(10, 17)] = keep
            F[ATT.stop - 1, TURNING] = step
            F[TURNING, ATT.stop - 1] = -step / levels.heading_time**2
            F[TURNING, TURNING] = 1.0 - 2.0 * step / levels.heading_time
            turn = _turn(R, path.w_b[m], rates[m]) * step
            lean = -cross_matrix(R @ f) * step
            push = np.hstack([R * f, R]) * step
            F[PSI] += turn
            F[V] += lean @ (eye[PSI] + 0.5 * turn)
            F[V, SCALE], F[V, BETA] = push[:, :3], push[:, 3:]
            F[H] -= step * 0.5 * (F[2] + eye[2])
            Q[V, V] = (R * levels.walk_b) @ R.T * step
            P = F @ P @ F.T + Q
        P = (P + P.T) / 2
    return np.sqrt(np.diag(P)[17:23])


def _start(q: NoiseLevels) -> Array:
    sigma = np.zeros(SIZE)
    for where, value in PRIOR:
        sigma[where] = value
    sigma[PSI] = (0.06, 0.06, 0.2)
    sigma[ATT] = (q.attitude, q.attitude, q.heading)
    sigma[TURNING] = q.heading / q.heading_time
    sigma[COLOUR] = q.velocity_colour
    return np.diag(sigma**2)


def _walks(q: NoiseLevels, step: float) -> tuple[Array, Array]:
    """Noise added in a step but for the velocity's, and what is kept of states 10 to 16."""
    keep = np.ones(7)
    keep[:2] = np.exp(-step / ATTITUDE_TIME_S)
    keep[4:] = np.exp(-step / COLOUR_TIME_S)
    var = np.zeros(SIZE)
    var[PSI] = q.tilt_walk**2 * step
    var[BIAS], var[WANDER] = q.bias_walk**2 * step, q.height_walk**2 * step
    var[ATT] = q.attitude**2 * (1.0 - keep[:3] ** 2)
    var[ATT.stop - 1] = q.heading_walk**2 * step
    var[TURNING] = 4.0 * q.heading**2 * step / q.heading_time**3
    var[COLOUR] = q.velocity_colour**2 * (1.0 - keep[4] ** 2)
    return np.diag(var), keep


def _turn(R: Array, w_b: Array, rate: Array) -> Array:
    """(3, SIZE) growth of the attitude error: what the gyroscope reads too much, or too late."""
    out = np.zeros((3, SIZE))
    out[:, BIAS] = -R
    out[:, GYRO_SCALE] = -R * w_b
    out[:, GYRO_LATE] = R @ rate
    return out


def ekf_tilts(path: Path, acceleration: Array) -> Array:
    """(n, 3, 7) rotation vector, NED, of an EKF's attitude each :data:`STEP`, for what it was told.

    By the built-in simulator's own filter, which is linear in them.
    """
    small = 1e-3
    rows = np.arange(0, len(path.f_b), round(STEP * RATE))
    f_n = np.einsum("kij,kj->ki", path.R_nb[rows], path.f_b[rows])
    out = np.empty((len(rows), 3, 7))
    size = np.zeros((7, 2, 3))
    size[range(1, 4), 0, range(3)] = size[range(4, 7), 1, range(3)] = small
    for j, (scale, beta) in enumerate(size):
        ekf = AttitudeFilter()
        ekf.align(path.R_nb[0], scale * path.f_b[0] + beta, 0.0)
        for k, row in enumerate(rows):
            wrong = scale * path.f_b[row] + beta
            ekf.predict(path.R_nb[row], f_n[k], wrong, np.zeros(3))
            if row % (RATE // GPS_HZ) == 0:
                late = small if j == 0 else 0.0
                ekf.fuse_gps(-late * acceleration[row], -late * path.v_n[row])
                ekf.fuse_heading(0.0)
            out[k, :, j] = ekf.phi / small
    return out


def _updated(
    P: Array,
    path: Path,
    row: int,
    q: NoiseLevels,
    a: Array,
    j: Array,
    jerks: Array,
    tilt: Array,
) -> Array:
    """Covariance after the epoch at ``row``: two velocities, height, attitude."""
    R, v = path.R_nb[row], path.v_n[row]
    near = RATE // 20
    third = (jerks[min(row + near, len(jerks) - 1)] - jerks[max(row - near, 0)]) * RATE / (2 * near)
    M = np.zeros((6, SIZE))
    M[[0, 1], [0, 1]] = M[[0, 1], [14, 15]] = 1.0
    M[:2, DELAY], M[:2, SPAN], M[:2, THIRD] = -a[:2], j[:2] / 24.0, third[:2] / 6.0
    M[2, [H, WANDER]] = 1.0
    M[2, [DELAY, H_DELAY]] = v[2]
    M[2, SPAN] = -a[2] / 24.0
    M[:2, ARM], M[2, ARM] = (R @ cross_matrix(path.w_b[row]))[:2], -R[2]
    M[3:, PSI] = M[3:, ATT] = np.eye(3)
    M[3:, ATT_DELAY] = -R @ path.w_b[row]
    M[3:, ROLL], M[3:, PITCH], M[5, YAW] = R[:, 0], R[:, 1], 1.0
    M[3:, TOLD] = tilt
    noise = np.array([q.velocity**2] * 2 + [q.height**2] + [q.attitude_white**2] * 3)
    S = np.diag(noise)
    S[:2, :2] += q.jitter**2 * np.outer(a[:2], a[:2])
    HP = M @ P
    gain = np.linalg.solve(HP @ M.T + S, HP).T
    out: Array = P - gain @ HP
    return out
