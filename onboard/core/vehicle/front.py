"""Whether the wind became another at a moment: a front, or a setting that is changed in flight.

A fit that knows a single wind takes what is left of two for gusts, and what the two have in common
for the vehicle.  Straight lines over minutes cannot follow a step, and where they are found beside
it what they leave is gusts again.  So a step is looked for at every window of the flight, as a
change of the vehicle is (:mod:`onboard.core.vehicle.sudden`), before anything else is asked; and it
has to be likelier than the straight lines, which have more unknowns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from onboard.core.vehicle.effects.wind import Wind
from onboard.core.vehicle.effects.wind_change import PLAUSIBLE_M_S
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.limits import BLOCK_S
from onboard.core.vehicle.matching import deviance, likelier
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.sudden import by_chance, gained, moments_of, white
from onboard.core.vehicle.windows import windows_of


def front_of(
    fit: Fit, blown: Callable[[float], ForceModel], gradual: ForceModel
) -> tuple[float, Fit] | None:
    """When the wind became another at once, s, and the fit that has it; None where it did not.

    Args:
        fit: of one flight, by a model whose wind is one; the likelihood's least.
        blown: makes the model whose wind becomes another at a moment, s.
        gradual: that whose wind changes over minutes.
    """
    moments, places = moments_of(fit), fit.model.indices(Wind.name)
    if not len(moments):
        return None
    windows = windows_of(fit.model.flight)
    slope = windows.mean(fit.model.columns(fit.theta, places))
    prior = np.eye(len(places)) / (2.0 * PLAUSIBLE_M_S**2)  # either level may be so far off
    gains = gained(fit, slope, prior, moments)
    if by_chance(float(np.max(gains)), len(places), len(moments)):
        return None
    plain = gained(replace(fit, noise=white(fit)), slope, prior, moments)
    at = {int(moments[np.argmax(g)]) for g in (gains, plain)}
    times = [float(fit.model.flight.t[windows.first[k]]) for k in sorted(at)]
    found = [(t, likelier(blown(t))) for t in times]
    moment, its = min(found, key=lambda f: deviance(f[1]))
    if by_chance((deviance(fit) - deviance(its)) / its.scale, len(places), len(moments)):
        return None
    return (moment, its) if deviance(its) < deviance(likelier(gradual)) else None


def on_both_sides(flight: Flight, moment: float | None) -> bool:
    """Whether as much flight is used on either side of a moment, s, as tells a wind.

    A front is looked for before it is known what of the flight the model does not describe: of
    which a take-off, say, is most of what is before it.
    """
    if moment is None:
        return True
    before = int(np.count_nonzero(flight.t < moment))
    return min(before, len(flight) - before) * flight.step_s >= BLOCK_S
