"""A mount that bends under load."""

from __future__ import annotations

from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.model.regressors import Unknown
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import Bearing
from onboard.core.physics.finding import Finding
from onboard.core.physics.proportional import Turning
from onboard.core.physics.wording import DEGREE, each


class LoadFlex(Turning):
    """Mount that bends with the load: tilt per g of load beyond one."""

    effect = "load_flex"
    code = 19
    title = "The mount bends under load"
    sentence = "the mount bends under load"
    meaning = "`roll`, `pitch`, rad per g"
    bearing = Bearing.BESIDE
    source = "linear spring: tilt = flex (n - 1), n = -f_z / g"
    cure = "stiffen the autopilot's mount"
    apart = "pull up and turn steeply: only a flexing mount follows the load factor"
    keys = ("roll", "pitch")
    plausible = (0.2, 0.2)
    unknowns = (
        Unknown("load_flex_roll", "rad/g", 0.0, 0.1),
        Unknown("load_flex_pitch", "rad/g", 0.0, 0.1),
    )
    response = curves.Response(
        "load factor", "g", "tilt", "°", curves.load, lambda x, _: (x - 1.0) / DEGREE
    )

    def angle(self, f_b: Array) -> Array:
        """``n - 1``, of the true force: one that is turned already weighs otherwise."""
        out: Array = -f_b[..., 2] / STANDARD_GRAVITY - 1.0
        return out

    @classmethod
    def size(cls, found: Finding) -> str:
        """``by pitch 0.6° per g``."""
        return f"by {each(found.unknowns, 1.0 / DEGREE, '°')} per g"
