"""Columns against finite differences of a recording that is simulated anew with the effect in it.

The simulation shares nothing with the columns but the equations of motion: fine steps, the true
attitude, and a measurement that the effect has gone through.
"""

from itertools import pairwise

import numpy as np
import pytest

from onboard.core.inputs.segments import Segment
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import rotation_from_vector
from onboard.core.model.around import around
from onboard.core.model.gyro_scale import GyroScale
from onboard.core.model.nuisances import (
    AttitudeOffset,
    GpsLatency,
    GpsSmoothing,
    ImuDelay,
    LeverArmError,
    Six,
)
from onboard.core.model.quadrature import NodeMaker
from onboard.core.model.regressors import Model
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.bias_ramp import BiasRamp
from onboard.core.physics.effects.clock_skew import ClockSkew
from onboard.core.physics.effects.cross_axis import CrossAxis
from onboard.core.physics.effects.gps_lever_arm import GpsLeverArm
from onboard.core.physics.effects.gravity import Gravity
from onboard.core.physics.effects.load_flex import LoadFlex
from onboard.core.physics.effects.mount_tilt import MountTilt
from onboard.core.physics.effects.scale_nonlinearity import ScaleNonlinearity
from onboard.core.physics.effects.temperature_drift import TemperatureDrift
from onboard.core.physics.effects.throttle_coupling import ThrottleCoupling

NOMINAL = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
ORIGIN = Origin(t0=-2.0, temperature=30.0)
DOWN = np.array([0.0, 0.0, STANDARD_GRAVITY])
T = np.arange(-1.5, 2.5, 5e-4)
EPOCHS = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])


def rotation(t):
    zero = np.zeros_like(t)
    return rotation_from_vector(np.stack([zero, zero, 0.8 * t], axis=-1)) @ rotation_from_vector(
        np.stack([0.6 * np.sin(1.7 * t), zero, zero], axis=-1)
    )


def rates(t):
    phi = 0.6 * np.sin(1.7 * t)
    return np.stack([1.02 * np.cos(1.7 * t), 0.8 * np.sin(phi), 0.8 * np.cos(phi)], axis=-1)


def force(t):
    return np.stack(
        [2 * np.sin(2.1 * t), 1.5 * np.cos(1.2 * t), -9.8 + 3.0 * np.sin(0.9 * t)], axis=-1
    )


R, F, W = rotation(T), force(T), rates(T)
TEMPERATURE, THROTTLE = 25.0 + 4.0 * T, 0.5 + 0.2 * np.sin(T)


def nodes_of(f_read, told=(0.0, 0.0, 0.0), found=(0.0, 0.0, 0.0), averaged=0.0):
    slow = {"temperature": (T[::20], TEMPERATURE[::20]), "throttle": (T[::20], THROTTLE[::20])}
    step = slice(None, None, 10)  # 200 Hz
    segment = Segment(
        T[step], W[step], f_read[step], T[step], R[step], np.eye(3), slow, np.array(told)
    )
    made = NodeMaker(segment, np.zeros(3), NOMINAL)
    near = around(made, EPOCHS, averaged, np.array(found))
    return made.intervals(EPOCHS[:-1], EPOCHS[1:]), near


def columns_of(family, f_read=F, **arm):
    intervals, near = nodes_of(f_read, **arm)
    assert family.available(near.now)
    return Model([family]).regressors(intervals, near)


def gained(a_b):
    """Velocity and position gained over each interval (K, 3), body axes of its start."""
    out = []
    for begin, end in pairwise(EPOCHS):
        i = (begin - 1e-9 <= T) & (end + 1e-9 >= T)
        a = np.einsum("ji,njk,nk->ni", rotation(np.array([begin]))[0], R[i], a_b[i])
        out.append(
            (np.trapezoid(a, T[i], axis=0), np.trapezoid((end - T[i])[:, None] * a, T[i], axis=0))
        )
    v, x = zip(*out, strict=True)
    return np.array(v), np.array(x)


def small(axis, size):
    out = np.zeros(3)
    out[axis] = size
    return out


def cross(k, e):
    pair = ("xy", "xz", "yx", "yz", "zx", "zy")[k]
    M = np.zeros((3, 3))
    M["xyz".index(pair[0]), "xyz".index(pair[1])] = e
    return F @ M.T


def tilted(k, e):
    # The sensor turned by -e in the body reads the force turned by +e.
    return F @ rotation_from_vector(small(k, e)).T - F


