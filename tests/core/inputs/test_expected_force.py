"""The expectation of a force given noisy samples: what is left of it is in no sum of samples."""

from itertools import pairwise

import numpy as np
import pytest

from onboard.core.inputs.expected_force import (
    TAKEN,
    drowned,
    expected,
    levelled,
    spectrum,
    white,
)
from onboard.core.inputs.segments import Batch, Fixes, Segment

STEP, SECONDS = 0.02, 240.0
T = np.arange(0.0, SECONDS, STEP)
NOTHING = 0.01
"""m/s/sqrt(s) of random walk that matters to nobody."""


def manoeuvre(seed=0):
    """(n, 3) m/s^2: smooth noise below half a Hertz, as large as a copter's."""
    rng = np.random.default_rng(seed)
    spectrum = np.fft.rfft(rng.normal(size=(len(T), 3)), axis=0)
    f = np.fft.rfftfreq(len(T), STEP)[:, None]
    x = np.fft.irfft(spectrum / (1.0 + (f / 0.3) ** 4), len(T), axis=0)
    return 2.0 * x / x.std(axis=0) + [0.0, 0.0, -9.8]


def batches(raw, pieces=8, gap=()):
    """A flight in segments that overlap by half a second."""
    edges, out = np.linspace(0, len(T), pieces + 1).astype(int).tolist(), []
    for k, (i, j) in enumerate(pairwise(edges)):
        first = i if k in gap else max(i - 25, 0)
        last = j if k + 1 in gap else min(j + 25, len(T))
        cut = slice(first, last)
        segment = Segment(
            T[cut],
            np.zeros((len(T[cut]), 3)),
            raw[cut],
            np.zeros(0),
            np.zeros((0, 3, 3)),
            np.eye(3),
        )
        fixes = Fixes(T[i:j:10], np.zeros((len(T[i:j:10]), 3)), *np.zeros((2, len(T[i:j:10]))))
        out.append(Batch(segment, fixes, np.ones(len(fixes), bool), fresh=k == 0 or k in gap))
    return out


def of_noise(flight):
    """What is expected of the force given the samples."""
    density = spectrum(flight)
    return expected(flight, density, white(density))


def felt(made):
    """(n, 3) of all segments, each time once."""
    out = np.full((len(T), 3), np.nan)
    for b in made:
        out[np.round(b.segment.t / STEP).astype(int)] = b.segment.raw_s
    return out


def test_what_is_left_is_in_no_sum_of_what_is_expected():
    """Of samples it is: their noise times itself.  At lags that a latency or an average reaches."""
    rng = np.random.default_rng(1)
    f, sigma = manoeuvre(), np.array([0.25, 0.65, 0.2])
    samples = f + sigma * rng.normal(size=f.shape)
    got = felt(of_noise(batches(samples)))
    for lag in (0, 5, 10, 25):
        left = (f - got)[lag:] * (got - got.mean(axis=0))[: len(got) - lag]
        bias = left.mean(axis=0) / sigma**2
        assert np.abs(bias).max() < 0.1, lag
    assert np.allclose(
        ((f - samples) * (samples - f.mean(axis=0))).mean(axis=0) / sigma**2, -1.0, atol=0.1
    )
    assert np.all((f - got).std(axis=0) < 0.5 * sigma)


def test_noise_that_a_low_pass_has_shaped_goes_by_what_the_velocity_walks():
    """An autopilot's low-pass leaves none of it at the end of the spectrum, where white() looks."""
    rng, sigma, pole = np.random.default_rng(4), 0.65, np.exp(-2.0 * np.pi * 4.0 * STEP)
    f = manoeuvre()
    noise = sigma * rng.normal(size=f.shape)
    for _ in range(3):
        noise = slowed(noise, pole)
    flight = batches(f + noise)
    density, walk = spectrum(flight), np.full(3, sigma**2 * STEP)
    assert np.all(white(density) < 0.05 * walk)
    left, before = (
        (felt(made) - f).std(axis=0)
        for made in (levelled(flight, density, walk), expected(flight, density, white(density)))
    )
    assert np.all(left < 0.6 * before)
    assert np.all(before > 0.9 * noise.std(axis=0))
    # No more is taken than the velocity walks by.
    little = levelled(flight, density, 0.01 * walk)
    assert np.all((felt(little) - f - noise).var(axis=0) < 0.01 * walk / STEP)


