"""A scale that jumped."""

from __future__ import annotations

from copy import copy
from math import inf
from typing import Self

from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Signals
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import Bearing, on_axes
from onboard.core.physics.effects.bias_step import Witness
from onboard.core.physics.finding import Finding
from onboard.core.physics.proportional import Proportional
from onboard.core.physics.wording import jumped

LARGEST = 0.2
"""A sensor whose scale jumps by more is broken, or on another range, and not miscalibrated."""


class ScaleStep(Proportional):
    """Scale that jumps at one moment; without one (:meth:`at`) it is no candidate yet.

    At the load of level flight it is a jump of the offset, for which it is taken at first: its
    moment is that one's.  Turns, climbs and whatever the other axes feel tell the two apart; where
    they do not, it is the offset: that jumps more often.
    """

    effect = "scale_step"
    code = 26
    title = "The scale jumped"
    sentence = "the scale jumped during the flight"
    meaning = "`time`, s; `x`, `y`, `z`, what is read too much per unit of force"
    bearing = Bearing.NO_ONE_NUMBER
    source = "step in the scale: another range or filter, a cracked sensor, a sagging supply"
    cure = "look for what changed: the sensor's range, supply and mount; recalibrate on the ground"
    apart = "fly at several load factors, before the jump and after it"
    of_flight = True
    tilts_ekf = True
    response = curves.Response(
        "time",
        "s",
        "scale error",
        "1",
        curves.time,
        curves.begun,
    )

    witness: Witness | None = None
    """That something jumped, where other accelerometers have seen it: how much, is not told."""

    def at(self, moment: float, sigma: float, witness: Witness | None = None) -> Self:
        """The jump at a moment, s on the boot clock, which is known to ``sigma``, s."""
        made = copy(self)
        made.onset, made.onset_sigma = moment, sigma
        made.name = f"scale_step_{moment:.3f}"
        made.take_axes("1", LARGEST)
        made.witness = witness
        return made

    @property
    def moment(self) -> float:
        """When it jumped, s on the boot clock; never, as long as it has no moment."""
        return inf if self.onset is None else self.onset

    def acceleration(self, nodes: Signals) -> Array:
        """``-f_i e_i`` from the moment on."""
        after = nodes.t >= self.moment
        return super().acceleration(nodes) * after[..., None, None]

    def amount(self, f_b: Array) -> Array:
        """``-f_i e_i``."""
        return on_axes(f_b)

    @classmethod
    def size(cls, found: Finding) -> str:
        """``at 84 s by x 2.0 %``."""
        return jumped(found.unknowns, 100.0, "%")

    @classmethod
    def condition(cls, found: Finding, offset: float, change: float) -> str:  # noqa: ARG003
        """The offset, which stays, and until when its scale holds."""
        return f"{offset:.4f}, with its scale until {found.unknowns['time'].value:.0f} s only"
