"""What an accelerometer felt, as its noisy samples let one expect it.

Vibration that is sampled too slowly is white noise in the samples.  In what the samples are
integrated to it is a random walk, which the filter knows; but the regressors are made of them, too,
and noise in regressors is no noise of the measurement.  It speaks for whatever makes the prediction
quieter: an average that no receiver takes, an antenna that is not where it is, a loop that lags.
What has no such preference is the expectation of the force given its samples, for what is then left
of the force is in no sum of samples (regression calibration: Carroll et al., *Measurement Error in
Nonlinear Models*, 2006, chapter 4).  Of noise with the density ``q`` in samples with the density
``S`` of each frequency it is the zero-phase filter ``1 - q / S`` (Wiener 1949, non-causal).

``S`` is measured over the flight.  ``q`` is the least of it at any frequency (:func:`white`), for
noise that is white to the end of the spectrum has no more than that, so that a tone adds nothing;
or the lesser of ``S`` and of its own level at each frequency (:func:`levelled`), where an
autopilot's low-pass has taken of noise and force alike.  Whether it is noise at all, samples do not
say: a vehicle that is really shaken, in turbulence or by its own motors, has a force as restless,
and its receiver agrees with every sum of it.  Noise makes the velocity that is integrated walk, so
that what the receiver finds of such a walk is what ``q`` is, but for what an average and a delay
that are fitted make of it.  Which of them it is, and how much, is for the likelihood of what the
receiver says to decide (:mod:`onboard.core.diagnosis.felt`).

A *tone* is the other kind (:mod:`onboard.core.inputs.tones`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from onboard.core.inputs.joined import joined, runs, times, with_samples, with_signal
from onboard.core.inputs.limits import (
    DROWNED,
    FLOOR_BINS,
    RESOLVED_S,
    SPECTRUM_BINS,
)
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array

TAKEN = "noise_taken"
"""The slow signal of what more noise would take off the samples."""


def spectrum(batches: Sequence[Batch]) -> Array | None:
    """Two-sided densities (bins, 3) of the samples of a flight, (m/s^2)^2 s, by frequency.

    None if they are too few to tell.
    """
    step = step_of(batches)
    count, found = 0, np.zeros(1)
    for run in runs(batches):
        for p in periodograms(joined(run)[1], step):
            count, found = count + 1, found + p
    return found / count if count else None


def step_of(batches: Sequence[Batch]) -> float:
    """Time between samples, s; 1 of no samples."""
    steps = [np.diff(times(run)) for run in runs(batches)] or [np.ones(1)]
    return float(np.median(np.concatenate(steps)))


def white(density: Array) -> Array:
    """(3,) density that white noise may have at the most, of a spectrum (bins, 3)."""
    out: Array = averaged(density, FLOOR_BINS).min(axis=0)
    return out


def drowned(batches: Sequence[Batch], density: Array) -> bool:
    """Whether most of an axis' force at the frequencies that the fixes follow may be noise.

    A latency, an average and an antenna are told by what of the force lies there, and a hover has
    next to nothing there: noise too small to be seen in the velocity is then what tells them.

    Args:
        batches: the flight.
        density: (bins, 3) of its samples.
    """
    steps, fixes = (
        float(np.median(np.concatenate([np.diff(t) for t in times_] or [np.ones(1)])))
        for times_ in ([times(run) for run in runs(batches)], [b.fixes.t for b in batches])
    )
    if not (steps > 0.0 and fixes > 0.0):
        return False
    f = np.linspace(0.0, 0.5 / steps, len(density))
    followed = (f > 0.0) & (f <= 0.5 / fixes)
    there = averaged(density, SPECTRUM_BINS)[followed]
    share = white(density) / np.where(there > 0.0, there, np.inf)
    return bool(len(share) and np.any(share.mean(axis=0) > DROWNED))


def expected(batches: Sequence[Batch], density: Array, noise: Array) -> list[Batch]:
    """The same flight with the expectation of the force in the place of its samples.

    Args:
        batches: the flight.
        density: (bins, 3) of its samples.
        noise: (3,) density of what of them is white noise, or (bins, 3) by frequency.
    """
    gain = _gain(density, noise)
    return with_samples(batches, lambda _, raw: _filtered(raw, gain))


def levelled(batches: Sequence[Batch], density: Array, level: Array) -> list[Batch]:
    """The same of white noise that a low-pass has shaped, and what more of it would take.

    Args:
        batches: the flight.
        density: (bins, 3) of its samples.
        level: (3,) density of the noise where no low-pass takes of it.

    Returns:
        The flight; its segments have what a level e times as high would take off their samples, to
        first order, as a slow signal :data:`TAKEN`, m/s^2, sensor axes.
    """
    there = averaged(density, SPECTRUM_BINS)
    # Where nothing is left, more noise takes nothing more.
    more = np.divide(level, there, out=np.zeros_like(there), where=level < there)
    more[0] = 0.0  # of the mean
    doubted = with_signal(batches, TAKEN, lambda raw: _filtered(raw - raw.mean(axis=0), more))
    return expected(doubted, density, np.minimum(there, level))


def periodograms(raw: Array, step: float) -> Iterator[Array]:
    """Two-sided densities (bins, 3), (m/s^2)^2 s, of stretches that overlap by half (Welch)."""
    n = samples_of_stretch(step)
    window = np.sin(np.pi * np.arange(n) / n)[:, None] ** 2
    for i in stretches(len(raw), n):
        piece = raw[i : i + n] - raw[i : i + n].mean(axis=0)
        yield np.abs(np.fft.rfft(piece * window, axis=0)) ** 2 * (step / np.sum(window**2))


def samples_of_stretch(step: float) -> int:
    """How many a stretch of a spectrum has; they are a ``step`` apart, s."""
    return 2 * round(RESOLVED_S / step / 2.0)


def stretches(count: int, n: int) -> range:
    """Where those of ``n`` samples begin, each half of one after the other, among ``count``."""
    return range(0, count - n + 1, max(n // 2, 1))


def _gain(density: Array, noise: Array) -> Array:
    """(bins, 3) of the filter."""
    there = averaged(density, SPECTRUM_BINS)
    share = np.divide(noise, there, out=np.zeros_like(there), where=there > 0.0)
    gain: Array = np.clip(1.0 - share, 0.0, 1.0)
    gain[0] = 1.0  # of the mean
    return gain


def averaged(density: Array, bins: int) -> Array:
    """The mean over an odd number of bins, at either end of those that there are."""
    padded = np.pad(density, ((bins // 2, bins // 2), (0, 0)), mode="reflect")
    out: Array = np.lib.stride_tricks.sliding_window_view(padded, bins, axis=0).mean(axis=-1)
    return out


def _filtered(raw: Array, gain: Array) -> Array:
    """The filter over samples (n, 3), mirrored at either end."""
    n = len(raw)
    mean = raw.mean(axis=0)
    spectrum = np.fft.rfft(np.concatenate([raw, raw[::-1]]) - mean, axis=0)
    at, of = np.linspace(0.0, 1.0, len(spectrum)), np.linspace(0.0, 1.0, len(gain))
    spectrum *= np.stack([np.interp(at, of, g) for g in gain.T], axis=-1)
    out: Array = np.fft.irfft(spectrum, 2 * n, axis=0)[:n] + mean
    return out
