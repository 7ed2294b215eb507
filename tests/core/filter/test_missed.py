"""What samples miss, against what a curve through samples of a known signal is off by."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.filter.missed import missed_between, misses
from onboard.core.inputs.segments import Segment
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.model.quadrature import NodeMaker

H = 0.04
"""From sample to sample, s."""
STEP = 0.2
SIX = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
R_BS = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""A board that is turned by 90 degrees."""


def segment_of(t, raw_s, w_b):
    R = np.tile(np.eye(3), (2, 1, 1))
    return Segment(t, w_b, raw_s, np.array([t[0], t[-1]]), R, R_BS)


def steps_of(t):
    edges = np.arange(t[0] + 1.0, t[-1] - 1.0, STEP)
    return edges[:-1], edges[1:]


def noise(rng, n):
    """A little of it: otherwise everything is in the tail of nothing."""
    return np.array([0.0, 0.0, -STANDARD_GRAVITY]) + 0.01 * rng.normal(size=(n, 3))


def integral_error(segment, truth, start, end):
    """(K, 3) of the force, by what the filter integrates with."""
    made = NodeMaker(segment, np.zeros(3), SIX).intervals(start, end)
    return made.integrals(made.signals.f_b[..., None])[0][:, :, 0] - truth


def test_a_jump_at_any_moment_is_missed_by_as_much_as_is_said():
    """10 m/s^2 along one axis, somewhere between two samples: 1000 of them."""
    rng = np.random.default_rng(1)
    said, was, jump = [], [], 10.0
    t = np.arange(0.0, 6.0, H)
    start, end = steps_of(t)
    for _ in range(1000):
        at = t[75] + H * rng.uniform()
        raw = noise(rng, len(t))
        raw[:, 0] += jump * (t >= at)
        segment = segment_of(t, raw, 1e-3 * rng.normal(size=(len(t), 3)))
        truth = np.zeros((len(start), 3))
        truth[:, 1] = jump * np.clip(end - np.maximum(start, at), 0.0, None)  # x of the sensor
        truth[:, 2] = -STANDARD_GRAVITY * (end - start)
        was.append(np.sum(integral_error(segment, truth, start, end)[:, 1]))
        missed = missed_between(segment, start, end)
        assert missed[:, [0, 2, 3, 4, 5]].max() < 1e-5  # noise, at the most
        said.append(missed[:, 1].sum())
    assert np.mean(said) == pytest.approx(jump**2 * H**2 / 12.0, rel=0.02)
    # The mean square of n: by sqrt(0.8 / n) for an even spread, and four of these.
    assert np.mean(np.square(was)) == pytest.approx(np.mean(said), rel=0.15)


def test_a_turn_that_begins_between_samples_is_missed_likewise():
    rng = np.random.default_rng(2)
    t = np.arange(0.0, 6.0, H)
    w = 1e-3 * rng.normal(size=(len(t), 3))
    w[t > 3.0, 2] += 5.0
    missed = missed_between(segment_of(t, noise(rng, len(t)), w), *steps_of(t))
    assert missed[:, 5].sum() == pytest.approx(5.0**2 * H**2 / 12.0, rel=0.02)
    assert not missed[:, :5].any()


def test_what_is_smooth_is_not_missed():
    """Banked at 2 Hz, which is fast, at 25 samples a second: a fiftieth of what a jump costs."""
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 20.0, H)
    raw = noise(rng, len(t))
    raw[:, 1] += 5.0 * np.sin(2.0 * np.pi * 2.0 * t) * np.exp(-(((t - 10.0) / 1.0) ** 2))
    missed = missed_between(segment_of(t, raw, 1e-3 * rng.normal(size=(len(t), 3))), *steps_of(t))
    assert np.sqrt(missed.sum()) < 10.0 * H / np.sqrt(12.0) / 50.0


def test_noise_is_hardly_ever_taken_for_something_sudden():
    """And what is costs less than a third of what such noise walks by itself."""
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 2000.0, H)
    raw, w = noise(rng, len(t)), 1e-3 * rng.normal(size=(len(t), 3))
    missed = missed_between(segment_of(t, raw, w), *steps_of(t))
    assert np.count_nonzero(missed) <= 4  # 0.3 expected
    white = rng.normal(size=(len(t), 1))
    assert 36.0 / 240.0 * np.mean(misses(t, white) ** 2) < 1.0 / 3.0


def test_a_cubic_is_met_whatever_the_times_are():
    rng = np.random.default_rng(5)
    t = np.cumsum(rng.uniform(0.01, 0.1, size=200))
    x = np.column_stack([t**3 - 4.0 * t, 2.0 * t**2, np.ones_like(t)])
    assert np.abs(misses(t, x)).max() < 1e-9 * np.abs(x).max()


@pytest.mark.parametrize("n", [2, 4, 5])
def test_few_samples_say_nothing(n):
    t = H * np.arange(n)
    segment = segment_of(t, np.zeros((n, 3)), np.zeros((n, 3)))
    assert not missed_between(segment, t[:1], t[-1:]).any()


def test_what_samples_say_is_asked_once_and_of_other_samples_anew():
    rng = np.random.default_rng(7)
    t = np.arange(0.0, 4.0, 0.02)
    segment = segment_of(t, noise(rng, len(t)), 1e-3 * rng.normal(size=(len(t), 3)))
    asked = []

    def first(of):
        asked.append(of)
        return float(of.raw_s[0, 0])

    assert segment.once(first) == segment.once(first) == segment.raw_s[0, 0]
    other = replace(segment, raw_s=segment.raw_s + 1.0)
    assert other.once(first) == segment.raw_s[0, 0] + 1.0
    assert len(asked) == 2
