"""What shakes a force: where in a flight it is, along which axis, and that motion is no shaking."""

import numpy as np
import pytest

from onboard.core.filter.limits import SHAKEN_LASTS_S, SHAKEN_MEAN_S
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.shaken import shaken_between, shaken_density, walk_s
from onboard.core.inputs.segments import Segment
from onboard.core.maths.frames import rotation_from_vector

H, STEP = 0.03, 0.2
"""s, from sample to sample, and of a step of the filter."""
TURNED = rotation_from_vector(np.array([0.3, -0.5, 1.2]))


def flown(f_b, R_bs=TURNED):
    """Samples (n, 3) of a force along body axes, by a sensor that is mounted askew."""
    t = H * np.arange(len(f_b))
    R = np.tile(np.eye(3), (2, 1, 1))
    return Segment(t, np.zeros((len(t), 3)), f_b @ R_bs, np.array([t[0], t[-1]]), R, R_bs)


def steps_of(segment):
    edges = np.arange(segment.t[0], segment.t[-1], STEP)
    return edges[:-1], edges[1:]


def noise(sigma, seconds=200.0, seed=1):
    rng = np.random.default_rng(seed)
    return np.array([0.0, 0.0, -9.8]) + sigma * rng.normal(size=(round(seconds / H), 3))


def test_of_noise_it_is_what_the_velocity_walks_by_if_samples_are_summed():
    sigma = np.array([0.5, 0.1, 2.0])
    segment = flown(noise(sigma))
    start, end = steps_of(segment)
    walked = sigma**2 * H
    np.testing.assert_allclose(shaken_between(segment, start, end).mean(0), walked * STEP, rtol=0.1)
    np.testing.assert_allclose(shaken_density(segment), walked, rtol=0.1)
    twice = shaken_between(segment, start[:-1:2], end[1::2])
    np.testing.assert_allclose(twice.mean(0), 2.0 * walked * STEP, rtol=0.1)


def test_it_is_where_the_flight_is_shaken_and_along_the_axis_that_is():
    f_b = noise(np.zeros(3))
    seconds = H * np.arange(len(f_b))
    gust = (seconds > 80.0) & (seconds < 90.0)
    f_b[gust, 1] += np.random.default_rng(2).normal(size=gust.sum())
    segment = flown(f_b)
    start, end = steps_of(segment)
    found = shaken_between(segment, start, end)
    inside = (start > 80.0 + SHAKEN_LASTS_S) & (end < 90.0 - SHAKEN_LASTS_S)
    outside = (end < 80.0 - SHAKEN_LASTS_S) | (start > 90.0 + SHAKEN_LASTS_S)
    assert found[inside, 1].mean() == pytest.approx(H * STEP, rel=0.15)
    assert found[outside].max() < 1e-12
    assert found[:, [0, 2]].max() < 1e-12


@pytest.mark.parametrize("frequency", [0.2, 0.5, 1.0])
def test_what_a_vehicle_flies_is_no_shaking(frequency):
    """What bends is off its mean by half its curvature times the variance of the moments."""
    t, n, turning = (
        H * np.arange(5000),
        2 * int(SHAKEN_MEAN_S / 2.0 / H) + 1,
        2.0 * np.pi * frequency,
    )
    flies = np.column_stack([np.sin(turning * t)] * 3)
    share = shaken_density(flown(3.0 * flies)) / (3.0**2 / 2.0 * H)
    off = turning**2 / 2.0 * (n**2 - 1) * H**2 / 12.0
    np.testing.assert_allclose(share, off**2 * n / (n - 1), rtol=0.15)
    assert share.max() < 6e-3


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_of_a_few_samples_little_is_known(n):
    segment = flown(noise(np.ones(3))[:n])
    found = shaken_between(segment, np.array([0.0]), np.array([STEP]))
    assert np.all(np.isfinite(found))
    assert np.all(shaken_density(segment) == 0.0) == (n < 3)


def test_the_walk_along_a_sensors_axes_is_that_of_the_bodys_turned():
    segment = flown(noise(np.array([0.5, 0.1, 2.0])))
    levels = NoiseLevels(force_walk=0.3, lift_walk=0.1, shaken_walk=0.7, shaken_lift=0.2)
    along = np.array([0.3, 0.3, 0.1]) ** 2
    along += np.array([0.7, 0.7, 0.2]) ** 2 * shaken_density(segment)
    np.testing.assert_allclose(walk_s(levels, segment), np.diag(TURNED.T @ np.diag(along) @ TURNED))
