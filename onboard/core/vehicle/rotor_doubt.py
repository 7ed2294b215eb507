"""How far the drag of rotors may be another, where they pull with a force of which no effect knows.

It goes with the root of what they pull, which is the measured force along them.  What repeats there
and is no effect's (thrust that is gained in forward flight, lift of the body) may be of the rotors,
and then their drag goes with it, or of something else, and then it does not: each share is as
likely.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import UP
from onboard.core.vehicle.effects.beyond import Beyond
from onboard.core.vehicle.effects.rotor_drag import RotorDrag
from onboard.core.vehicle.effects.vertical_drag import LEAST_PULL, rotor_root
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.limits import MOST_OF_ROTORS


def rotor_doubt(fit: Fit) -> Array:
    """(m,) by how much that may have turned the unknowns: the rotors' drag alone."""
    out = np.zeros(len(fit.theta))
    model = fit.model
    places = model.indices(RotorDrag.name)
    laws = [
        (e.law, float(fit.theta[model.index(e.unknowns[0].name)]))
        for e in model.effects
        if isinstance(e, Beyond) and UP in e.law.axes
    ]
    if not places or not laws:
        return out
    air = model.air(fit.theta)
    beside = -sum(size * law.force(air)[:, UP] for law, size in laws)
    pull = np.maximum(air.pull, LEAST_PULL)
    root = np.sqrt(np.clip(1.0 - beside / pull, 1.0 - MOST_OF_ROTORS, 1.0 + MOST_OF_ROTORS))
    weight = np.sum((rotor_root(air)[:, None] * air.u_b[:, :2]) ** 2, axis=1)
    if not np.any(weight > 0.0):
        return out
    least = float(np.average(root, weights=weight))
    out[places] = np.abs(fit.theta[places]) * abs(1.0 / least - 1.0) / math.sqrt(3.0)
    return out
