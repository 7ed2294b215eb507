"""Noise levels of the whitening filter and their estimation from the data.

The levels are found by maximum likelihood: one pass over the data runs the filter for a *star*
of levels (the centre, and every level up and down by a factor) side by side, a parabola through
each triple of log-likelihoods gives a step; the next pass tries shares of that step on a *line*,
for some levels trade with each other, and the likeliest is taken.  Constant factors here, not
tuned numbers: only ratios of the order of one matter for the estimate, and honesty of the sigmas
is checked again by the residuals (:mod:`onboard.core.estimate.solution`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np


@dataclass(frozen=True, slots=True)
class NoiseLevels:
    """Standard deviations and random-walk densities that the whitening filter assumes.

    Attributes:
        velocity: white noise of a GPS velocity component, m/s.
        velocity_colour: coloured part (time constant :data:`COLOUR_TIME_S`), m/s.
        height: white noise of GPS height, m.
        height_walk: wander of GPS height, m/sqrt(s).
        force_walk: velocity random walk from accelerometer noise and all that is like it,
            m/s/sqrt(s).
        tilt_walk: angle random walk of the gyroscope, rad/sqrt(s).
        bias_walk: random walk of the gyroscope's bias, rad/s/sqrt(s).
        attitude: slow error of the recorded tilt (time constant :data:`ATTITUDE_TIME_S`), rad.
        heading: slow error of the recorded heading, rad.
    """

    velocity: float = 0.05
    velocity_colour: float = 0.02
    height: float = 0.2
    height_walk: float = 0.05
    force_walk: float = 0.02
    tilt_walk: float = 3e-4
    bias_walk: float = 3e-5
    attitude: float = 0.01
    heading: float = 0.03

    def scaled(self, name: str, factor: float) -> NoiseLevels:
        """One level times ``factor``, inside its limits."""
        low, high = LIMITS[name]
        return replace(self, **{name: float(np.clip(getattr(self, name) * factor, low, high))})


COLOUR_TIME_S = 3.0
"""Receivers filter their velocity over a second or two, multipath lasts some seconds."""
ATTITUDE_TIME_S = 10.0
"""An EKF that weighs GPS against gyroscopes forgets a tilt error in some tens of seconds."""

LIMITS: dict[str, tuple[float, float]] = {
    "velocity": (0.02, 2.0),
    "velocity_colour": (0.005, 1.0),
    "height": (0.05, 10.0),
    "height_walk": (0.01, 2.0),
    "force_walk": (0.01, 3.0),
    "tilt_walk": (1e-4, 0.03),
    "bias_walk": (1e-5, 3e-4),
    "attitude": (0.01, 0.2),
    "heading": (0.015, 0.5),
}
"""No sensor on a small vehicle is better than the lower ends; a noiseless simulation must not make
the filter believe that timing, interpolation and filters are modelled to the last digit.

The recorded attitude's are no such formality.  An EKF errs with the manoeuvre, and smoothly: the
likelihood sees how smooth its error is, not how large, and runs to whatever end there is.  With
half the tilt's end, flights of ArduPilot's SITL err 2.4 times as much, beyond 5 sigma."""

ESTIMATED = (
    "velocity",
    "velocity_colour",
    "height",
    "height_walk",
    "force_walk",
    "tilt_walk",
    "bias_walk",
    "attitude",
    "heading",
)

STAR_FACTOR = 2.0
LINE = (0.25, 0.5, 1.0)
"""Shares of a step that are tried: levels that trade with each other make the whole too long."""


def _triple(level: float, limits: tuple[float, float]) -> tuple[float, float]:
    """Two more values of a level: one to each side, or both to the inner side of a limit."""
    low, high = limits
    lower, upper = max(level / STAR_FACTOR, low), min(level * STAR_FACTOR, high)
    # A value clipped to (nearly) the centre itself would bend the parabola: take a half step in.
    if level / lower < STAR_FACTOR**0.25:
        lower = level * STAR_FACTOR**0.5
    elif upper / level < STAR_FACTOR**0.25:
        upper = level / STAR_FACTOR**0.5
    return lower, upper


def star(centre: NoiseLevels) -> tuple[NoiseLevels, ...]:
    """The centre, then two more values of each estimated level, the others as they are."""
    return (
        centre,
        *(
            replace(centre, **{name: value})
            for name in ESTIMATED
            for value in _triple(getattr(centre, name), LIMITS[name])
        ),
    )


def stepped(centre: NoiseLevels, log_likelihood: Sequence[float]) -> NoiseLevels:
    """Next centre from the log-likelihoods of :func:`star`: a parabola in each log-level.

    A step is at most :data:`STAR_FACTOR` squared; where the likelihood is flat or convex, it goes
    towards the best of the three values.
    """
    longest = 2.0 * float(np.log(STAR_FACTOR))
    levels = centre
    for i, name in enumerate(ESTIMATED):
        here = getattr(centre, name)
        x = np.log(np.array(_triple(here, LIMITS[name])) / here)
        rise = np.array(log_likelihood[1 + 2 * i : 3 + 2 * i]) - log_likelihood[0]
        # The parabola through the origin and both points: rise = slope x + curve x^2 / 2.
        slope, curve = np.linalg.solve(np.column_stack([x, x * x / 2.0]), rise)
        if curve < -1e-6:
            step = -slope / curve
        else:
            best = int(np.argmax(rise))
            step = longest * float(np.sign(x[best])) if rise[best] > 0.0 else 0.0
        levels = levels.scaled(name, float(np.exp(np.clip(step, -longest, longest))))
    return levels


def line(centre: NoiseLevels, target: NoiseLevels) -> tuple[NoiseLevels, ...]:
    """The centre, then the shares :data:`LINE` of the way to ``target``, in log-levels."""
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
            for share in LINE
        ),
    )


def distance(a: NoiseLevels, b: NoiseLevels) -> float:
    """Largest absolute log ratio of any level."""
    return max(
        abs(float(np.log(getattr(a, f.name) / getattr(b, f.name)))) for f in fields(NoiseLevels)
    )
