"""A concealed effect with a memory: the reading lags behind the load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np

from sitl.builtin.effects.accelerometer import ByAxis
from sitl.builtin.effects.base import Array, Scene, Sizes


@dataclass(frozen=True, slots=True, kw_only=True)
class AccelerometerHysteresis(ByAxis):
    """Each axis reads up to ``x, y, z`` (m/s^2) too little while its load rises, too much after.

    The loop of a gear with backlash: after a reversal the reading stays behind until the load has
    come back by ``width``, m/s^2.  At first the gear is in the middle.
    """

    name: ClassVar[str] = "accelerometer_hysteresis"
    positive: ClassVar[bool] = True
    units: ClassVar[Mapping[str, Sizes]] = {
        "copter": {"x": 0.05, "y": 0.05, "z": 0.05},
        "plane": {"x": 0.05, "y": 0.05, "z": 0.05},
    }
    width: float = 2.0

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        branches = [
            self._branch(scene.f_b[:, j]) if size else np.zeros(len(scene.f_b))
            for j, size in enumerate(self.sizes)
        ]
        out: Array = np.column_stack(branches) * self.sizes
        return out

    def _branch(self, load: Array) -> Array:
        """Where the gear stands in its backlash, (n,): -1 as the load rises, 1 as it falls.

        From one turning point of the load to the next it is at rest or at one end.
        """
        half = 0.5 * self.width
        turns = 2 + np.flatnonzero(np.diff(np.sign(np.diff(load))))  # a corner ends its run
        out = np.empty_like(load)
        rest = float(load[0])
        for a, b in pairwise([0, *turns.tolist(), len(load)]):
            run = load[a:b]
            rests = np.clip(rest, run - half, run + half)
            # A run goes one way: once an end is reached, it is not left again.
            out[a:b] = (rests - run) / half
            rest = float(rests[-1])
        return out
