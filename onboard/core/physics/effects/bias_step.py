"""An offset that jumped."""

from __future__ import annotations

from copy import copy
from typing import Self

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Signals
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import Bearing, Effect, on_axes
from onboard.core.physics.finding import Finding
from onboard.core.physics.wording import each

LARGEST = 3.0
"""m/s^2; a sensor that jumps by more is broken and not miscalibrated."""


class BiasStep(Effect):
    """Offset that jumps at one moment; without one (:meth:`at`) it is no candidate yet."""

    effect = "bias_step"
    code = 11
    title = "The offset jumped"
    sentence = "the offset jumped during the flight"
    meaning = "`time`, s; `x`, `y`, `z`, m/s²"
    bearing = Bearing.NO_ONE_NUMBER
    source = "step in the offset: a shock, a mount that gave way"
    cure = "inspect the mount of the autopilot; recalibrate on the ground"
    apart = "fly on: a step stays"
    tilts_ekf = True
    changes_force = True
    response = curves.Response(
        "time",
        "s",
        "offset error",
        "m/s^2",
        curves.time,
        lambda x, about: (x >= about).astype(np.float64),
    )

    def at(self, moment: float) -> Self:
        """The jump at a moment, s on the boot clock."""
        made = copy(self)
        made.onset = moment
        made.name = f"bias_step_{moment:.2f}"
        made.take_axes("m/s^2", LARGEST)
        return made

    @property
    def moment(self) -> float:
        """When it jumped, s on the boot clock.

        Raises:
            ValueError: it has no moment yet.
        """
        if self.onset is None:
            raise ValueError("a jump without its moment")
        return self.onset

    def acceleration(self, nodes: Signals) -> Array:
        """``-e_i`` from the moment on."""
        after = (nodes.t >= self.moment).astype(np.float64)
        return on_axes(np.repeat(after[..., None], 3, axis=-1))

    @classmethod
    def size(cls, found: Finding) -> str:
        """``at 84 s by x 0.31 m/s²``."""
        rest = {k: q for k, q in found.unknowns.items() if k != "time"}
        at = found.unknowns.get("time")
        when = f"at {at.value:.0f} s " if at else ""
        return f"{when}by {each(rest)}"

    @classmethod
    def condition(cls, found: Finding, offset: float, change: float) -> str:
        """The offset before the jump and after it."""
        t = found.unknowns["time"].value
        return f"{offset:.4f} until {t:.0f} s, {offset + change:.4f} from then on"
