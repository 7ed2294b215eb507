"""Gravity that is not the standard one."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Intervals, OfSensors, Signals
from onboard.core.model.regressors import Unknown
from onboard.core.physics.effect import Bearing, Effect
from onboard.core.physics.finding import Finding
from onboard.core.physics.wording import first, measured


class Gravity(Effect):
    """Gravity that differs from 9.80665 m/s^2."""

    effect = "gravity"
    code = 18
    title = "Gravity differs from the expected value"
    sentence = "gravity differs from the expected value"
    meaning = "`delta_g`, m/s²"
    bearing = Bearing.WITHIN
    source = "Somigliana's formula says what to expect"
    cure = "none: the autopilot integrates with 9.80665 everywhere"
    apart = "fly steep banked turns: an offset turns with the body, gravity does not"
    of_flight = True
    keys = ("delta_g",)
    is_averaged = False
    is_read = False
    # Poles to equator, and 5 km up, it is between 0.03 more and 0.045 less than the standard.
    plausible = (0.045,)
    unknowns = (Unknown("delta_g", "m/s^2", 0.0, 0.06),)

    def acceleration(self, nodes: Signals) -> Array:
        """Down, in body axes by the recorded attitude, and by the gyroscope from there on."""
        if nodes.P is not None:
            turned: Array = np.einsum("ka,kmab->kmb", _down(nodes), nodes.P)
            return turned[..., None]
        flat, _ = nodes.segment.attitude_at(nodes.t.ravel(), curve=nodes.curve)
        down = flat[:, 2, :].reshape(*nodes.t.shape, 3)
        return down[..., None]

    def gained(self, intervals: Intervals, of: OfSensors) -> Array:  # noqa: ARG002
        """Of :meth:`acceleration`, which in the axes of an interval's start stands still."""
        time = np.stack([intervals.weight.sum(axis=1), intervals.weight_to_end.sum(axis=1)], axis=1)
        out: Array = (time[..., None] * _down(intervals.signals)[:, None])[..., None]
        return out

    @classmethod
    def size(cls, found: Finding) -> str:
        """``by 0.03 ± 0.005 m/s²``."""
        return f"by {measured(first(found.unknowns), 1.0, 'm/s²')}"


def _down(nodes: Signals) -> Array:
    """(K, 3) down at the first of nodes in rows, body axes."""
    R_nb, _ = nodes.segment.attitude_at(nodes.t[:, 0], curve=nodes.curve)
    down: Array = R_nb[:, 2]
    return down
