"""How much the force shakes, and that a flight tells what of it the velocity walks by."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.filter.limits import SHAKING_S
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.shaking import shaken_between, squares_so_far, walk_of, walked
from onboard.core.inputs.samples import ImuSample
from tests.core.estimate.test_simulated_flights import assert_true, fed, flown
from tests.core.filter.test_missed import R_BS, H, segment_of, steps_of

SIGMA, HALF_S = 1.0, 15.0
"""Of the noise that is added to half of the samples, m/s^2; for so long each time."""


def test_samples_that_know_nothing_of_each_other_walk_by_their_variance_and_their_spacing():
    """The mean around a sample has it in itself: one of as many as there are in a second."""
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 2000.0, H)
    raw = rng.normal(size=(len(t), 3)) * [1.0, 2.0, 0.5]
    start, end = steps_of(t)
    shaken = shaken_between(segment_of(t, raw, np.zeros_like(raw)), start, end).sum(axis=0)
    of_body = np.abs(R_BS) @ [1.0, 4.0, 0.25]
    np.testing.assert_allclose(
        shaken / (end[-1] - start[0]), of_body * (1.0 - H / SHAKING_S), rtol=0.03
    )
    # What such samples are summed up to walks by their variance times h.
    velocity = np.cumsum(raw * H, axis=0)[:: round(2.0 / H)]
    says = walk_of(NoiseLevels(force_walk=0.0, shake=np.sqrt(H)), shaken, end[-1] - start[0])
    np.testing.assert_allclose(
        np.abs(R_BS) @ np.var(np.diff(velocity, axis=0), axis=0) / 2.0, says, rtol=0.15
    )


def test_what_is_flown_is_no_shaking():
    """A turn of ten seconds to and fro is none; twice a second to and fro nearly all is."""
    t = np.arange(0.0, 100.0, H)
    slow, fast = (np.sin(2.0 * np.pi * f * t)[:, None] for f in (0.1, 2.0))
    assert squares_so_far(t, slow)[-1] < 1e-3 * 50.0
    assert squares_so_far(t, fast)[-1] == pytest.approx(50.0, rel=0.02)
    assert squares_so_far(t, np.ones_like(slow))[-1] < 1e-12


def test_pieces_add_up_and_one_sample_tells_nothing():
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.5 * H, 1.5 * H, size=500))
    segment = segment_of(t, rng.normal(size=(500, 3)), np.zeros((500, 3)))
    edges = np.linspace(t[0], t[-1], 7)
    pieces = shaken_between(segment, edges[:-1], edges[1:])
    whole = shaken_between(segment, t[:1], t[-1:])
    assert np.all(pieces > 0.0)
    np.testing.assert_allclose(pieces.sum(axis=0), whole[0], rtol=1e-12)
    levels = NoiseLevels(force_walk=0.1, shake=0.3)
    np.testing.assert_allclose(
        np.abs(R_BS) @ walked(levels, (segment,)), walk_of(levels, whole[0], t[-1] - t[0])
    )
    alone = segment_of(t[:1], np.ones((1, 3)), np.zeros((1, 3)))
    assert not shaken_between(alone, t[:1], t[:1]).any()
    np.testing.assert_allclose(walked(levels, (alone,)), 0.01)


@pytest.mark.slow
def test_a_flight_that_is_shaken_now_and_then_tells_by_how_much():
    """White noise in every other quarter of a minute: the calm ones keep their own walk."""
    rng = np.random.default_rng(3)
    samples, _ = flown("copter", 150.0, seed=5)

    def shaken(sample):
        if not isinstance(sample, ImuSample) or int(sample.t / HALF_S) % 2:
            return sample
        return replace(sample, f_b=tuple(np.array(sample.f_b) + SIGMA * rng.normal(size=3)))

    def levels_and_answer(of):
        made = fed(of, Calibrator())
        return made.engine(1).noise, made.calibration(1)

    t = [s.t for s in samples if isinstance(s, ImuSample)]
    h = float(np.median(np.diff(t)))
    calm, _ = levels_and_answer(samples)
    levels, got = levels_and_answer([shaken(s) for s in samples])
    assert levels.shake == pytest.approx(np.sqrt(h), rel=0.3)
    # A walk all along the flight would be the root mean square: half of the time there is none.
    assert levels.force_walk < 0.25 * SIGMA * np.sqrt(h / 2.0)
    assert calm.shake <= NoiseLevels().shake  # where nothing shakes, nothing is asked for
    assert_true(got, 0.03, 0.3)
