"""A scale that changes with the load."""

from __future__ import annotations

from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import Bearing, Origin, on_axes
from onboard.core.physics.finding import Finding
from onboard.core.physics.proportional import Proportional
from onboard.core.physics.wording import each


class ScaleNonlinearity(Proportional):
    """Scale that changes with the load: second-order coefficient, per g."""

    effect = "scale_nonlinearity"
    code = 12
    title = "The scale changes with the load"
    sentence = "the scale changes with the load"
    meaning = "`x`, `y`, `z`, 1/g"
    bearing = Bearing.WITHIN
    source = "K2 of IEEE Std 1293"
    cure = "ArduPilot has no parameter for it: stay inside the sensor's range, or replace it"
    apart = "fly at several load factors: steep turns, pull-ups, push-overs"
    # A low-pass hides the samples next to the clipped ones: what is left of them is a curve.
    bent_by_clipping = "clipping bends the scale as well"
    response = curves.Response(
        "specific force",
        "g",
        "error of the reading",
        "m/s^2",
        curves.force_g,
        lambda x, _: STANDARD_GRAVITY * x**2,
    )

    def __init__(self, origin: Origin) -> None:
        """No reference is needed."""
        super().__init__(origin)
        self.take_axes("1/g", 0.1)

    def amount(self, f_b: Array) -> Array:
        """``-f_i^2 / g e_i``."""
        return on_axes(f_b**2 / STANDARD_GRAVITY)

    @classmethod
    def size(cls, found: Finding) -> str:
        """``x 1.2 % per g``."""
        return f"{each(found.unknowns, 100.0, '%')} per g"
