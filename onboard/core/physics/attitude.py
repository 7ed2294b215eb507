"""Effects in the recorded attitude that change with something."""

from __future__ import annotations

import numpy as np

from onboard.core.model.quadrature import Around
from onboard.core.model.regressors import Direct, Unknown
from onboard.core.physics.effect import EffectColumns, Origin


class HeadingByThrottle(EffectColumns):
    """Compass pulled by the motor currents."""

    name = effect = "heading_by_throttle"
    needs = ("throttle",)
    of_attitude = True
    source = "linear in the throttle, as COMPASS_MOT_* assumes"
    cure = (
        "compass-motor calibration (COMPASS_MOT_*), or move the compass away from the power wires"
    )
    apart = "change the throttle at constant heading"
    keys = ("yaw_per_throttle",)
    plausible = (1.5,)
    unknowns = (Unknown("yaw_per_throttle", "rad", 0.0, 0.5),)

    def __init__(self, origin: Origin) -> None:
        """No reference is needed."""
        del origin

    def attitude(self, around: Around) -> Direct:
        """``throttle e_down``."""
        throttle = around.now.slow("throttle")
        ned = np.zeros((len(around.now.t), 3, 1))
        if throttle is not None:
            ned[:, 2, 0] = throttle
        return Direct(ned=ned)
