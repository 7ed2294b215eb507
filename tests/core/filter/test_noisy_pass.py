"""Noise that is made goes through the filter as real noise does, and takes no part in the sums."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.going_through import through
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.filter.noise import USUAL
from onboard.core.filter.noisy_pass import NoisyPass, noise_like
from onboard.core.filter.passes import Pass
from onboard.core.filter.regressor_noise import sample_noise_density
from onboard.core.maths.blocks import total
from onboard.core.model.linearisation import SHAPES
from tests.core.estimate.test_simulated_flights import fed, flown

pytestmark = pytest.mark.slow
STRONG = replace(USUAL, force_walk=0.05, lift_walk=0.08, shaken_walk=0.01, shaken_lift=0.01)
"""By what the velocity walks; samples must be as noisy."""


@pytest.fixture(scope="module")
def engine():
    """With a flight whose samples have more noise than that, about a receiver that averages."""
    samples, _ = flown("copter", 75.0, seed=3)
    made = fed(samples, Calibrator(CalibratorSettings(refine=False))).engine(1)
    made._move(replace(made.point, window=0.2), made.noise)
    rng = np.random.default_rng(8)
    made.batches = [
        replace(
            b,
            segment=replace(
                b.segment, raw_s=b.segment.raw_s + rng.normal(0.0, 1.0, np.shape(b.segment.raw_s))
            ),
        )
        for b in made.batches
    ]
    return made


def gone(engine, made):
    return total([through(made, batch, 10.0).block for batch in engine.batches])


@pytest.fixture(scope="module")
def sums(engine):
    return gone(engine, NoisyPass(engine.model, engine.point, STRONG))


def test_all_else_is_as_without_it(engine, sums):
    plain = gone(engine, Pass(engine.model, engine.point, (STRONG,)))
    size = np.sqrt(np.maximum(np.diag(plain.N), 1e-12))
    np.testing.assert_allclose(
        sums.N / np.outer(size, size), plain.N / np.outer(size, size), atol=1e-7
    )
    np.testing.assert_allclose(sums.b / size, plain.b / size, rtol=1e-7, atol=1e-5)
    assert (sums.rows, sums.s) == (plain.rows, pytest.approx(plain.s, rel=1e-9))


def test_of_the_scales_it_is_what_is_worked_out(engine, sums):
    """By the kernel, which carries the covariance of the walk: of 75 s to a tenth."""
    plain = gone(engine, Pass(engine.model, engine.point, (STRONG,)))
    np.testing.assert_allclose(np.diag(sums.G)[:3], np.diag(plain.G)[:3], rtol=0.25)


def test_it_is_in_what_the_receiver_seems_to_average_too_and_in_nothing_else(engine, sums):
    made_of_samples = [engine.model.index[n] for n in ("scale_x", "gps_delay", "window_squared")]
    assert np.all(np.diag(sums.G)[made_of_samples] > 0.0)
    others = [i for n, i in engine.model.index.items() if n.startswith(("beta", "tilt", "antenna"))]
    assert not sums.G[others].any()
    np.testing.assert_array_equal(sums.G, sums.G.T)
    assert np.linalg.eigvalsh(sums.G).min() > -1e-9 * np.trace(sums.G)
    # An average takes from the velocity what the walk has just added: they go together.
    at = engine.model.index["window_squared"]
    together = sums.G[2, at] / np.sqrt(sums.G[2, 2] * sums.G[at, at])
    assert abs(together) > 0.05
    assert set(SHAPES) <= set(engine.model.index)


def test_it_is_as_strong_as_the_velocity_walks_and_always_the_same(engine):
    segment = engine.batches[2].segment
    noise = noise_like(segment, STRONG)
    found = sample_noise_density(segment.t, noise)
    walk = np.array([STRONG.force_walk, STRONG.force_walk, STRONG.lift_walk]) ** 2
    np.testing.assert_allclose(np.sqrt(found), np.sqrt(walk), rtol=0.3)
    np.testing.assert_array_equal(noise, noise_like(segment, STRONG))
