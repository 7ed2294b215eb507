"""How an effect's size goes with its signal, over the range that a flight has covered."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.physics.effect import AXES
from onboard.core.physics.finding import Quantity, ResponseCurve

POINTS = 60
DEGREES = 180.0 / np.pi


def law_of(
    name: str,
    unknowns: Mapping[str, Quantity],
    batches: Sequence[Batch],
    t0: float,
    reference_temperature: float,
) -> ResponseCurve | None:
    """The curve of an effect; None for one that follows no single signal.

    Args:
        name: of the effect.
        unknowns: as found; each gives a curve, but for the moment of a jump.  A curve is NaN where
            its own axis has not been.
        batches: the flight.
        t0: first sample, s.
        reference_temperature: at which a temperature drift is nothing, degC.
    """
    if not batches:
        return None
    made = _LAWS.get(name)
    if made is None:
        return None
    signal, unit, quantity, quantity_unit, values, shape = made
    seen = values(batches, t0)
    if not np.any(np.isfinite(seen)):
        return None
    x = np.linspace(float(np.nanmin(seen)), float(np.nanmax(seen)), POINTS)
    begins = unknowns.get("time")
    if begins is not None:
        x = np.sort(np.concatenate([x, [begins.value - 1e-3, begins.value]]))
    about = reference_temperature if begins is None else begins.value
    per_unit = shape(x, about)
    sizes = {k: q for k, q in unknowns.items() if k != "time"}
    flown = {k: np.where(_within(x, seen, k), per_unit, np.nan) for k in sizes}
    return ResponseCurve(
        signal=signal,
        unit=unit,
        quantity=quantity,
        quantity_unit=quantity_unit,
        x=x,
        y={k: q.value * flown[k] for k, q in sizes.items()},
        sigma={k: np.abs(q.sigma * flown[k]) for k, q in sizes.items()},
    )


def _within(x: Array, seen: Array, key: str) -> NDArray[np.bool_]:
    """Where an unknown's own axis has been; everywhere if the signal has no axes."""
    if seen.ndim == 1 or key not in AXES:
        return np.ones(x.shape, dtype=bool)
    own = seen[:, AXES.index(key)]
    inside: NDArray[np.bool_] = (x >= np.nanmin(own)) & (x <= np.nanmax(own))
    return inside


def _slow(name: str, factor: float = 1.0) -> Callable[[Sequence[Batch], float], Array]:
    def values(batches: Sequence[Batch], t0: float) -> Array:
        del t0
        found = [c.segment.slow[name][1] for c in batches if name in c.segment.slow]
        out: Array = factor * np.concatenate(found) if found else np.zeros(0)
        return out

    return values


def _time(batches: Sequence[Batch], t0: float) -> Array:
    return np.array([t - t0 for c in batches for t in (c.fixes.t[0], c.fixes.t[-1])])


def _force_g(batches: Sequence[Batch], t0: float) -> Array:
    del t0
    bodies = [c.segment.raw_s @ c.segment.R_bs.T for c in batches]
    extremes = [np.percentile(f_b, (1.0, 99.0), axis=0) for f_b in bodies]
    out: Array = np.concatenate(extremes) / STANDARD_GRAVITY
    return out


def _load(batches: Sequence[Batch], t0: float) -> Array:
    del t0
    extremes = [np.percentile(-c.segment.raw_s[:, 2], (1.0, 99.0)) for c in batches]
    out: Array = np.concatenate(extremes) / STANDARD_GRAVITY
    return out


_Values = Callable[[Sequence[Batch], float], Array]
_Shape = Callable[[Array, float], Array]

_LAWS: dict[str, tuple[str, str, str, str, _Values, _Shape]] = {
    "temperature_drift": (
        "temperature",
        "°C",
        "offset error",
        "m/s^2",
        _slow("temperature"),
        lambda x, about: x - about,
    ),
    "bias_ramp": ("time", "s", "offset error", "m/s^2", _time, lambda x, _: x),
    "bias_step": (
        "time",
        "s",
        "offset error",
        "m/s^2",
        _time,
        lambda x, about: (x >= about).astype(np.float64),
    ),
    "scale_nonlinearity": (
        "specific force",
        "g",
        "error of the reading",
        "m/s^2",
        _force_g,
        lambda x, _: STANDARD_GRAVITY * x**2,
    ),
    "vibration_rectification": (
        "vibration",
        "m/s^2",
        "offset error",
        "m/s^2",
        _slow("vibration"),
        lambda x, _: x**2,
    ),
    "throttle_coupling": (
        "throttle",
        "%",
        "offset error",
        "m/s^2",
        _slow("throttle", 100.0),
        lambda x, _: x / 100.0,
    ),
    "heading_by_throttle": (
        "throttle",
        "%",
        "heading error",
        "°",
        _slow("throttle", 100.0),
        lambda x, _: DEGREES * x / 100.0,
    ),
    "load_flex": ("load factor", "g", "tilt", "°", _load, lambda x, _: DEGREES * (x - 1.0)),
    "clock_skew": ("time", "s", "GPS late by", "ms", _time, lambda x, _: 1e3 * x),
}
