"""Noise levels of the whitening filter and their estimation from the data.

The levels are found by maximum likelihood.  One pass over the data runs a filter bank on a
*stencil* of levels: the centre, and every level up and down by a factor, which tells a step
(:mod:`onboard.core.filter.noise_step`).  The next pass is a *line search*: it tries shares of that
step and takes the likeliest.  The honesty of sigmas is checked again by the residuals
(:mod:`onboard.core.estimate.solution`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from onboard.core.filter.limits import LIMITS, LINE_SHARES, STENCIL_FACTOR


@dataclass(frozen=True, slots=True)
class NoiseLevels:
    """Standard deviations and random-walk densities that the whitening filter assumes.

    Attributes:
        velocity: white noise of a horizontal GPS velocity component, m/s.
        velocity_colour: Gauss-Markov error of it (correlation time
            :data:`~onboard.core.filter.limits.COLOUR_TIME_S`), m/s.
        vertical: how many times as large both are for the velocity down: satellites are above.
        height: white noise of GPS height, m.
        height_walk: wander of GPS height, m/sqrt(s).
        force_walk: velocity random walk from accelerometer noise and all that is like it,
            m/s/sqrt(s).
        tilt_walk: angle random walk of the gyroscope, rad/sqrt(s).
        bias_walk: random walk of the gyroscope's bias, rad/s/sqrt(s).
        attitude: Gauss-Markov error of the recorded tilt (correlation time
            :data:`~onboard.core.filter.limits.ATTITUDE_TIME_S`), rad.
        heading: smooth error of the recorded heading (its time:
            :data:`~onboard.core.filter.limits.HEADING_TIME_S`), rad.
        attitude_white: white noise of the recorded attitude beside what the jitter of its stamps
            (:data:`~onboard.core.filter.limits.STAMP_JITTER_S`) makes of a turn, rad.
        jitter: white noise of the moment that a GPS velocity is of, s: each component errs by as
            much of the acceleration (that they err together is left out).
    """

    velocity: float = 0.05
    velocity_colour: float = 0.05
    vertical: float = 1.0
    height: float = 0.2
    height_walk: float = 0.05
    force_walk: float = 0.04
    tilt_walk: float = 3e-4
    bias_walk: float = 3e-5
    attitude: float = 0.02
    heading: float = 0.06
    attitude_white: float = 5e-4
    jitter: float = 3e-3

    def scaled(self, name: str, factor: float) -> NoiseLevels:
        """One level times ``factor``, inside its limits."""
        low, high = LIMITS[name]
        return replace(self, **{name: float(np.clip(getattr(self, name) * factor, low, high))})


ESTIMATED = (
    "velocity",
    "velocity_colour",
    "vertical",
    "height",
    "height_walk",
    "force_walk",
    "tilt_walk",
    "bias_walk",
    "attitude",
    "heading",
    "attitude_white",
    "jitter",
)


def triple(level: float, limits: tuple[float, float]) -> tuple[float, float]:
    """Two more values of a level: one to each side, or both to the inner side of a limit."""
    low, high = limits
    lower, upper = max(level / STENCIL_FACTOR, low), min(level * STENCIL_FACTOR, high)
    # A value clipped to (nearly) the centre itself would bend the parabola: take a half step in.
    if level / lower < STENCIL_FACTOR**0.25:
        lower = level * STENCIL_FACTOR**0.5
    elif upper / level < STENCIL_FACTOR**0.25:
        upper = level / STENCIL_FACTOR**0.5
    return lower, upper


def stencil(centre: NoiseLevels, names: Sequence[str] = ESTIMATED) -> tuple[NoiseLevels, ...]:
    """The centre, then two other values of each level in ``names``, one level at a time."""
    return (
        centre,
        *(
            replace(centre, **{name: value})
            for name in names
            for value in triple(getattr(centre, name), LIMITS[name])
        ),
    )


def line_search(centre: NoiseLevels, target: NoiseLevels) -> tuple[NoiseLevels, ...]:
    """The centre, then the shares :data:`LINE_SHARES` of the way to ``target``, in log-levels."""
    return (
        centre,
        *(
            NoiseLevels(
                *(
                    getattr(centre, f.name)
                    * (getattr(target, f.name) / getattr(centre, f.name)) ** share
                    for f in fields(NoiseLevels)
                )
            )
            for share in LINE_SHARES
        ),
    )


def distance(a: NoiseLevels, b: NoiseLevels) -> float:
    """Largest absolute log ratio of any level."""
    return max(
        abs(float(np.log(getattr(a, f.name) / getattr(b, f.name)))) for f in fields(NoiseLevels)
    )
