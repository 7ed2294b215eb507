"""Batches of a flight out of arrays, as an engine keeps them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from onboard.core.inputs.segments import Batch, Fixes, Segment

G = 9.80665
AROUND_S = 0.1
"""Samples around the fixes of a batch: neighbours overlap."""


def batches(
    raw,
    *,
    rate: float = 50.0,
    fix_rate: float = 5.0,
    length_s: float = 10.0,
    t0: float = 100.0,
    slow: Mapping[str, tuple[np.ndarray, np.ndarray]] | None = None,
    R_bs=None,
):
    """A flight cut into batches of ``length_s``; each begins at the last fix of the one before.

    Args:
        raw: (n, 3) raw specific force.
        rate: of the samples, Hz.
        fix_rate: of the fixes, Hz.
        length_s: of a batch.
        t0: first sample, s on the boot clock.
        slow: slow signals of the whole flight; a batch gets what lies in its time.
        R_bs: board orientation.
    """
    t = t0 + np.arange(len(raw)) / rate
    stamps = np.arange(t0 + AROUND_S, t[-1] - AROUND_S, 1.0 / fix_rate)
    per = round(length_s * fix_rate)
    out = []
    for first in range(0, len(stamps) - 1, per):
        at = stamps[first : first + per + 1]
        n = len(at)
        begin, end = at[0] - AROUND_S, at[-1] + AROUND_S
        inside = (t >= begin) & (t < end)
        signals = {}
        for name, (ts, xs) in (slow or {}).items():
            near = (ts >= begin) & (ts <= end)
            if near.any():
                signals[name] = (ts[near], xs[near])
        segment = Segment(
            t[inside],
            np.zeros((inside.sum(), 3)),
            np.asarray(raw)[inside],
            at,
            np.broadcast_to(np.eye(3), (n, 3, 3)),
            np.eye(3) if R_bs is None else R_bs,
            slow=signals,
        )
        fixes = Fixes(at, np.zeros((n, 3)), np.zeros(n), np.zeros(n))
        out.append(Batch(segment, fixes, np.ones(n, dtype=bool), fresh=first == 0))
    return out


def resting(rng, seconds, *, rate=50.0, noise=0.05):
    """(n, 3) what an accelerometer reads that stands level."""
    force = np.array([0.0, 0.0, -G])
    return force + noise * rng.normal(size=(round(seconds * rate), 3))


def flown(rng, seconds, *, rate=50.0, noise=0.3):
    """(n, 3) manoeuvres of up to 2 g on top of that."""
    t = np.arange(round(seconds * rate)) / rate
    waves = sum(
        rng.uniform(0.5, 3.0, 3) * np.sin(np.outer(t, rng.uniform(0.2, 2.0, 3)) + rng.uniform(0, 6))
        for _ in range(3)
    )
    return resting(rng, seconds, rate=rate, noise=noise) + waves
