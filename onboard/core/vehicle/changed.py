"""What became another in flight where two numbers of it did: which of three nobody sees.

The force of one command and the drag are two numbers, both by mass.  Another mass changes both
alike, other rotors change the first alone: one effect that describes both numbers is hardly chance.
Where it takes two, mass with thrust is as good as thrust with drag, or as mass with drag: a mass of
0.576 +-0.004 times itself was told of a copter whose drag had become half more.
"""

from __future__ import annotations

import math

from onboard.core.vehicle.effects.beyond import DRAG
from onboard.core.vehicle.effects.mass_change import MassChange, ThrustChange
from onboard.core.vehicle.fit import Fit

BOTH = (MassChange.name, ThrustChange.name)


def undecided_of(effects: tuple[str, ...]) -> tuple[str, ...]:
    """Those of these effects that stand for a change that may be another.

    With a change of the drag that is not by mass, linear and square drag change by other shares,
    and neither is what it was told to be before or after.
    """
    return tuple(n for n in effects if n in (*BOTH, *DRAG)) if set(BOTH) <= set(effects) else ()


def undecided_sentence(fit: Fit, names: tuple[str, ...]) -> str:
    """What a person is told of them; empty where there are none."""
    if not names:
        return ""
    mass, thrust = (fit.model.indices(name)[0] for name in BOTH)
    pull, drag = float(fit.theta[thrust] - fit.theta[mass]), -float(fit.theta[mass])
    effect = fit.model.effect(MassChange.name)
    moment = next(s.value for s in effect.shown([0.0], [0.0]) if s.name == "moment")
    return (
        f"at {moment:.0f} s the thrust of one command became {math.exp(pull):.2f} times itself by "
        f"mass, and drag {math.exp(drag):.2f} times: nothing tells whether mass and thrust "
        "changed, or thrust and drag, or mass and drag, so that none of the three is named"
    )