def flexed(k, e):
    tilt = (-F[:, 2] / STANDARD_GRAVITY - 1.0)[:, None] * small(k, e)
    return np.einsum("nij,nj->ni", rotation_from_vector(tilt), F) - F


# What the accelerometer reads too much when unknown k of the family is e.
READS = {
    "cross axis": (CrossAxis(ORIGIN), cross),
    "tilt": (MountTilt(ORIGIN), tilted),
    "flex": (LoadFlex(ORIGIN), flexed),
    "nonlinearity": (
        ScaleNonlinearity(ORIGIN),
        lambda k, e: F**2 / STANDARD_GRAVITY * small(k, e),
    ),
    "temperature": (
        TemperatureDrift(ORIGIN),
        lambda k, e: (TEMPERATURE - ORIGIN.temperature)[:, None] * small(k, e),
    ),
    "ramp": (BiasRamp(ORIGIN), lambda k, e: (T - ORIGIN.t0)[:, None] * small(k, e)),
    "throttle": (ThrottleCoupling(ORIGIN), lambda k, e: THROTTLE[:, None] * small(k, e)),
}


@pytest.mark.parametrize("name", READS)
def test_what_the_accelerometer_reads_too_much_is_taken_off(name):
    family, too_much = READS[name]
    got = columns_of(family)
    for k in range(len(family.unknowns)):
        # Truth less reading, integrated: what the unknown adds to the prediction per unit.
        e = 1e-5
        v, x = gained(-(too_much(k, e) - too_much(k, -e)) / (2 * e))
        np.testing.assert_allclose(got.force1[..., k], v, atol=2e-4)
        np.testing.assert_allclose(got.force2[..., k], x, atol=4e-5)


def test_the_six_are_derivatives_of_the_corrected_force():
    got = columns_of(Six())
    for k in range(3):
        v, x = gained(F * small(k, 1.0))
        np.testing.assert_allclose(got.force1[..., k], v, atol=2e-4)
        np.testing.assert_allclose(got.force2[..., k], x, atol=4e-5)
        v, x = gained(np.broadcast_to(small(k, 1.0), F.shape))
        np.testing.assert_allclose(got.force1[..., 3 + k], v, atol=1e-5)


def test_more_gravity_is_more_down():
    got = columns_of(Gravity(ORIGIN))
    v, _ = gained(R[:, 2, :])
    np.testing.assert_allclose(got.force1[..., 0], v, atol=1e-4)


def at_epochs(x):
    return np.stack([np.interp(EPOCHS, T, x[:, i]) for i in range(3)], axis=1)


def direct(columns, k):
    """Direct velocity column k in NED at the epochs."""
    R_nb = rotation(EPOCHS)
    return (
        np.einsum("kij,kj->ki", R_nb, columns.velocity_body[..., k]) + columns.velocity_ned[..., k]
    )


ACCELERATION = np.einsum("nij,nj->ni", R, F) + DOWN
VELOCITY = np.vstack(
    [np.zeros(3), np.cumsum(2.5e-4 * (ACCELERATION[1:] + ACCELERATION[:-1]), axis=0)]
)


ARMS = (
    {},
    {"told": (0.8, -0.5, -0.4)},
    {"found": (0.8, -0.5, -0.4)},
    {"told": (0.3, 0.0, -0.9), "found": (0.2, 0.4, 0.6)},
)
"""Where the antenna is, m: at the accelerometer, told, found in flight, and both."""


def velocity_at(t, told=(0.0, 0.0, 0.0), found=(0.0, 0.0, 0.0)):
    v = np.stack([np.interp(t, T, VELOCITY[:, i]) for i in range(3)], axis=-1)
    arm, e = np.add(told, found), 1e-4
    flat = np.ravel(t)
    swing = (rotation(flat + e) - rotation(flat - e)) @ arm / (2 * e)
    return v + swing.reshape(v.shape)


@pytest.mark.parametrize("arm", ARMS)
def test_a_late_receiver_reads_the_velocity_of_before(arm):
    e = 2e-3
    numeric = (velocity_at(EPOCHS - e, **arm) - velocity_at(EPOCHS + e, **arm)) / (2 * e)
    got = columns_of(GpsLatency(0.0), **arm)
    np.testing.assert_allclose(direct(got, 0), numeric, atol=2e-3)
    np.testing.assert_array_equal(got.along_velocity[:, 0], -1.0)


