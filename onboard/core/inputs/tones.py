"""Tones in the samples, each for as long as it stands out.

A rotor that is governed, or a motor at constant speed, beats at one frequency, and sampled more
slowly than that it has another one, at which a vehicle may fly.  Its samples are no force there
(:mod:`onboard.core.inputs.expected_force`), and what is noise of them is what a line of the
spectrum has on top of what lies beside it.  A vehicle that really swings has such a line, too.

A motor that changes its speed has one line after the other, and over the flight none of them may
stand out.  Lines are looked for over the whole flight, and over each few stretches of it that
follow on each other; what goes on from one to the next is one tone.  A landing has its own speed of
the rotors, and a loiter its own swing: of each tone by itself it is asked whose it is
(:mod:`onboard.core.diagnosis.toneless`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from onboard.core.inputs.expected_force import (
    averaged,
    periodograms,
    samples_of_stretch,
    step_of,
    stretches,
)
from onboard.core.inputs.joined import joined, runs, times, with_samples, with_signal
from onboard.core.inputs.limits import (
    SPECTRUM_BINS,
    TONE_BESIDE,
    TONE_BINS,
    TONE_STANDS_OUT,
    TONE_STRETCHES,
)
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array

PARTS = "tones"
"""The slow signal of what tones have of the samples."""


@dataclass(frozen=True, slots=True)
class Line:
    """Of a spectrum, from one of its bins on: density (b,), and what share of all there it is."""

    first: int
    density: Array
    share: Array

    @property
    def bins(self) -> slice:
        """Those that it has."""
        return slice(self.first, self.first + len(self.density))

    def dense(self, bins: int) -> Array:
        """(bins,) its share."""
        out = np.zeros(bins)
        out[self.bins] = self.share
        return out


class Kind(IntEnum):
    """Of a tone: of a part of the flight, of all of it, or of a part and not quite steady.

    They are asked about in this order, and the numbers mean nothing else.
    """

    PART = 0
    WHOLE = 1
    RESTLESS = 2


WIDE = {Kind.PART: 1, Kind.RESTLESS: 2}
"""Times as wide as narrow ones: how far off what lies beside begins; where it ends, as a power."""


@dataclass(slots=True)
class Tone:
    """Lines of one axis by the stretches of a flight, and the variance of the velocity if real.

    The ``kind`` of which nothing is left of the others comes last.
    """

    axis: int
    kind: Kind
    lines: dict[int, Line] = field(default_factory=dict)
    swung: list[float] = field(default_factory=list)

    @property
    def variance(self) -> float:
        """(m/s)^2, of the velocity that it would be while it lasts."""
        return float(np.mean(self.swung))


def tones_of(batches: Sequence[Batch]) -> list[Tone]:
    """Every tone of a flight: those of its parts, and those of it as a whole."""
    step, count = step_of(batches), 0
    total, last = np.zeros(1), list[Array]()
    found: dict[Kind, list[Tone]] = {kind: [] for kind in WIDE}
    for density in _stretches(batches, step):
        total, count = total + density, count + 1
        last = [*last[-TONE_STRETCHES + 1 :], density]
        if len(last) == TONE_STRETCHES:
            # At either end of a flight there are no other neighbours.
            at = [count - 2] if count > TONE_STRETCHES else [0, 1]
            mean = np.mean(last, axis=0)
            for kind, tones in found.items():
                _go_on(tones, kind, _lines(mean, WIDE[kind]), at, step)
    every = [tone for tones in found.values() for tone in tones]
    if count >= TONE_STRETCHES:
        for tone in [tone for tone in every if count - 2 in tone.lines]:
            tone.lines[count - 1] = tone.lines[count - 2]
    if not count:
        return []
    if count <= TONE_STRETCHES:  # those of parts are those of the whole
        every = found[Kind.RESTLESS]
    return [*every, *_of_the_whole(total / count, count, step)]


def tones(density: Array, wide: int = 1) -> Array:
    """(bins, 3) density that narrow lines of a spectrum (bins, 3) have on top of what is beside.

    Those of a motor that is restless are a number of times as ``wide``.
    """
    there = averaged(density, SPECTRUM_BINS)
    out, n = np.zeros_like(there), len(there)
    apart, ratio = wide * TONE_BINS, TONE_BESIDE**wide
    # Slower ones have nothing beside them that the window does not smear them into.
    i = np.arange(math.ceil(apart / (1.0 - 1.0 / ratio)), n)
    if not len(i):
        return out
    sums = np.concatenate([np.zeros((1, there.shape[1])), np.cumsum(there, axis=0)])
    low = np.ceil(i / ratio).astype(int), i - apart + 1
    high = np.minimum(i + apart, n), np.minimum(np.floor(i * ratio).astype(int) + 1, n)
    below, above = ((sums[b] - sums[a]) / np.maximum(b - a, 1)[:, None] for a, b in (low, high))
    beside = np.maximum(below, above) if wide == 1 else np.sqrt(below * above)
    out[i] = np.where(there[i] > TONE_STANDS_OUT * beside, there[i] - beside, 0.0)
    return out


def without(batches: Sequence[Batch], tones: Sequence[Tone]) -> list[Batch]:
    """The same flight with the expectation of the force where its samples have tones."""
    half = samples_of_stretch(step_of(batches)) // 2
    shares = _shares(tones, half + 1)
    first = 0

    def changed(_: Array, raw: Array) -> Array:
        nonlocal first
        here = _stretches_in(raw, half, first)
        first += _count(raw, half)
        parts = [
            [(a, a, s) for a, s in enumerate(shares[k].T)] if k in shares else [] for k in here
        ]
        return raw - _taken(raw, half, parts, 3) if any(parts) else raw

    return with_samples(batches, changed)


def with_parts(batches: Sequence[Batch], tones: Sequence[Tone]) -> list[Batch]:
    """The same flight with what each tone has of the samples as a slow signal :data:`PARTS`.

    Its columns are the tones, m/s^2 along the axis of each.
    """
    half = samples_of_stretch(step_of(batches)) // 2
    first = 0

    def made_of(raw: Array) -> Array:
        nonlocal first
        here = _stretches_in(raw, half, first)
        first += _count(raw, half)
        parts = [
            [(i, x.axis, x.lines[k].dense(half + 1)) for i, x in enumerate(tones) if k in x.lines]
            for k in here
        ]
        # A ten millionth of a tone matters to nobody, columns of every sample of a flight do.
        return _taken(raw, half, parts, len(tones), single=True)

    return with_signal(batches, PARTS, made_of)


def density_of(tones: Sequence[Tone], density: Array, count: int) -> Array:
    """(bins, 3) of what tones have in the mean of all stretches, at most what there is."""
    out = np.zeros_like(density)
    for k in {k for tone in tones for k in tone.lines}:
        most = np.zeros_like(density)
        for tone in tones:
            if k in tone.lines:
                line = tone.lines[k]
                at = most[line.bins, tone.axis]
                most[line.bins, tone.axis] = np.maximum(at, line.density)
        out += most / count
    return out


def stretches_of(batches: Sequence[Batch]) -> int:
    """How many there are in a flight."""
    n = samples_of_stretch(step_of(batches))
    return sum(len(stretches(len(times(run)), n)) for run in runs(batches))


def _stretches(batches: Sequence[Batch], step: float) -> Iterator[Array]:
    """Densities (bins, 3) of each."""
    for run in runs(batches):
        yield from periodograms(joined(run)[1], step)


def _lines(density: Array, wide: int = 1) -> list[tuple[int, Line]]:
    """Axes and lines of a spectrum."""
    there, tone = averaged(density, SPECTRUM_BINS), tones(density, wide)
    out = []
    for axis in range(3):
        bins = np.flatnonzero(tone[:, axis])
        for at in np.split(bins, np.flatnonzero(np.diff(bins) > 1) + 1) if len(bins) else []:
            own = tone[at, axis]
            out.append((axis, Line(int(at[0]), own, own / there[at, axis])))
    return out


def _variance(line: Line, step: float) -> float:
    """(m/s)^2, of the velocity that a line would be."""
    apart = 1.0 / (samples_of_stretch(step) * step)
    f = apart * (line.first + np.arange(len(line.density)))
    return float(np.sum(2.0 * apart * line.density / (2.0 * np.pi * f) ** 2))


def _go_on(
    found: list[Tone], kind: Kind, lines: Sequence[tuple[int, Line]], at: Sequence[int], step: float
) -> None:
    """Lines of some stretches, each with the tone that it is the next of, or a new one."""
    before = at[0] - 1
    going = [tone for tone in found if before in tone.lines]
    for axis, line in lines:
        for tone in going:
            old = tone.lines[before]
            apart = max(line.first - old.bins.stop, old.first - line.bins.stop) + 1
            if tone.axis == axis and apart <= TONE_BINS and at[0] not in tone.lines:
                break
        else:
            tone = Tone(axis, kind)
            found.append(tone)
        tone.lines.update(dict.fromkeys(at, line))
        tone.swung.append(_variance(line, step))


def _of_the_whole(density: Array, count: int, step: float) -> Iterator[Tone]:
    """Tones that the spectrum of a flight has."""
    for axis, line in _lines(density):
        swung = [_variance(line, step)]
        yield Tone(axis, Kind.WHOLE, lines=dict.fromkeys(range(count), line), swung=swung)


def _shares(tones: Sequence[Tone], bins: int) -> dict[int, Array]:
    """(bins, 3) of the force in a stretch that is no force, where that is any."""
    out: dict[int, Array] = {}
    for tone in tones:
        for k, line in tone.lines.items():
            share = out.setdefault(k, np.zeros((bins, 3)))
            at = share[line.bins, tone.axis]
            share[line.bins, tone.axis] = np.maximum(at, line.share)
    return out


def _count(raw: Array, half: int) -> int:
    """How many stretches the samples of a run have; too few samples have none."""
    return max(len(raw) // half - 1, 0)


def _stretches_in(raw: Array, half: int, first: int) -> range:
    """Which stretches of the flight the samples of a run are; or else the next one is nearest."""
    return range(first, first + max(_count(raw, half), 1))


def _taken(
    raw: Array,
    half: int,
    parts: Sequence[Sequence[tuple[int, int, Array]]],
    columns: int,
    *,
    single: bool = False,
) -> Array:
    """(n, columns) shares of each stretch of samples (n, 3), faded from one to the next.

    What is filtered is as long again before and after, so that nothing comes in from the far end.

    Args:
        raw: the samples.
        half: of a stretch, samples.
        parts: of each stretch: the column, of which axis it is, and its share (half + 1,) by bin.
        columns: how many.
        single: whether in single precision.
    """
    n, count = 2 * half, len(raw)
    window = np.sin(np.pi * np.arange(n) / n)[:, None] ** 2
    out: Array = np.zeros((count + 4 * n, columns), dtype=np.float32 if single else np.float64)
    longer = np.pad(raw, ((n, 2 * n), (0, 0)), mode="reflect" if count > 1 else "edge")
    for j in range(-1, math.ceil(count / half)):
        here = parts[min(max(j, 0), len(parts) - 1)]
        if not here:
            continue
        piece = longer[n + j * half : 2 * n + j * half]
        spectrum = np.fft.rfft(
            np.pad((piece - piece.mean(axis=0)) * window, ((half, half), (0, 0))), axis=0
        )
        at = np.arange(len(spectrum)) / 2.0
        for column, axis, share in here:
            kept = spectrum[:, axis] * np.interp(at, np.arange(len(share)), share)
            out[n + j * half : 3 * n + j * half, column] += np.fft.irfft(kept, 2 * n)
    return out[n + half : n + half + count]
