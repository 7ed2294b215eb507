"""Batches that follow on each other, joined: at once they are evaluated for less than in pieces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from onboard.core.inputs.segments import Batch, Fixes, Segment, Signal
from onboard.core.maths.arrays import Array


def continues(batch: Batch, before: Batch) -> bool:
    """Whether samples and fixes of a batch go on where those of the one before end."""
    a, b = before.segment, batch.segment
    at = float(before.fixes.t[-1])
    if batch.fresh or float(batch.fixes.t[0]) != at or a.slow.keys() != b.slow.keys():
        return False
    same = np.array_equal(a.R_bs, b.R_bs) and np.array_equal(a.lever_arm_b, b.lever_arm_b)
    # Of both, the samples around the fix that they share: a delay may have been told between them.
    i, j = int(np.searchsorted(a.t, at)), int(np.searchsorted(b.t, at))
    return (
        same
        and 0 < i < len(a.t)
        and j > 0
        and np.array_equal(a.t[i - 1 : i + 1], b.t[j - 1 : j + 1])
    )


def joined(batches: Sequence[Batch]) -> Segment:
    """One segment of batches of which each :func:`continues` the one before."""
    segments = [batch.segment for batch in batches]
    if len(segments) == 1:
        return segments[0]
    cuts = [float(batch.fixes.t[0]) for batch in batches[1:]]

    def parts(times: Callable[[Segment], Array]) -> list[slice]:
        """Of each segment what is between the fixes that it shares with its neighbours."""
        found = []
        for s, since, until in zip(segments, [None, *cuts], [*cuts, None], strict=True):
            t = times(s)
            first = 0 if since is None else int(np.searchsorted(t, since))
            last = len(t) if until is None else int(np.searchsorted(t, until))
            found.append(slice(first, last))
        return found

    def of(values: Callable[[Segment], Array], cut: Sequence[slice]) -> Array:
        return np.concatenate([values(s)[part] for s, part in zip(segments, cut, strict=True)])

    def signal(name: str) -> Signal:
        cut = parts(lambda s: s.slow[name][0])
        return of(lambda s: s.slow[name][0], cut), of(lambda s: s.slow[name][1], cut)

    own, attitude = parts(lambda s: s.t), parts(lambda s: s.t_attitude)
    return replace(
        segments[0],
        t=of(lambda s: s.t, own),
        w_b=of(lambda s: s.w_b, own),
        raw_s=of(lambda s: s.raw_s, own),
        t_attitude=of(lambda s: s.t_attitude, attitude),
        R_attitude=of(lambda s: s.R_attitude, attitude),
        slow={name: signal(name) for name in segments[0].slow},
    )


def fixes_of(each: Sequence[Fixes]) -> Fixes:
    """Fixes of such batches, each once."""
    if len(each) == 1:
        return each[0]

    def of(values: Callable[[Fixes], Array]) -> Array:
        first, *rest = (values(fixes) for fixes in each)
        return np.concatenate([first, *(x[1:] for x in rest)])

    return Fixes(
        of(lambda f: f.t),
        of(lambda f: f.v_n),
        of(lambda f: f.height),
        of(lambda f: f.latitude),
        of(lambda f: f.late),
    )
