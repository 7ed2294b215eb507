"""A pass that carries noise like that in the samples through everything that is made of them.

Noise in a regressor takes from what is estimated along it, and gives to what else the noise is in:
with noise in its samples a receiver seems to average, for noise is quieter when it is averaged, and
that gives back to the scale some of what noise in its own regressor takes.  So the noise of the
scales, the latency and the shapes of the average is one matrix.  It is not worked out but made:
columns of noise as strong as the velocity is found to walk, where it does, made of samples as the
regressors are (simulation as in SIMEX, Cook and Stefanski 1994, but of the noise alone, which needs
no extrapolation).  They go through the filter beside the others, take no part in the estimate, and
what they come out with is what to expect of the real noise: of hundreds of epochs, to a few per
cent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onboard.core.filter.accompanied import NO_PART, AccompaniedPass
from onboard.core.filter.limits import SHAKEN_LASTS_S
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.regressor_noise import share_of_walk
from onboard.core.filter.shaken import shaken_between, walk_s
from onboard.core.filter.whitening import Uses
from onboard.core.inputs.segments import Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.sums import NormalSums
from onboard.core.model.around import Around, around
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.quadrature import Intervals, NodeMaker
from onboard.core.model.regressors import Family, Model, SegmentRegressors, Unknown

MADE_OF_SAMPLES = ("six", "gps_latency", "gps_smoothing")
"""Families of every model whose regressors are made of the samples of the force."""


class NoisyPass(AccompaniedPass):
    """A pass of one member whose sums know what of them is noise in the regressors."""

    carries_walk = False

    def __init__(
        self,
        model: Model,
        point: Linearisation,
        levels: NoiseLevels,
        uses: Uses | None = None,
    ) -> None:
        """Take what a :class:`~onboard.core.filter.passes.Pass` of one member takes."""
        wide = _WithNoise(model, point, levels)
        self._noisy = wide.noisy
        super().__init__(model, wide, point, levels, uses=uses)

    def counted(self, sums: NormalSums) -> NormalSums:
        """As there, with what the columns of noise came out with."""
        own, m = super().counted(sums), self.own
        own.G[np.ix_(self._noisy, self._noisy)] = sums.N[m:, m:]
        return own


class _Noise(Family):
    """Columns of noise: unknowns that are nothing."""

    name = "noise"

    def __init__(self, count: int) -> None:
        self.unknowns = tuple(Unknown(f"noise_{i}", "1", 0.0, NO_PART) for i in range(count))


class _WithNoise(Model):
    """A model with noise, at the end, of each regressor that is made of samples."""

    def __init__(self, model: Model, point: Linearisation, levels: NoiseLevels) -> None:
        families: Sequence[Family] = [f for f in model.families if f.name in MADE_OF_SAMPLES]
        self._few = Model(families)
        names = [u.name for u in self._few.unknowns if not u.name.startswith("beta_")]
        self.noisy = np.array([model.index[name] for name in names], dtype=np.intp)
        self._columns = np.array([self._few.index[name] for name in names], dtype=np.intp)
        self._point, self._levels = point, levels
        super().__init__([*model.families, _Noise(len(names))])

    def regressors(self, intervals: Intervals, around: Around) -> SegmentRegressors:
        """Evaluate every family on one segment, and the noise."""
        made = super().regressors(intervals, around)
        segment = intervals.signals.segment
        noise = noise_like(segment, self._levels)
        # In body axes they are proportional to the samples: gravity is in none of them.
        noisy = self._of(replace(segment, raw_s=noise), intervals, around)
        at, of = self.slices["noise"].start + 1, self._columns + 1
        made.gained[:, :, at:] = noisy.gained[:, :, of]
        made.body[:, :, at:] = noisy.body[:, :, of]
        return made

    def _of(self, segment: Segment, intervals: Intervals, near: Around) -> SegmentRegressors:
        """Regressors of a segment at the same moments."""
        # A bias of the gyroscope turns either of the two by next to nothing.
        scale = np.concatenate([self._point.six[:3], np.zeros(3)])
        maker = NodeMaker(segment, np.zeros(3), scale)
        start = intervals.signals.t[:, 0]
        point = self._point
        return self._few.regressors(
            maker.intervals(start, start + intervals.duration),
            # Without a lever arm: what swings the antenna is no noise of the force.
            around(maker, near.now.t, point.window, -segment.lever_arm_b, np.array(point.shapes)),
        )


def noise_like(segment: Segment, levels: NoiseLevels) -> Array:
    """(n, 3) noise, sensor axes, m/s^2, as strong as the velocity walks and samples allow.

    The same whenever it is asked for.
    """
    t = segment.t
    if len(t) < 2:
        return np.zeros_like(segment.raw_s)
    density_b = (
        shaken_between(segment, t - SHAKEN_LASTS_S / 2.0, t + SHAKEN_LASTS_S / 2.0) / SHAKEN_LASTS_S
    )
    walk = levels.walk_shaken(density_b) @ segment.R_bs**2
    share = share_of_walk(segment, walk_s(levels, segment))
    spacing = np.gradient(t)[:, None]
    rng = np.random.default_rng([round(1e3 * abs(t[0])), len(t)])
    out: Array = rng.normal(size=(len(t), 3)) * np.sqrt(walk * share / spacing)
    return out
