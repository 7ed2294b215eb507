"""Effects proportional to what the accelerometer measures: axes, curvature, mounts that give."""

from __future__ import annotations

from copy import copy

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import Unknown
from onboard.core.physics.effect import EffectColumns, Origin, on_axes

PAIRS = ("xy", "xz", "yx", "yz", "zx", "zy")


class Gain(EffectColumns):
    """An effect proportional to the force: its columns are those of the *true* force.

    What was measured contains the effect itself; ``taken`` (k,), what is known of its unknowns,
    takes it off to first order, which leaves an error of third order.
    """

    taken: Array | None = None
    beside: tuple[tuple[EffectColumns, Array], ...] = ()

    def __init__(self, origin: Origin) -> None:
        """No reference is needed."""
        del origin

    def about(self, taken: Array, beside: tuple[tuple[EffectColumns, Array], ...] = ()) -> Gain:
        """The same effect, linearised about ``taken`` (k,) and other effects with their sizes."""
        made = copy(self)
        made.taken, made.beside = taken, beside
        return made

    def acceleration(self, nodes: Signals) -> Array:
        """(..., 3, k) of the force without the effect."""
        f_b = nodes.f_b
        for other, size in self.beside:
            added = other.acceleration(nodes)
            if added is not None:
                f_b = f_b + added @ size
        if self.taken is not None:
            f_b = f_b + self.amount(f_b) @ self.taken
        return self.amount(f_b)

    def amount(self, f_b: Array) -> Array:
        """What one unit of each unknown takes off a force (..., 3): (..., 3, k)."""
        raise NotImplementedError


class CrossAxis(Gain):
    """Sensitivity of each axis to the others; ``xy`` is what x reads too much per unit of y."""

    name = effect = "cross_axis"
    source = "misalignment matrix without its diagonal, IEEE Std 1293"
    cure = "ArduPilot has no parameter for it: remount or replace the sensor"
    apart = "turn through all headings with bank and pitch: a tilt turns all axes alike"
    keys = PAIRS
    plausible = (0.25,) * 6
    unknowns = tuple(Unknown(f"cross_{p}", "1", 0.0, 0.15) for p in PAIRS)

    def amount(self, f_b: Array) -> Array:
        """``-e_i f_j``."""
        out = np.zeros((*f_b.shape, 6))
        for k, pair in enumerate(PAIRS):
            out[..., "xyz".index(pair[0]), k] = -f_b[..., "xyz".index(pair[1])]
        return out


class ScaleNonlinearity(Gain):
    """Scale that changes with the load: second-order coefficient, per g."""

    name = effect = "scale_nonlinearity"
    source = "K2 of IEEE Std 1293"
    cure = "ArduPilot has no parameter for it: stay inside the sensor's range, or replace it"
    apart = "fly at several load factors: steep turns, pull-ups, push-overs"

    def __init__(self, origin: Origin) -> None:
        """No reference is needed."""
        del origin
        self._three("1/g", 0.1)

    def amount(self, f_b: Array) -> Array:
        """``-f_i^2 / g e_i``."""
        return on_axes(f_b**2 / STANDARD_GRAVITY)


class LoadFlex(Gain):
    """Mount that bends with the load: tilt per g of load beyond one."""

    name = effect = "load_flex"
    source = "linear spring: tilt = flex (n - 1), n = -f_z / g"
    cure = "stiffen the autopilot's mount"
    apart = "pull up and turn steeply: only a flexing mount follows the load factor"
    keys = ("roll", "pitch")
    plausible = (0.2, 0.2)
    unknowns = (
        Unknown("load_flex_roll", "rad/g", 0.0, 0.1),
        Unknown("load_flex_pitch", "rad/g", 0.0, 0.1),
    )

    def amount(self, f_b: Array) -> Array:
        """As a tilt, times ``n - 1``."""
        extra = -f_b[..., 2] / STANDARD_GRAVITY - 1.0
        ex, ey = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
        tilt = np.stack([np.cross(f_b, ex), np.cross(f_b, ey)], axis=-1)
        return tilt * extra[..., None, None]
