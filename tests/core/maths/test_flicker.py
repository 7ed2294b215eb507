"""Flicker noise as cosines, against noise that is made of its spectrum."""

import numpy as np

from onboard.core.maths.flicker import MEANS_APART, waves, waves_variance

N, SPAN = 2**14, 2**9
"""Samples of a long stretch, and of a flight within it."""


def made(rng):
    """(N,) of unit instability, periodic, without its mean: a sum of its frequencies."""
    f = np.fft.rfftfreq(N)[1:]
    sigma = np.sqrt(2.0 / (2.0 * np.pi * f) / N)  # both sides of the density
    z = (rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f))) * sigma
    return np.fft.irfft(np.concatenate([[0.0], 0.5 * N * z]), N)


def test_cosines_have_no_mean_and_unit_mean_square():
    t = np.linspace(100.0, 300.0, 4001)
    c = waves(0.5 * (t[1:] + t[:-1]), 100.0, 300.0, 6)
    assert np.allclose(c.mean(axis=0), 0.0, atol=1e-6)
    assert np.allclose(c.T @ c / len(c), np.eye(6), atol=1e-5)


def test_amplitudes_of_flicker_noise_have_the_variances():
    rng, count = np.random.default_rng(5), 8
    t = (np.arange(SPAN) + 0.5) / SPAN
    c = waves(t, 0.0, 1.0, count)
    parts = np.concatenate([made(rng).reshape(-1, SPAN)[4:-4] for _ in range(60)])
    amplitudes = parts @ c / SPAN
    ratio = amplitudes.var(axis=0) / waves_variance(count)
    assert np.all(np.abs(ratio[2:] - 1.0) < 0.15), ratio
    assert np.all((ratio[:2] > 0.7) & (ratio[:2] < 1.0)), ratio
    C = np.corrcoef(amplitudes.T) - np.eye(count)
    assert np.max(np.abs(C)) < 0.3


def test_means_of_neighbouring_spans_differ_as_allan_has_it():
    rng = np.random.default_rng(6)
    means = np.concatenate([np.diff(made(rng).reshape(-1, SPAN).mean(axis=1)) for _ in range(200)])
    assert abs(means.var() / MEANS_APART - 1.0) < 0.1