def test_what_more_noise_would_take_is_the_derivative_of_what_is_expected():
    flight = batches(manoeuvre() + 0.3 * np.random.default_rng(5).normal(size=(len(T), 3)))
    density, little = spectrum(flight), 1e-4
    level = white(density) * [0.3, 0.6, 0.9]  # below the least of it: no frequency is all noise
    at, above, below = (
        levelled(flight, density, level * by) for by in (1.0, np.exp(little), np.exp(-little))
    )
    slope = (felt(above) - felt(below)) / (2.0 * little)
    for b in at:
        t, taken = b.segment.slow[TAKEN]
        here = np.round(t / STEP).astype(int)
        assert taken == pytest.approx(-slope[here], rel=1e-3, abs=1e-5)
    # Of no noise at all more is none, and where nothing is left more takes nothing.
    for nothing in (np.zeros(3), 1.1 * density.max(axis=0)):
        for b in levelled(flight, density, nothing):
            assert np.abs(b.segment.slow[TAKEN][1]).max() < 1e-9


def slowed(x, pole):
    """Samples (n, 3) through a first-order low-pass."""
    out, y = np.empty_like(x), np.zeros(x.shape[1])
    for i, row in enumerate(x):
        y = pole * y + (1.0 - pole) * row
        out[i] = y
    return out


def test_quiet_samples_have_next_to_no_noise():
    flight = batches(manoeuvre() + 0.005 * np.random.default_rng(2).normal(size=(len(T), 3)))
    assert np.all(white(spectrum(flight)) < NOTHING**2)


def test_a_tone_is_no_white_noise():
    """A rotor's beat at 7 Hz, strong as it is, takes nothing from the manoeuvre."""
    f = manoeuvre()
    tone = 1.5 * np.sin(2.0 * np.pi * 7.0 * T)[:, None]
    noise = 0.15 * np.random.default_rng(3).normal(size=f.shape)
    got = felt(of_noise(batches(f + tone + noise)))
    smooth = [np.convolve(x[:, 0], np.ones(50) / 50.0, "valid") for x in (got, f)]
    assert np.std(smooth[0] - smooth[1]) < 0.05


@pytest.mark.parametrize("gap", [(), (3,), (3, 4)])
def test_segments_that_overlap_have_the_same_force_where_they_do(gap):
    samples = manoeuvre() + 0.4 * np.random.default_rng(4).normal(size=(len(T), 3))
    made = of_noise(batches(samples, gap=gap))
    for a, b in pairwise(made):
        both, i, j = np.intersect1d(a.segment.t, b.segment.t, return_indices=True)
        np.testing.assert_array_equal(a.segment.raw_s[i], b.segment.raw_s[j])
        assert len(both) or b.fresh


def test_a_flight_too_short_for_a_spectrum_is_left_as_it_is():
    samples = manoeuvre() + np.random.default_rng(5).normal(size=(len(T), 3))
    assert spectrum(batches(samples, pieces=24)[:1]) is None
    assert spectrum([]) is None


def test_white_noise_is_found_a_little_smaller_than_it_is():
    """The least of a spectrum that scatters is below its mean, and never above it."""
    sigma = np.array([0.1, 0.3, 0.9])
    samples = manoeuvre() + sigma * np.random.default_rng(6).normal(size=(len(T), 3))
    share = white(spectrum(batches(samples))) / (sigma**2 * STEP)
    assert np.all((share > 0.75) & (share < 1.0))


@pytest.mark.parametrize("size", [1.0, 0.0])
@pytest.mark.parametrize("sigma", [0.0, 0.02, 0.2])
def test_noise_drowns_a_force_that_changes_no_more_than_it(size, sigma):
    force = size * manoeuvre()
    # A smooth manoeuvre has next to nothing at the frequencies of fixes but what shakes the air.
    shaking = np.random.default_rng(3).normal(size=force.shape)
    shaking = np.apply_along_axis(np.convolve, 0, shaking, np.ones(5) / 5.0, "same")
    rng = np.random.default_rng(2)
    flight = batches(force + size * shaking + sigma * rng.normal(size=force.shape))
    assert drowned(flight, spectrum(flight)) == (size == 0.0 and sigma > 0.0)
