"""Inertial columns over intervals, once and twice integrated, against a 2 kHz integration."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.inputs.segments import Segment
from onboard.core.model.around import around
from onboard.core.model.gyro_scale import GyroScale
from onboard.core.model.nuisances import (
    GyroTiming,
    Six,
)
from onboard.core.model.quadrature import NodeMaker
from onboard.core.model.regressors import Model
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.gravity import Gravity

H = 5e-4
T = np.arange(0.0, 3.0 + H / 2, H)
START, END, EPOCH = 1.4, 1.6, 1.5
SIX = np.array([1.03, 0.97, 1.02, -0.2, 0.3, -0.1])


def rate(t):
    return np.stack([1.2 * np.sin(3 * t), 0.8 * np.cos(2 * t), 0.5 + 0.3 * np.sin(t)], axis=-1)


def raw(t):
    return np.stack([3 * np.sin(4 * t), 2 * np.cos(3 * t), -10 + 2 * np.sin(5 * t)], axis=-1)


def exponential(phi):
    """Series of the matrix exponential, (n, 3, 3), of rotation vectors, (n, 3)."""
    x, y, z = phi.T
    zero = np.zeros_like(x)
    K = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    out = term = np.broadcast_to(np.eye(3), K.shape)
    for n in range(1, 12):
        term = term @ K / n
        out = out + term
    return out


def attitudes(w):
    """Attitude at T from rates at the middles of its steps, the identity first."""
    R = np.empty((len(T), 3, 3))
    R[0] = np.eye(3)
    for i, step in enumerate(exponential(w * H)):
        R[i + 1] = R[i] @ step
    return R


MIDDLE = T[:-1] + H / 2
TRUE = attitudes(rate(MIDDLE))


def index(t):
    return round(t / H)


def force(six, at=T):
    return raw(at) * six[:3] + six[3:]


def gained(R, f, start=START, end=END):
    """``R(start)^T`` times the integral of R f, and of ``(end - t) R f``."""
    i, k = index(start), index(end)
    a = np.einsum("nij,nj->ni", R[i : k + 1], f[i : k + 1]) @ R[i]
    left = (end - T[i : k + 1])[:, None]
    return np.trapezoid(a, T[i : k + 1], axis=0), np.trapezoid(left * a, T[i : k + 1], axis=0)


@pytest.fixture(scope="module")
def made():
    t = np.arange(0.0, 3.0, 0.01)
    segment = Segment(t, rate(t), raw(t), T[::20], TRUE[::20], np.eye(3))
    maker = NodeMaker(segment, np.zeros(3), SIX)
    intervals = maker.intervals(np.array([START]), np.array([END]))
    return intervals, around(maker, np.array([EPOCH]))


def columns(made, family):
    return Model([family]).regressors(*made)


@pytest.mark.parametrize("j", range(6))
def test_six(made, j):
    step = 1e-3 * np.eye(6)[j]
    above, below = gained(TRUE, force(SIX + step)), gained(TRUE, force(SIX - step))
    got = columns(made, Six())
    for have, a, b in zip((got.force1, got.force2), above, below, strict=True):
        np.testing.assert_allclose(have[0, :, j], (a - b) / 2e-3, atol=2e-5)


@pytest.mark.parametrize("j", range(3))
def test_gyro_scale_turns_the_attitude(made, j):
    """The unknown is what the gyroscope reads too much: the truth turns by less."""

    def turned(k):
        scale = np.ones(3)
        scale[j] -= k
        R = attitudes(rate(MIDDLE) * scale)
        return R[index(START)].T @ R[index(END)]

    k = 1e-4
    # Rotation vector, axes of the interval's start, of what one unit of the unknown turns.
    W = (turned(k) - turned(-k)) / (2 * k) @ turned(0.0).T
    want = np.array([W[2, 1], W[0, 2], W[1, 0]])
    np.testing.assert_allclose(columns(made, GyroScale()).turn[0, :, j], want, atol=2e-5)


def test_a_late_gyroscope_gives_an_attitude_of_the_past(made):
    """What is lacking when forces of now are turned by the attitude of d ago."""
    i, k = index(START), index(END)
    d = 4
    f = force(SIX)

    def by(shift):
        a = np.einsum("nij,nj->ni", TRUE[i + shift : k + 1 + shift], f[i : k + 1])
        return np.trapezoid(a, T[i : k + 1], axis=0) @ TRUE[i]

    want = (by(d) - by(-d)) / (2 * d * H)
    np.testing.assert_allclose(columns(made, GyroTiming()).force1[0, :, 0], want, atol=2e-3)


@pytest.mark.parametrize("family", [Six(), GyroTiming(), Gravity(Origin(0.0))])
def test_what_is_gained_is_the_integral_of_the_acceleration(made, family):
    intervals, _ = made
    got = family.gained(intervals, intervals.of_sensors())
    want = np.stack(intervals.integrals(family.acceleration(intervals.signals)), axis=1)
    np.testing.assert_allclose(got, want, atol=1e-12)


def test_what_is_turned_is_the_integral_of_the_rate(made):
    intervals, _ = made
    want = intervals.integrals(GyroScale().rate(intervals.signals))[0]
    np.testing.assert_allclose(GyroScale().turned(intervals.of_sensors()), want, atol=1e-13)
