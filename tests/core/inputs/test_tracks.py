"""Tracks of samples: what they refuse, by name, and stamps that belong to a receiver's grid."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from onboard.core.inputs.even_times import even_times
from onboard.core.inputs.samples import GpsFix, ImuSample
from onboard.core.inputs.tracks import FixTrack, ImuTrack, SlowTrack
from onboard.core.maths.accelerometer import SixParameters


def imu_sample(t, **changes):
    return replace(ImuSample(t, 1, (0.0, 0.0, -9.8), (0.0, 0.0, 0.0)), **changes)


def test_inertial_track_counts_what_it_refuses():
    track = ImuTrack()
    nominal = SixParameters()
    for sample in (
        imu_sample(1.0),
        imu_sample(1.0),
        imu_sample(0.9),
        imu_sample(1.1, w_b=None),
        imu_sample(1.2, f_b=(np.inf, 0.0, 0.0)),
        imu_sample(1.3),
    ):
        track.add(sample, nominal, None)
    assert len(track) == 2
    assert track.refused == Counter(
        imu_repeated=1, imu_late=1, imu_without_gyro=1, imu_not_finite=1
    )


def test_inertial_track_is_raw_in_sensor_axes():
    R_bs = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    parameters = SixParameters((1.1, 0.9, 1.0), (0.1, 0.2, -0.3))
    raw = np.array([1.0, 2.0, -9.0])
    track = ImuTrack()
    track.add(imu_sample(1.0, f_b=tuple(R_bs @ parameters.apply(raw))), parameters, R_bs)
    np.testing.assert_allclose(track.arrays()[1][0, 3:6], raw)


def fix(t, t_receiver=None):
    return GpsFix(t, 1, 3, 0.8, 0.2, 100.0, 1.0, 2.0, t_receiver=t_receiver)


def test_fixes_repeated_or_late_are_dropped_by_name():
    track = FixTrack()
    taken = [
        track.add(f, trusted=True)
        for f in (fix(1.0, 5.0), fix(1.0, 5.0), fix(1.1, 5.0), fix(0.9, 4.9), fix(1.2, 5.2))
    ]
    assert taken == [True, False, False, False, True]
    assert track.refused == Counter(gps_repeated=2, gps_late=1)


def test_fixes_of_one_receiver_time_that_say_another_thing_are_no_repeats():
    track, moved = FixTrack(), replace(fix(1.1, 5.0), v_n=1.3)
    taken = [track.add(f, trusted=True) for f in (fix(1.0, 5.0), moved, replace(moved, t=1.2))]
    assert taken == [True, True, False]


def test_the_last_fix_of_a_batch_is_the_first_of_the_next_at_the_same_time():
    rng = np.random.default_rng(3)
    track, seen = FixTrack(), []
    for k in range(200):
        track.add(fix(0.2 * k + rng.uniform(0.0, 0.02)), trusted=True)
        if k % 50 == 49:
            seen.append(track.take(np.inf)[2])
    for before, after in pairwise(seen):
        assert after[0] == before[-1]
        assert np.all(np.diff(after) > 0.0)


@pytest.mark.parametrize("own_time", [True, False])
def test_jittered_stamps_come_back_to_the_receivers_grid(own_time):
    rng = np.random.default_rng(7)
    epoch = np.delete(np.arange(60), [11, 12, 40]) * 0.2
    stamp = 33.0 + epoch + rng.uniform(0.0, 0.02, len(epoch))
    even = even_times(stamp, 1e5 + epoch if own_time else None)
    error = even - (33.01 + epoch)
    # 20 ms of jitter have a sigma of 5.8 ms; the grid knows better by a large factor.
    assert np.std(error) < 1.5e-3
    assert abs(np.mean(error)) < 2.5e-3
    assert np.all(np.diff(even) > 0.0)


@pytest.mark.parametrize("phase", np.arange(0.0, 0.04, 0.005))
@pytest.mark.parametrize("lost", [0.0, 0.03, 0.2])
def test_messages_that_wait_for_a_slow_loop_are_numbered_right(phase, lost):
    """Ten a second, in a log written every 40 ms: 80 and 120 ms after one another, or with luck."""
    rng = np.random.default_rng(int(1e3 * phase))
    epoch = phase + 0.1 * np.flatnonzero(rng.random(91) >= lost)
    stamp = np.ceil(epoch / 0.04) * 0.04 + rng.uniform(0.0, 0.004, len(epoch))
    steps = np.diff(even_times(stamp, None)) / 0.1
    assert steps == pytest.approx(np.diff(epoch) / 0.1, abs=1e-3)


def test_epochs_that_come_in_pairs_are_not_three_of_which_one_is_lost():
    epoch = 0.1 * np.arange(90)
    stamp = epoch + np.where(np.arange(90) % 2, -0.018, 0.018)  # 64 and 136 ms in turn
    # 64 ms is the commonest step, by one, and 136 are two of them.
    assert np.diff(even_times(stamp, None)) == pytest.approx(
        np.full(89, 0.1), abs=3e-5
    )  # a crystal


def test_stamps_of_no_grid_stay_where_they_are():
    for seed in range(40):
        stamp = np.cumsum(np.random.default_rng(seed).uniform(0.05, 0.3, 90))
        assert np.array_equal(even_times(stamp, None), stamp)


def test_a_slow_track_refuses_what_is_late_and_keeps_two():
    track = SlowTrack()
    assert track.add(1.0, (0.0,))
    assert not track.add(0.5, (0.0,))
    assert not track.add(2.0, (float("nan"),))
    assert track.add(2.0, (1.0,))
    track.drop_before(100.0)
    assert len(track) == 2
