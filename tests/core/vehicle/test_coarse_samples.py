"""Samples as far apart as the grid's steps are a flight all the same."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.maths.frames import rotation_from_euler
from onboard.core.vehicle.flight import flight_of
from onboard.core.vehicle.signals import Signals, Stream
from onboard.core.vehicle.trajectory import Motion


def motion(rate, seconds=60.0, jitter=0.0):
    rng = np.random.default_rng(1)
    t = 7.0 + np.arange(0.0, seconds, 1.0 / rate)
    t = t + jitter * rng.uniform(-1.0, 1.0, len(t)) / rate
    f_b = np.stack([np.sin(t), np.cos(t), np.full(len(t), -9.8)], axis=1)
    R_nb = rotation_from_euler(0.1 * np.sin(t), 0.1 * np.cos(t), 0.3 * np.sin(0.3 * t))
    v_n = np.stack([np.sin(0.5 * t), np.cos(0.5 * t), 0.0 * t], axis=1)
    return Motion(t, f_b, 0.0 * f_b, R_nb, v_n, 100.0 + np.sin(t), 0.01, 1e-3)


@pytest.mark.parametrize("rate", [8.3, 9.0, 10.0, 11.0, 14.0, 20.0, 25.0, 50.0])
@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_a_flight_has_no_gap_where_its_samples_have_none(rate, jitter):
    flight = flight_of([motion(rate, jitter=jitter)], Signals(), Stream(), [], 0.0)
    assert flight is not None
    assert len(flight) == pytest.approx(600, abs=3)
    assert np.unique(flight.piece).size == 1
    np.testing.assert_allclose(np.diff(flight.t), 0.1, atol=1e-9)
    # Means over a tenth of a second of what is between samples, by straight lines.
    # Half a step of its slope is what samples to either side of a step's middle are off by.
    np.testing.assert_allclose(flight.f_b[:, 0], np.sin(flight.t), atol=0.05)
    np.testing.assert_allclose(flight.v_n[:, 0], np.sin(0.5 * flight.t), atol=0.02)


def test_a_motion_that_is_fine_enough_is_taken_as_it_is():
    its = motion(25.0)
    assert its.finer(0.05) is its
