"""Products of measured signals that an unknown effect may follow; no physical name is claimed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from typing import Self

import numpy as np

from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import Unknown
from onboard.core.physics.effect import AXES, Bearing, Effect, Origin, on_axes

LARGEST = 3.0
"""Prior sigma of a term's size, m/s^2 at a signal of one; signals are scaled to be about one."""


class Empirical(Effect):
    """An offset in proportion to a product of signals, with a size for each axis.

    Without a product (:meth:`of`) it is no candidate.
    """

    effect = "empirical"
    code = 21
    title = "An unnamed dependence on a measured signal"
    sentence = "something is missing"
    meaning = "a `formula`"
    bearing = Bearing.WITHIN
    source = "search among products of measured signals"
    cure = "find out what the formula stands for: no effect of the catalogue has this form"
    apart = "fly the manoeuvre in which the signal changes and nothing else does"
    of_flight = True
    named = False
    written = ""

    def of(self, name: str, written: str, signal: Callable[[Signals], Array]) -> Self:
        """Take a name, the signal as people write it, and how it is evaluated at nodes."""
        made = copy(self)
        made.name = f"{self.effect}_{name}"
        made.written = written
        made.signal = signal
        made.keys = tuple(AXES)
        made.plausible = (np.inf,) * 3
        made.unknowns = tuple(Unknown(f"{made.name}_{a}", "m/s^2", 0.0, LARGEST) for a in AXES)
        return made

    signal: Callable[[Signals], Array]

    def acceleration(self, nodes: Signals) -> Array:
        """``-s e_i``."""
        return on_axes(self.signal(nodes)[..., None])

    def formula(self, sizes: Sequence[float]) -> str:
        """The formula with its sizes: what each axis reads too much, m/s^2."""
        terms = ", ".join(f"{a} {x:+.3g}" for a, x in zip(AXES, sizes, strict=True))
        return f"({terms}) m/s^2 * {self.written}"


def _rate(axis: int) -> Callable[[Signals], Array]:
    return lambda nodes: nodes.w_b[..., axis]


def _rates(one: int, two: int) -> Callable[[Signals], Array]:
    return lambda nodes: nodes.w_b[..., one] * nodes.w_b[..., two]


def _forces(one: int, two: int) -> Callable[[Signals], Array]:
    return lambda nodes: nodes.f_b[..., one] * nodes.f_b[..., two] / STANDARD_GRAVITY**2


def _slow(name: str, power: int, scale: float) -> Callable[[Signals], Array]:
    def signal(nodes: Signals) -> Array:
        x = nodes.slow(name)
        if x is None:
            return np.zeros(nodes.t.shape)
        size = np.linalg.norm(x, axis=-1) if x.ndim > nodes.t.ndim else x
        out: Array = (size / scale) ** power
        return out

    return signal


def _over_time(t: Array, x: Array) -> Callable[[Signals], Array]:
    return lambda nodes: np.interp(nodes.t, t, x)


def products(batches: Sequence[Batch], origin: Origin) -> list[Empirical]:
    """Every product that this recording has the signals for."""
    make = Empirical(origin).of
    out = [make(f"w{a}", f"w_{a} / (rad/s)", _rate(i)) for i, a in enumerate(AXES)]
    for i, j in ((0, 0), (1, 1), (2, 2), (0, 2), (1, 2)):
        pair = f"{AXES[i]}{AXES[j]}"
        out.append(make(f"w{pair}", f"w_{AXES[i]} w_{AXES[j]} / (rad/s)^2", _rates(i, j)))
    for i, j in ((0, 1), (0, 2), (1, 2)):
        pair = f"{AXES[i]}{AXES[j]}"
        out.append(make(f"f{pair}", f"f_{AXES[i]} f_{AXES[j]} / g^2", _forces(i, j)))
    t = np.concatenate([c.fixes.t for c in batches])
    t, first = np.unique(t, return_index=True)
    v = np.concatenate([c.fixes.v_n for c in batches])[first]
    height = np.concatenate([c.fixes.height for c in batches])[first]
    heard = np.all(np.isfinite(v[:, :2]), axis=1)
    if heard.sum() > 2:
        speed2 = np.sum(v[heard, :2] ** 2, axis=1) / 100.0
        out.append(make("v2", "(ground speed / 10 m/s)^2", _over_time(t[heard], speed2)))
    if len(t) > 20:
        rate = np.convolve(np.gradient(height, t), np.ones(9) / 9.0, mode="same")
        out.append(make("climb", "climb rate / (m/s)", _over_time(t, rate)))
    names = set.intersection(*(set(c.segment.slow) for c in batches))
    if "airspeed" in names:
        out.append(make("air2", "(airspeed / 10 m/s)^2", _slow("airspeed", 2, 10.0)))
    if "throttle" in names:
        out.append(make("throttle2", "throttle^2", _slow("throttle", 2, 1.0)))
    if "vibration" in names:
        out.append(make("vibe", "|vibration| / (10 m/s^2)", _slow("vibration", 1, 10.0)))
    return out