@pytest.mark.parametrize("arm", ARMS)
def test_a_clock_that_runs_away_is_a_latency_that_grows(arm):
    e = 1e-3
    late = e * (EPOCHS - ORIGIN.t0)
    numeric = (velocity_at(EPOCHS - late, **arm) - velocity_at(EPOCHS + late, **arm)) / (2 * e)
    got = columns_of(ClockSkew(ORIGIN), **arm)
    np.testing.assert_allclose(direct(got, 0), numeric, atol=5e-3)


@pytest.mark.parametrize("window", [0.1, 0.3])
def test_a_late_receiver_that_averages_reads_the_average_of_before(window):
    def mean(t):
        s = np.linspace(-window / 2, window / 2, 401)
        return np.trapezoid(velocity_at(t[:, None] + s), s, axis=1) / window

    e = 2e-3
    numeric = (mean(EPOCHS - e) - mean(EPOCHS + e)) / (2 * e)
    got = columns_of(GpsLatency(0.0), averaged=window)
    np.testing.assert_allclose(direct(got, 0), numeric, atol=5e-3)


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("window", [0.2, 0.3])
def test_a_receiver_that_averages(window, arm):
    def mean(w):
        s = np.linspace(-w / 2, w / 2, 401)
        return np.trapezoid(velocity_at(EPOCHS[:, None] + s, **arm), s, axis=1) / w

    e = 0.01  # of window^2
    numeric = (mean(np.sqrt(window**2 + e)) - mean(np.sqrt(window**2 - e))) / (2 * e)
    got = direct(columns_of(GpsSmoothing(window), **arm), 0)
    np.testing.assert_allclose(got, numeric, atol=0.05 * np.abs(numeric).max())


@pytest.mark.parametrize("family", [GpsLeverArm(ORIGIN), LeverArmError()])
def test_an_antenna_away_from_the_imu_swings(family):
    got = columns_of(family)
    e = 1e-3
    for k in range(3):
        there = [rotation(EPOCHS + s) @ small(k, 1.0) for s in (e, -e)]
        np.testing.assert_allclose(direct(got, k), (there[0] - there[1]) / (2 * e), atol=1e-4)
        np.testing.assert_allclose(got.position_body[..., k], np.tile(small(k, 1.0), (6, 1)))


def turned(recorded):
    """Rotation vectors (NED) that take the true attitude at the epochs to the recorded one."""
    D = recorded @ np.swapaxes(rotation(EPOCHS), -1, -2)
    return 0.5 * np.stack(
        [D[:, 2, 1] - D[:, 1, 2], D[:, 0, 2] - D[:, 2, 0], D[:, 1, 0] - D[:, 0, 1]], axis=-1
    )


def attitude(columns, k):
    R_nb = rotation(EPOCHS)
    return (
        np.einsum("kij,kj->ki", R_nb, columns.attitude_body[..., k]) + columns.attitude_ned[..., k]
    )


def test_a_late_attitude_is_that_of_before():
    e = 1e-4
    numeric = (turned(rotation(EPOCHS - e)) - turned(rotation(EPOCHS + e))) / (2 * e)
    np.testing.assert_allclose(attitude(columns_of(ImuDelay()), 0), numeric, atol=1e-4)


def test_tilt_is_fixed_in_the_body_and_heading_to_north():
    got = columns_of(AttitudeOffset())
    e = 1e-4
    for k in range(3):
        turn = rotation_from_vector(small(k, e))
        recorded = turn @ rotation(EPOCHS) if k == 2 else rotation(EPOCHS) @ turn
        np.testing.assert_allclose(attitude(got, k), turned(recorded) / e, atol=1e-6)


def test_a_gyroscope_that_reads_too_much_has_turned_too_far():
    got = columns_of(GyroScale())
    e = 1e-4
    for k in range(3):
        for n, (begin, end) in enumerate(pairwise(EPOCHS)):
            i = np.flatnonzero((begin - 1e-9 <= T) & (end - 1e-9 > T))
            read, true = np.eye(3), np.eye(3)
            for j in i:
                w = 0.5 * (W[j] + W[j + 1])
                true = true @ rotation_from_vector(w * 5e-4)
                read = read @ rotation_from_vector((w + w * small(k, e)) * 5e-4)
            D = true @ read.T  # what the read attitude lacks to the true one
            psi = 0.5 * np.array([D[2, 1] - D[1, 2], D[0, 2] - D[2, 0], D[1, 0] - D[0, 1]])
            np.testing.assert_allclose(got.turn[n, :, k], psi / e, atol=2e-4)
