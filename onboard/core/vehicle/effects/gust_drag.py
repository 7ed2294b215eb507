"""What gusts do to the mean force: drag that is quadratic looks linear in gusty air."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import ByStep, Unknown

FASTER = 0.5
"""Logarithm of all gusts over those slower than the steps, give or take as much: in open air a few
per cent are faster, of the simulator's two thirds [physics]."""


class GustDrag(ByStep):
    """All gusts over those that were seen, by logarithm; beside the effects, in turbulent air.

    A variance is never negative: taken for any number, it is traded for drag.
    """

    def __init__(self, seen: float) -> None:
        """Take the RMS of the slower ones along an axis, m/s."""
        super().__init__([Unknown("faster_gusts", FASTER, FASTER, 0.0, "1")])
        self._seen = seen

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """Tell those that act after it."""
        air.gust_variance = self._seen**2 * np.exp(2.0 * values[0])
