"""A compass that the motor currents pull."""

from __future__ import annotations

import numpy as np

from onboard.core.inputs.segments import STEADY_THROTTLE
from onboard.core.model.around import Around
from onboard.core.model.regressors import Direct, Unknown
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import Bearing, Effect
from onboard.core.physics.finding import Finding
from onboard.core.physics.wording import DEGREE, each


class HeadingByThrottle(Effect):
    """Compass pulled by the motor currents."""

    effect = "heading_by_throttle"
    code = 8
    title = "The motors pull the compass"
    sentence = "the motors pull the compass"
    meaning = "`yaw_per_throttle`, rad at full throttle"
    bearing = Bearing.BESIDE
    source = "linear in the throttle, as COMPASS_MOT_* assumes"
    cure = (
        "compass-motor calibration (COMPASS_MOT_*), or move the compass away from the power wires"
    )
    apart = "change the throttle at constant heading"
    needs = ("throttle",)
    of_attitude = True
    keys = ("yaw_per_throttle",)
    plausible = (1.5,)
    unknowns = (Unknown("yaw_per_throttle", "rad", 0.0, 0.5),)
    response = curves.Response(
        "throttle",
        "%",
        "heading error",
        "°",
        curves.slow("throttle", 100.0),
        lambda x, _: x / 100.0 / DEGREE,
    )

    def attitude(self, around: Around) -> Direct:
        """``throttle e_down``, of what was not taken out of both."""
        steady = around.now.slow(STEADY_THROTTLE)
        throttle = around.now.slow("throttle") if steady is None else steady
        ned = np.zeros((len(around.now.t), 3, 1))
        if throttle is not None:
            ned[:, 2, 0] = throttle
        return Direct(ned=ned)

    @classmethod
    def size(cls, found: Finding) -> str:
        """``by yaw_per_throttle 6.1° at full throttle``."""
        return f"by {each(found.unknowns, 1.0 / DEGREE, '°')} at full throttle"
