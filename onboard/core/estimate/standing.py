"""What accelerometers read where their vehicle stands: a truth that no flight has seen.

The estimator uses no ground.  Before take-off and after landing the vehicle stands, and whatever
its attitude, ``|scale (raw - offset)|`` has to be gravity: neither GPS, attitude, timing nor the
vehicle's motion are in it.  It asks for one number of six, in the direction in which the vehicle
stands.  An accelerometer that warms up, and one that vibration shifts in flight, rest at something
else.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from onboard.core.estimate.limits import (
    FEWEST_AT_REST,
    FEWEST_STANDS,
    QUIET_M_S2,
    QUIET_RAD_S,
    STAND_S,
)
from onboard.core.estimate.result import AtRest, Calibration
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.samples import ImuSample
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY

MOST_STANDS: Final = 600
"""Stretches that are remembered, the latest: twenty minutes [cost]."""


@dataclass(slots=True)
class _Stretch:
    """Sums of the samples of one accelerometer in a stretch that is not over."""

    number: float
    first: float
    last: float
    count: int
    total: Array
    squares: Array


@dataclass(slots=True)
class Standing:
    """Stretches in which nothing moved, by accelerometer."""

    _open: dict[int, _Stretch] = field(default_factory=dict)
    _means: dict[int, list[tuple[float, Array, SixParameters | None]]] = field(default_factory=dict)
    """Since when, s, mean force as reported, and the parameters in force, where they were known."""
    _waiting: dict[int, list[tuple[float, ...]]] = field(default_factory=dict)

    def hear(self, imu: int, t: Array, rows: Array, parameters: ParametersInForce) -> None:
        """Take samples in order of time.

        Args:
            imu: of which accelerometer.
            t: (n,) s.
            rows: (n, 6) rate, rad/s, and force with the parameters in force, m/s^2, body axes.
            parameters: in force.
        """
        numbers = np.floor(t / STAND_S)
        starts = np.flatnonzero(np.diff(numbers, prepend=np.nan) != 0.0)
        ends = np.append(starts[1:], len(t))
        totals, squares = np.add.reduceat(rows, starts), np.add.reduceat(rows**2, starts)
        for k, (i, j) in enumerate(zip(starts.tolist(), ends.tolist(), strict=True)):
            stretch = self._open.get(imu)
            if stretch is None or stretch.number != numbers[i]:
                if stretch is not None:
                    self._over(imu, stretch, parameters)
                first = float(t[i])
                zeros = np.zeros(6), np.zeros(6)
                stretch = self._open[imu] = _Stretch(float(numbers[i]), first, first, 0, *zeros)
            stretch.last, stretch.count = float(t[j - 1]), stretch.count + j - i
            stretch.total = stretch.total + totals[k]
            stretch.squares = stretch.squares + squares[k]

    def hear_one(self, sample: ImuSample, parameters: ParametersInForce) -> None:
        """Take a sample that comes by itself: looked at with those of its stretch."""
        if sample.w_b is None or not math.isfinite(sum((sample.t, *sample.w_b, *sample.f_b))):
            return
        waiting = self._waiting.setdefault(sample.imu, [])
        if waiting and sample.t // STAND_S != waiting[0][0] // STAND_S:
            self.catch_up(sample.imu, parameters)
            waiting = self._waiting.setdefault(sample.imu, [])
        waiting.append((sample.t, *sample.w_b, *sample.f_b))

    def catch_up(self, imu: int, parameters: ParametersInForce) -> None:
        """Look at samples that came by themselves."""
        rows = np.array(self._waiting.pop(imu, []))
        if len(rows):
            self.hear(imu, rows[:, 0], rows[:, 1:], parameters)

    def _over(self, imu: int, stretch: _Stretch, parameters: ParametersInForce) -> None:
        """Keep what was read in a stretch if nothing moved in it and it is whole."""
        if stretch.count < FEWEST_AT_REST or stretch.last - stretch.first < 0.8 * STAND_S:
            return
        mean = stretch.total / stretch.count
        scatter = np.sqrt(np.maximum(stretch.squares / stretch.count - mean**2, 0.0))
        if np.any(scatter[:3] > QUIET_RAD_S) or np.any(scatter[3:] > QUIET_M_S2):
            return
        six = parameters.six(imu) if parameters.known(imu) else None
        known = self._means.setdefault(imu, [])
        known.append((stretch.first, mean[3:], six))
        del known[:-MOST_STANDS]

    def of(
        self, calibration: Calibration, parameters: ParametersInForce, dead_from: float = math.inf
    ) -> AtRest | None:
        """What an accelerometer reads there by its calibration; None if nobody saw it standing.

        Asked at the end: the stretch that is not over is taken as it is.

        Args:
            calibration: of the accelerometer.
            parameters: in force, also where nobody knew them yet.
            dead_from: since when, s, it may measure nothing: what it reads at rest may be one
                reading for good reason, so only flight tells.
        """
        imu = calibration.imu
        self.catch_up(imu, parameters)
        if (stretch := self._open.pop(imu, None)) is not None:
            self._over(imu, stretch, parameters)
        means = [(mean, six) for t, mean, six in self._means.get(imu, []) if t < dead_from]
        covariance = np.array(calibration.covariance)
        if len(means) < FEWEST_STANDS or not np.all(np.isfinite(covariance)):
            return None
        R_bs, last = parameters.R_bs, parameters.six(imu)
        raw = np.array([(six or last).undo(R_bs.T @ mean) for mean, six in means])
        before = SixParameters(calibration.in_force_scale, calibration.in_force_offset)
        after = SixParameters(calibration.scale, calibration.offset)
        read, felt = (np.linalg.norm(six.apply(raw), axis=1) for six in (before, after))
        middle = raw[np.argsort(felt)[len(felt) // 2]]
        f_s = after.apply(middle)
        along = f_s / np.linalg.norm(f_s)
        slope = np.concatenate(
            [along * (middle - np.array(after.offset)), -along * np.array(after.scale)]
        )
        return AtRest(
            in_force=float(np.median(read)) - STANDARD_GRAVITY,
            estimate=float(np.median(felt)) - STANDARD_GRAVITY,
            sigma=float(np.sqrt(slope @ covariance @ slope)),
            seconds=len(means) * STAND_S,
        )
