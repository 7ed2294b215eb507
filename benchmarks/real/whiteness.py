"""Whether whitened residuals are white: variance, correlation of neighbours, spectrum by band.

If the filter's model is right, each component of the whitened residual is a sequence of independent
numbers of variance 1, and its spectral density is 1 at every frequency.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.traces import EpochTrace

Array = NDArray[np.float64]

KINDS = ("v north", "v east", "v down", "height", "attitude x", "attitude y", "attitude z")
"""In the order in which an epoch whitens them: each given those before it."""
BANDS_HZ = ((0.0, 0.1), (0.1, 1.0), (1.0, np.inf))
SHORTEST_RUN_S = 20.0
"""s; a shorter run resolves nothing below 0.1 Hz."""
GAP = 1.5
"""Times the median step of the epochs: longer steps end a run."""


@dataclass(frozen=True, slots=True)
class Whiteness:
    """One component of the whitened residual.

    Attributes:
        kind: one of :data:`KINDS`.
        rows: how many.
        variance: mean square; 1 if the model is right.
        lag1: correlation of neighbours; 0 if the model is right.
        density: mean spectral density in each of :data:`BANDS_HZ`, over that of white noise of unit
            variance; NaN where nothing is resolved.
    """

    kind: str
    rows: int
    variance: float
    lag1: float
    density: tuple[float, ...]


def whiteness(traces: Sequence[EpochTrace], theta: Array) -> tuple[Whiteness, ...]:
    """Of all components that were measured.

    Args:
        traces: of a pass.
        theta: (m,) its solution.
    """
    at: dict[str, list[float]] = {kind: [] for kind in KINDS}
    x: dict[str, list[float]] = {kind: [] for kind in KINDS}
    for trace in traces:
        residual = trace.y - trace.h @ theta
        for kind, value in zip(_kinds(trace), residual.tolist(), strict=True):
            at[kind].append(trace.t)
            x[kind].append(value)
    return tuple(
        whiteness_of(kind, np.array(at[kind]), np.array(x[kind])) for kind in KINDS if x[kind]
    )


def _kinds(trace: EpochTrace) -> list[str]:
    n = trace.velocities
    rest = len(trace.y) - n - int(trace.height)
    return [*KINDS[:n], *(["height"] if trace.height else []), *KINDS[4 : 4 + rest]]


def whiteness_of(kind: str, t: Array, x: Array) -> Whiteness:
    """One component at times ``t`` (n,), s; ``x`` (n,) should be white with variance 1."""
    step = float(np.median(np.diff(t))) if len(t) > 1 else float("nan")
    runs = list(_runs(t, x, step))
    products = np.concatenate([r[1:] * r[:-1] for r in runs] or [np.zeros(0)])
    variance = float(np.mean(x**2))
    lag1 = float(products.mean()) / variance if len(products) and variance > 0.0 else float("nan")
    return Whiteness(kind, len(x), variance, lag1, _densities(runs, step))


def _runs(t: Array, x: Array, step: float) -> Iterator[Array]:
    """Parts without a gap."""
    if len(t) > 1:
        yield from np.split(x, np.flatnonzero(np.abs(np.diff(t) - step) > (GAP - 1.0) * step) + 1)


def _densities(runs: Sequence[Array], step: float) -> tuple[float, ...]:
    """Mean periodogram by band, all runs that are long enough together."""
    power, count = np.zeros(len(BANDS_HZ)), np.zeros(len(BANDS_HZ))
    for run in runs:
        if len(run) * step < SHORTEST_RUN_S:
            continue
        density = np.abs(np.fft.fft(run)) ** 2 / len(run)
        frequency = np.abs(np.fft.fftfreq(len(run), step))
        for i, (low, high) in enumerate(BANDS_HZ):
            inside = (frequency >= low) & (frequency < high)
            power[i] += density[inside].sum()
            count[i] += inside.sum()
    return tuple(float(p / n) if n else float("nan") for p, n in zip(power, count, strict=True))
