"""A blow that the samples have missed: force and turn that nobody has felt."""

from __future__ import annotations

import numpy as np

from onboard.core.diagnosis.limits import LARGEST_TURN
from onboard.core.maths.arrays import Array
from onboard.core.model.nuisances import AXIS
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import Family, Unknown
from onboard.core.physics.effect import on_axes
from onboard.core.physics.effects.bias_step import LARGEST


class Shock(Family):
    """Force and turn that the samples have missed, for a while after a moment."""

    def __init__(self, moment: float, lasts: float) -> None:
        """Take the moment, s on the boot clock, and for how long, s."""
        self.moment, self.lasts = moment, lasts
        self.name = f"shock_{moment:.2f}"
        self.unknowns = (
            *(Unknown(f"{self.name}_{a}", "m/s^2", 0.0, LARGEST) for a in AXIS),
            *(Unknown(f"{self.name}_turn_{a}", "rad/s", 0.0, LARGEST_TURN) for a in AXIS),
        )

    def acceleration(self, nodes: Signals) -> Array:
        """``-e_i`` for as long as it lasts."""
        return np.concatenate([self._during(nodes), np.zeros((*nodes.t.shape, 3, 3))], axis=-1)

    def rate(self, nodes: Signals) -> Array:
        """The same of the rates."""
        return np.concatenate([np.zeros((*nodes.t.shape, 3, 3)), self._during(nodes)], axis=-1)

    def _during(self, nodes: Signals) -> Array:
        since = nodes.t - self.moment
        inside = ((since >= 0.0) & (since < self.lasts)).astype(np.float64)
        return on_axes(inside[..., None])
