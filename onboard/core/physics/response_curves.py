"""How an effect's size goes with its signal, over the range that a flight has covered."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array, Mask
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.physics.finding import Quantity, ResponseCurve

POINTS = 60
AXES = "xyz"
EXTREMES = (1.0, 99.0)
"""Percentiles that stand for the range that was flown: single samples are noise."""

Values: TypeAlias = Callable[[Sequence[Batch], float], Array]
"""What was flown of a signal: (n,) or (n, 3) from the batches and the time of the first sample."""
Shape: TypeAlias = Callable[[Array, float], Array]
"""Effect of one unit at signal ``x`` (n,), about a reference (a temperature, a moment): (n,)."""


def begun(x: Array, about: float) -> Array:
    """Nothing before ``about``, one from then on."""
    return (x >= about).astype(np.float64)


@dataclass(frozen=True, slots=True)
class Response:
    """The formula behind a curve: a signal, a quantity, what one unit of an unknown makes of it."""

    signal: str
    unit: str
    quantity: str
    quantity_unit: str
    values: Values
    shape: Shape

    def curve(
        self,
        unknowns: Mapping[str, Quantity],
        batches: Sequence[Batch],
        t0: float,
        about: float,
        onset: float | None = None,
    ) -> ResponseCurve | None:
        """The curve over the range that was flown; None if the signal is not in the recording.

        Args:
            unknowns: as found; each gives a curve, NaN where its own axis has not been.
            batches: the flight.
            t0: first sample, s on the boot clock.
            about: reference of the formula.
            onset: s since ``t0`` at which the effect began, if it did.
        """
        if not batches:
            return None
        seen = self.values(batches, t0)
        if not np.any(np.isfinite(seen)):
            return None
        x = np.linspace(float(np.nanmin(seen)), float(np.nanmax(seen)), POINTS)
        if onset is not None:
            x = np.sort(np.concatenate([x, [onset - 1e-3, onset]]))
        per_unit = self.shape(x, about)
        flown = {k: np.where(_within(x, seen, k), per_unit, np.nan) for k in unknowns}
        return ResponseCurve(
            signal=self.signal,
            unit=self.unit,
            quantity=self.quantity,
            quantity_unit=self.quantity_unit,
            x=x,
            y={k: q.value * flown[k] for k, q in unknowns.items()},
            sigma={k: np.abs(q.sigma * flown[k]) for k, q in unknowns.items()},
        )


def _within(x: Array, seen: Array, key: str) -> Mask:
    """Where an unknown's own axis has been; everywhere if the signal has no axes."""
    if seen.ndim == 1 or key not in AXES:
        return np.ones(x.shape, dtype=bool)
    own = seen[:, AXES.index(key)]
    inside: Mask = (x >= np.nanmin(own)) & (x <= np.nanmax(own))
    return inside


def slow(name: str, factor: float = 1.0) -> Values:
    """A slow signal of the recording, times ``factor``."""

    def values(batches: Sequence[Batch], t0: float) -> Array:
        del t0
        found = [c.segment.slow[name][1] for c in batches if name in c.segment.slow]
        out: Array = factor * np.concatenate(found) if found else np.zeros(0)
        return out

    return values


def time(batches: Sequence[Batch], t0: float) -> Array:
    """Begin and end of every batch, s since the first sample."""
    return np.array([t - t0 for c in batches for t in (c.fixes.t[0], c.fixes.t[-1])])


def force_g(batches: Sequence[Batch], t0: float) -> Array:
    """(n, 3) range of the specific force along the body axes, in g."""
    del t0
    bodies = [c.segment.raw_s @ c.segment.R_bs.T for c in batches]
    out: Array = np.concatenate([np.percentile(f_b, EXTREMES, axis=0) for f_b in bodies])
    return out / STANDARD_GRAVITY


def load(batches: Sequence[Batch], t0: float) -> Array:
    """Range of the load factor, ``-f_z / g`` in body axes."""
    out: Array = -force_g(batches, t0)[:, 2]
    return out
