"""An offset that follows the temperature."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import Self

import numpy as np

from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Signals
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import (
    AXES,
    REFERENCE_DEGC,
    Bearing,
    Effect,
    Origin,
)
from onboard.core.physics.finding import Finding, ResponseCurve
from onboard.core.physics.wording import fixed

LARGEST = 0.1
"""m/s^2/K; sensors drift by a hundredth of it [assumed]."""
BENT = ("bend", "twist")
"""Names of the shapes: what ArduPilot's second and third power add to a straight line."""
LEAST_RANGE_K = 10.0
"""Warming from which ArduPilot itself fits more than a mean (TEMP_RANGE_MIN of its tempcal): over
less, a curve is a line [data sheet]."""
MATTERS = 0.02
"""m/s^2; a curve with less of a range is as good as none [use]."""
STRAIGHT = 0.05
"""Of the range of a curve, by which it may be off a straight line and be told as one [use]."""


class TemperatureDrift(Effect):
    """Offset that follows the sensor's temperature, about ArduPilot's 35 degC.

    ArduPilot's correction has three powers of the temperature.  The first is the size; where a
    flight warms up enough, those above it are shapes: Legendre polynomials over the temperatures
    that were flown, which add no slope to the straight line that fits the curve best, less what
    they are at the reference.
    """

    effect = "temperature_drift"
    code = 9
    title = "The offset follows the temperature"
    sentence = "the offset follows the temperature"
    meaning = "`x`, `y`, `z`, m/s²/K about 35 °C: slope of the line that fits its curve best"
    bearing = Bearing.NO_ONE_NUMBER
    source = "AP_InertialSensor_tempcal: polynomial of three powers about 35 degC"
    cure = "calibrate the IMU's temperature drift: INS_TCAL1_ENABLE = 2, cold start, let it warm up"
    apart = "fly once cold and once warm"
    needs = ("temperature",)
    tilts_ekf = True
    changes_force = True
    response = curves.Response(
        "temperature",
        "°C",
        "offset error",
        "m/s^2",
        curves.slow("temperature"),
        lambda x, about: x - about,
    )

    def __init__(self, origin: Origin) -> None:
        """Take the reference temperature."""
        super().__init__(origin)
        self.take_axes("m/s^2/K", LARGEST)
        self.flown = (origin.temperature, origin.temperature)

    def told_by(self, batches: Sequence[Batch]) -> Self:
        """With its curve, where the flight warms up enough to have one."""
        seen = curves.slow("temperature")(batches, self.origin.t0)
        # Of a wild sample or two, no range is made.
        low, high = np.percentile(seen, (1, 99)) if len(seen) else self.flown
        made = copy(self)
        made.flown = (float(low), float(high))
        return made if high - low < LEAST_RANGE_K else made.with_bends(BENT)

    def simpler(self) -> tuple[Self, ...]:
        """With fewer powers: a line, a parabola."""
        names = [n for n in BENT if any(u.name.endswith(f"{n}_x") for u in self.unknowns)]
        return tuple(self.with_bends(names[:k]) for k in range(len(names)))

    def opened(self) -> Self:
        """With every power, where the reference is not among the temperatures that were flown.

        Between them a curve that was not found is near its line.  Beyond them nobody has seen that
        it goes on straight, and the offset of the six is said to be that of the reference.
        """
        low, high = self.flown
        if not low < high or low <= self.origin.temperature <= high:
            return self
        return self.with_bends(BENT)

    def with_bends(self, bent: Sequence[str]) -> Self:
        """The same with some of :data:`BENT`, the first first."""
        made = copy(self)
        made.take_axes("m/s^2/K", LARGEST)
        half = 0.5 * (self.flown[1] - self.flown[0])
        names = [f"{name}_{a}" for name in bent for a in AXES]
        made.take_shapes(names, "m/s^2", LARGEST * half)
        return made

    def acceleration(self, nodes: Signals) -> Array:
        """``-(T - T0) e_i``, then the same of each Legendre polynomial of T."""
        T = nodes.slow("temperature")
        if T is None:
            return np.zeros((*nodes.t.shape, 3, len(self.unknowns)))
        powers = -np.stack(self._powers(T), axis=-1)
        out = np.zeros((*T.shape, len(AXES), powers.shape[-1], len(AXES)))
        for axis in range(len(AXES)):
            out[..., axis, :, axis] = powers
        return out.reshape(*T.shape, len(AXES), -1)

    def _powers(self, T: Array) -> list[Array]:
        """What one of each adds to an offset at temperatures of any shape, power by power."""
        about = self.origin.temperature
        out = [T - about]
        if self.shaped:
            # Of none of them is anything at the reference, whose offset the six have.  Where that
            # is far from what was flown, its sigma has what nobody knows of them there.
            u, at = _within(T, self.flown), float(_within(np.array(about), self.flown))
            u = np.clip(u, min(-1.0, at), max(1.0, at))
            at_it = _legendre(np.array(at))
            out += [p - there for p, there in zip(_legendre(u), at_it, strict=True)]
        return out[: len(self.unknowns) // len(AXES)]

    def bent(self, line: ResponseCurve, theta: Array, covariance: Array) -> ResponseCurve:
        """The curve over the temperatures of the straight one."""
        powers = np.stack(self._powers(line.x))
        index = [np.arange(j, len(theta), len(AXES)) for j in range(len(AXES))]
        own = [covariance[np.ix_(i, i)] for i in index]
        spread = [np.sqrt(np.einsum("ij,ik,jk->k", C, powers, powers)) for C in own]
        y = {a: theta[i] @ powers for a, i in zip(AXES, index, strict=True)}
        return replace(line, y=y, sigma=dict(zip(AXES, spread, strict=True)))

    @classmethod
    def size(cls, found: Finding) -> str:
        """``by x 0.012 m/s²/K``; of a curve, from where to where: ``by up to 0.31 m/s² ...``."""
        curve = found.response_curve
        if curve is None or _straight(curve):
            return super().size(found)
        most = max(float(np.ptp(y)) for y in curve.y.values())
        low, high = float(np.min(curve.x)), float(np.max(curve.x))
        return f"by up to {fixed(most, 2)} m/s² between {fixed(low, 0)} and {fixed(high, 0)} °C"

    @classmethod
    def condition(cls, found: Finding, offset: float, change: float) -> str:
        """The offset at the reference, its slope, and where that was flown."""
        said = f"{offset:.4f} at {REFERENCE_DEGC:.0f} degC, {change:+.4f} per degree"
        if found.response_curve is None:
            return said
        flown = found.response_curve.x
        low, high = float(np.min(flown)), float(np.max(flown))
        if not _straight(found.response_curve):
            said = f"{said} in the mean, along a curve"
        return f"{said}, flown from {low:.0f} to {high:.0f} degC"


def _within(T: Array, flown: tuple[float, float]) -> Array:
    """Temperatures of any shape, from -1 at the lowest that was flown to 1 at the highest."""
    low, high = flown
    out: Array = (2.0 * T - low - high) / (high - low)
    return out


def _legendre(u: Array) -> tuple[Array, Array]:
    """Second and third polynomial, of any shape."""
    square = u * u
    return 0.5 * (3.0 * square - 1.0), 0.5 * u * (5.0 * square - 3.0)


def _straight(curve: ResponseCurve) -> bool:
    """Whether a straight line is the curve, by eye, on the axis on which it does most."""
    y = max(map(np.nan_to_num, curve.y.values()), key=np.ptp, default=np.zeros(len(curve.x)))
    line = np.polyval(np.polyfit(curve.x, y, 1), curve.x)
    return not np.max(np.abs(y - line)) > STRAIGHT * max(np.ptp(y), MATTERS)
