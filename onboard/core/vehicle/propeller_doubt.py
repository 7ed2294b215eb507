"""How far the drag of a plane may be its propeller's: a law of thrust that is no straight line.

Thrust over the advance ratio V/n bends.  A bend is ``c V^2`` beside ``a n^2 - b n V``, which is
what the profile's drag is; only a thrust that is measured tells the two apart.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.effects.drag import Drag
from onboard.core.vehicle.effects.propeller_inflow import PropellerInflow
from onboard.core.vehicle.effects.propulsion import Propulsion
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.limits import PROPELLER_BEND


def propeller_doubt(fit: Fit) -> Array:
    """(m,) by how much a bend may have turned the unknowns: the drag of the profile alone."""
    out = np.zeros(len(fit.theta))
    model = fit.model
    places = [model.indices(e.name) for e in (Propulsion, Drag)]
    inflows = [e for e in model.effects if isinstance(e, PropellerInflow)]
    if not inflows or not all(places):
        return out
    (scale, *_), (drag, *_) = places
    ratio = math.exp(min(float(fit.theta[scale]), 5.0))
    slope = float(fit.theta[model.index("propeller_inflow")])
    air = model.air(fit.theta)
    bent = inflows[0].full * slope**2 / ratio * float(np.mean(air.u_b[:, 0] ** 2))
    out[drag] = PROPELLER_BEND * bent / float(np.mean(air.pressure))
    return out
