"""An offset that is not quite the same from minute to minute."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import replace
from typing import Self

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.flicker import MEANS_APART, waves, waves_variance
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import Unknown
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import AXES, Bearing, Effect, on_axes
from onboard.core.physics.finding import Quantity, ResponseCurve

PLAUSIBLE = 0.3
"""m/s^2; a sensor that wanders by more is broken [data sheet: the offset of an MPU-6000 changes by
0.34 along x and y from 0 to 70 degC]."""
TINY = 1e-12
"""m/s^2; a wander of nothing has no direction [bound]."""


class OffsetWander(Effect):
    """Offset that is not quite the same; without its flight (:meth:`along`) it is no candidate yet.

    It is the bias instability of data sheets: flicker noise, about its mean, which is the offset.
    """

    effect = "offset_wander"
    code = 27
    title = "The offset wanders"
    sentence = "the offset wandered by {size:.2g} m/s² from minute to minute"
    meaning = "`x`, `y`, `z`, m/s², root mean square about the mean of the flight"
    bearing = Bearing.HARMLESS
    source = "bias instability: flicker noise of the offset, IEEE Std 952 and 1293"
    cure = (
        "let the sensor warm up before a flight that calibrates, and keep draughts and vibration "
        "from it; no calibration holds better than this"
    )
    apart = "fly on: what wanders comes back, a drift goes on"
    of_flight = True
    tilts_ekf = True
    response = curves.Response("time", "s", "offset error", "m/s^2", curves.time, curves.begun)

    start = end = 0.0
    """Of the flight, s on the boot clock."""
    instability: tuple[float, ...] = ()
    """Along the axes of :attr:`keys`, m/s^2."""

    def along(self, start: float, end: float, instability_b: Array, count: int) -> Self:
        """The wandering of a flight.

        Args:
            start: of the flight, s on the boot clock.
            end: likewise.
            instability_b: (3,) along body axes, m/s^2; an axis without any has no unknowns.
            count: of cosines for each axis.
        """
        made = copy(self)
        made.start, made.end = start, end
        made.keys = tuple(a for a, b in zip(AXES, instability_b, strict=True) if b > 0.0)
        made.instability = tuple(float(b) for b in instability_b if b > 0.0)
        made.plausible = (PLAUSIBLE,) * len(made.keys)
        sigma = np.sqrt(waves_variance(count))[:, None] * np.array(made.instability)
        made.unknowns = tuple(
            Unknown(f"{self.name}_{a}_{k + 1}", "m/s^2", 0.0, float(sigma[k, i]))
            for k in range(count)
            for i, a in enumerate(made.keys)
        )
        return made

    @property
    def instability_b(self) -> Array:
        """(3,) along body axes, m/s^2."""
        by = dict(zip(self.keys, self.instability, strict=True))
        return np.array([by.get(a, 0.0) for a in AXES])

    @property
    def count(self) -> int:
        """Cosines for each axis that wanders."""
        return len(self.unknowns) // max(len(self.keys), 1)

    def acceleration(self, nodes: Signals) -> Array:
        """``-c_k(t) e_i``."""
        wave = waves(nodes.t, self.start, self.end, self.count)
        axes = on_axes(np.ones((1, 3)))[0][:, [AXES.index(a) for a in self.keys]]
        out: Array = wave[..., None, :, None] * axes[:, None, :]
        return out.reshape(*nodes.t.shape, 3, len(self.unknowns))

    def sized(self, theta: Array, covariance: Array) -> dict[str, Quantity]:
        """Root mean square over the flight, by axis."""
        out = {}
        for i, axis in enumerate(self.keys):
            mine = slice(i, None, len(self.keys))
            size = float(np.linalg.norm(theta[mine]))
            along = theta[mine] / max(size, TINY)
            variance = float(along @ covariance[mine, mine] @ along)
            out[axis] = Quantity(size, math.sqrt(max(variance, 0.0)), "m/s^2")
        return out

    def bent(self, line: ResponseCurve, theta: Array, covariance: Array) -> ResponseCurve:
        """How far each axis is from its mean, over the flight."""
        wave = waves(line.x + self.origin.t0, self.start, self.end, self.count)
        value: dict[str, Array] = {}
        sigma: dict[str, Array] = {}
        for i, axis in enumerate(self.keys):
            mine = slice(i, None, len(self.keys))
            value[axis] = wave @ theta[mine]
            sigma[axis] = np.sqrt(np.einsum("nk,kl,nl->n", wave, covariance[mine, mine], wave))
        return replace(line, y=value, sigma=sigma)

    def unsteady(self) -> Array:
        """(3,) variance by which the mean of a next flight as long differs, (m/s^2)^2."""
        out: Array = MEANS_APART * self.instability_b**2
        return out
