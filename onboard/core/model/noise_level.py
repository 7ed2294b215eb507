"""How much of the samples is noise: what is not known of a filter that takes it off."""

from __future__ import annotations

import math

from onboard.core.inputs.expected_force import TAKEN
from onboard.core.maths.arrays import Array
from onboard.core.model.nuisances import AXIS
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import Family, Unknown

DOUBT = math.log(2.0)
"""Prior sigma of a level's logarithm.  The level that one begins with is what the velocity walks
by beside all that a receiver's average and delay have made of the noise, or what is left at the end
of a spectrum that a low-pass may have cut: either is known to a factor of two [physics]."""


class NoiseLevel(Family):
    """By how much the density of the noise in each axis' samples is off, as a logarithm.

    Where noise is most of a force, the scale of it is told by what the filter lets through: a scale
    is no surer than the level of the noise is.
    """

    name = "noise_level"
    unknowns = tuple(Unknown(f"noise_level_{a}", "1", 0.0, DOUBT) for a in AXIS)

    def __init__(self, about: Array) -> None:
        """Take the densities (3,) that were thought, sensor axes, (m/s^2)^2 s."""
        self.about = about

    def available(self, nodes: Signals) -> bool:
        """True where something was expected of the samples."""
        return TAKEN in nodes.segment.slow

    def acceleration(self, nodes: Signals) -> Array | None:
        """More noise is less force."""
        taken = nodes.slow(TAKEN)
        return None if taken is None else -nodes.R_bs * taken[..., None, :]
