"""Unknowns that physics bounds from below, as a part of the model: a drag is never negative.

The prior has nothing below :attr:`~onboard.core.vehicle.effects.effect.Unknown.least`, so the
likeliest unknowns are those of a quadratic on a half-space.  What is told of one at its bound is
that, with the sigma that it would have anywhere else.

Where a fit without the bounds would go below one by more than chance, and by more than matters,
such an unknown is asked to stand for something that the model has not got.  Held at its bound it
would bend all others in its place: so it stands for that, has no name, and the flight is not
explained.
"""

from __future__ import annotations

import numpy as np

from onboard.core.maths.chi_square import survival
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.limits import FALSE_ALARM


def at_bounds(fit: Fit) -> bool:
    """Whether an unknown is as small as it can be."""
    return bool(np.any(fit.theta <= fit.model.least))


def below_bounds(fit: Fit) -> tuple[str, ...]:
    """Effects with an unknown below its bound, of a fit that does not know any."""
    unknowns = fit.model.unknowns
    bounded = [k for k, u in enumerate(unknowns) if np.isfinite(u.least)]
    out = []
    for k in bounded:
        short = float(unknowns[k].least - unknowns[k].floor - fit.theta[k]) / float(fit.sigma[k])
        # Of one side alone.
        if short > 0.0 and 0.5 * survival(short**2, 1) < FALSE_ALARM / len(bounded):
            out.append(fit.model.effect_of(k).name)
    return tuple(dict.fromkeys(out))


def above_bounds(fit: Fit) -> tuple[str, ...]:
    """Effects with an unknown above what it can be."""
    unknowns = fit.model.unknowns
    bounded = [k for k, u in enumerate(unknowns) if np.isfinite(u.most)]
    out = []
    for k in bounded:
        far = float(fit.theta[k] - unknowns[k].most - unknowns[k].floor) / float(fit.sigma[k])
        if far > 0.0 and 0.5 * survival(far**2, 1) < FALSE_ALARM / len(bounded):
            out.append(fit.model.effect_of(k).name)
    return tuple(dict.fromkeys(out))


def below_sentence(names: tuple[str, ...]) -> str:
    """What a person is told of them; empty where there are none."""
    return _sentence(names, "less than none")


def above_sentence(names: tuple[str, ...]) -> str:
    """The same of those that are above what they can be."""
    return _sentence(names, "more than physics has")


def _sentence(names: tuple[str, ...], what: str) -> str:
    if not names:
        return ""
    said = " and ".join(names)
    return f"{said} would have to be {what}, so that something else acts there"
