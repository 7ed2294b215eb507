"""Samples of a flight one after the other: segments overlap, and each sample counts once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from onboard.core.inputs.segments import Batch, Segment
from onboard.core.maths.arrays import Array


def with_samples(batches: Sequence[Batch], changed: Callable[[Array, Array], Array]) -> list[Batch]:
    """The same flight with other samples.

    Args:
        batches: the flight.
        changed: times (n,), s, and raw force (n, 3) of samples that follow on each other, to that
            force changed; the very same array where nothing is.
    """
    made: dict[int, Segment] = {}
    for run in runs(batches):
        t, raw = joined(run)
        now = changed(t, raw)
        if now is raw:
            continue
        for s in (batch.segment for batch in run):
            made[id(s)] = replace(s, raw_s=now[np.searchsorted(t, s.t)])
    return [
        replace(b, segment=made[id(b.segment)]) if id(b.segment) in made else b for b in batches
    ]


def with_signal(
    batches: Sequence[Batch], name: str, made_of: Callable[[Array], Array]
) -> list[Batch]:
    """The same flight with a slow signal that is made of its samples.

    Args:
        batches: the flight.
        name: of the signal.
        made_of: raw force (n, 3) of samples that follow on each other, to the signal (n, k).

    Of samples that follow on each other in a segment, too, it has a part of the signal and no copy.
    """
    made: dict[int, Segment] = {}
    for run in runs(batches):
        t, raw = joined(run)
        signal = made_of(raw)
        for s in (batch.segment for batch in run):
            # Of each segment by itself: all of a day would be looked through for each.
            at = np.searchsorted(t, s.t)
            row = at[-1] - at[0] + 1 == len(at) and bool(np.all(np.diff(at) == 1))
            own = signal[at[0] : at[-1] + 1] if row else signal[at]
            made[id(s)] = s.with_slow(s.slow | {name: (s.t, own)})
    return [replace(b, segment=made[id(b.segment)]) for b in batches]


def runs(batches: Sequence[Batch]) -> Iterator[list[Batch]]:
    """Batches whose samples follow on each other."""
    run: list[Batch] = []
    for batch in batches:
        t = batch.segment.t
        if run and not (run[-1].segment.t[0] <= t[0] <= run[-1].segment.t[-1]):
            yield run
            run = []
        run.append(batch)
    if run:
        yield run


def joined(run: Sequence[Batch]) -> tuple[Array, Array]:
    """Samples of all segments, each once: times (n,), s, and raw force (n, 3)."""
    raw = [b.segment.raw_s[i:] for b, i in zip(run, _new(run), strict=True)]
    return times(run), np.concatenate(raw)


def times(run: Sequence[Batch]) -> Array:
    """(n,) s, those of the samples of all segments, each once."""
    return np.concatenate([b.segment.t[i:] for b, i in zip(run, _new(run), strict=True)])


def _new(run: Sequence[Batch]) -> Iterator[int]:
    """From which of its samples on a segment goes on where those before it end."""
    last = -np.inf
    for t in (batch.segment.t for batch in run):
        yield int(np.searchsorted(t, last, side="right"))
        last = max(last, float(t[-1]))
