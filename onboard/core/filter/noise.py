"""Noise levels of the whitening filter and their estimation from the data.

The levels are the likeliest after the flight and what is known of them beforehand, which keeps
those that a flight says nothing of where they usually are.  One pass over the data runs a filter
bank: the levels that it is at; for each of them a neighbour, a nudge away, which tell the slope and
Fisher's information, and with them a step (:mod:`onboard.core.filter.noise_step`); and points on
the way that the last step came, in case it was too long.  The honesty of sigmas is checked again by
the residuals (:mod:`onboard.core.estimate.solution`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from onboard.core.filter.limits import LIMITS, NUDGE, STATED_M_S, USUAL_SIGMA
from onboard.core.maths.arrays import Array


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
        force_walk: velocity random walk from accelerometer noise and all that is like it, along
            the body's x and y, m/s/sqrt(s).
        lift_walk: the same along its z.  Lift and thrust act along it: of what they are shaken by,
            turbulence and rotors, samples miss some.
        shaken_walk: what else it walks by where the force is shaken: the share that samples miss of
            how much they scatter about their mean (:mod:`onboard.core.filter.shaken`), along x and
            y.
        shaken_lift: the same along z.
        tilt_walk: angle random walk of the gyroscope, rad/sqrt(s).
        bias_walk: random walk of the gyroscope's bias, rad/s/sqrt(s).
        attitude: Gauss-Markov error of the recorded tilt (correlation time
            :data:`~onboard.core.filter.limits.ATTITUDE_TIME_S`), rad.
        heading: smooth error of the recorded heading, rad.
        heading_time: after which it is another one, s.
        heading_walk: random walk of it, by a compass's noise, rad/sqrt(s).
        attitude_white: white noise of the recorded attitude beside what the jitter of its stamps
            (:data:`~onboard.core.filter.limits.STAMP_JITTER_S`) makes of a turn, rad.
        jitter: white noise of the moment that a GPS velocity is of, s: each component errs by as
            much of the acceleration (that they err together is left out).
        stated: power of the accuracy that the receiver states with which the velocity's white noise
            goes, and ``stated_colour`` its colour; none where that tells nothing.
        usually_stated: accuracy that both are of, m/s.  It is none of the levels to be found: about
            what the flight usually has, sizes and powers do not stand in for each other.
    """

    velocity: float = 0.05
    velocity_colour: float = 0.05
    vertical: float = 1.0
    height: float = 0.2
    height_walk: float = 0.05
    force_walk: float = 0.04
    lift_walk: float = 0.04
    shaken_walk: float = 0.1
    shaken_lift: float = 0.1
    tilt_walk: float = 3e-4
    bias_walk: float = 3e-5
    attitude: float = 0.02
    heading: float = 0.06
    heading_time: float = 5.0
    heading_walk: float = 3e-4
    attitude_white: float = 5e-4
    jitter: float = 3e-3
    stated: float = 0.0
    stated_colour: float = 0.0
    usually_stated: float = STATED_M_S

    def scaled(self, name: str, factor: float) -> NoiseLevels:
        """One level times ``factor``, inside its limits."""
        low, high = LIMITS[name]
        return replace(self, **{name: float(np.clip(getattr(self, name) * factor, low, high))})

    @property
    def walk_b(self) -> Array:
        """(3,) variance by which the velocity walks along body axes, (m/s)^2/s."""
        return np.array([self.force_walk, self.force_walk, self.lift_walk]) ** 2

    @property
    def shaken_b(self) -> Array:
        """(3,) share of what shakes the force along body axes that it walks by, squared."""
        return np.array([self.shaken_walk, self.shaken_walk, self.shaken_lift]) ** 2

    def walk_shaken(self, density_b: Array) -> Array:
        """(..., 3) variance of the walk where ``density_b`` (..., 3) is how much it is shaken."""
        out: Array = self.walk_b + self.shaken_b * density_b
        return out

    @property
    def as_seen(self) -> NoiseLevels:
        """The same with a heading that is forgotten as soon as what was seen of its error is.

        The floor of a slow error is none that a flight has, and one that is many times too large
        has to be as many times slower to be as smooth as what there is: the time that is found with
        it is no time.  So a floor counts with the time that such errors usually have, and what is
        beyond it with the one that was found; both powers at the lowest frequencies, by which a
        mean is unsure, add up.
        """
        floor, whole = LIMITS["heading"][0] ** 2, self.heading**2
        beyond = max(whole - floor, 0.0) / whole
        usual = (1.0 - beyond) * USUAL.heading_time
        return replace(self, heading_time=usual + beyond * self.heading_time)

    @property
    def at_highest(self) -> tuple[str, ...]:
        """Levels as high as noise of their kind goes; not times and ratios, which are no noise."""
        return tuple(
            name
            for name in ESTIMATED
            if name not in NO_VARIANCES and getattr(self, name) >= LIMITS[name][1] * np.exp(-NUDGE)
        )

    def mean_heading_variance(self, lasts: float) -> float:
        """Of the slow error of the heading, its mean over so many seconds, rad^2.

        Errors that are forgotten exponentially (Priestley 1981, 5.3).
        """
        times = lasts / self.heading_time
        if times <= 0.0:
            return self.heading**2
        return self.heading**2 * 2.0 * (times + math.expm1(-times)) / times**2

    @property
    def with_usual_heading(self) -> NoiseLevels:
        """The same with a heading that is as good as usual, if it seems worse: to be found anew.

        What makes a heading seem worse may be that it is wrong all the time.  No search finds that
        from a level that has room for it: the number that it is has a prior in every model.
        """
        if self.heading <= USUAL.heading:
            return self
        return replace(self, heading=USUAL.heading, heading_time=USUAL.heading_time)


USUAL = NoiseLevels(stated=0.5, stated_colour=0.5)
"""Levels that a flight is expected to have."""

ESTIMATED = (
    "velocity",
    "velocity_colour",
    "vertical",
    "height",
    "height_walk",
    "force_walk",
    "lift_walk",
    "shaken_walk",
    "shaken_lift",
    "tilt_walk",
    "bias_walk",
    "attitude",
    "heading",
    "heading_time",
    "heading_walk",
    "attitude_white",
    "jitter",
    "stated",
    "stated_colour",
)

STATED = ("stated", "stated_colour")
NO_VARIANCES = ("vertical", "heading_time", *STATED)
"""Those of :data:`ESTIMATED` that are no standard deviation or density of noise."""


def log_prior(levels: NoiseLevels, names: Sequence[str] = ESTIMATED) -> float:
    """Of levels beforehand, up to a constant: log-normal about the usual ones."""
    off = [getattr(levels, n) / getattr(USUAL, n) for n in names]
    return -0.5 * float(np.square(np.log(off) / USUAL_SIGMA).sum())


def nudges(centre: NoiseLevels, names: Sequence[str] = ESTIMATED) -> Array:
    """(n,) log ratios that :func:`neighbours` are apart from ``centre``, inside the limits."""
    out = [
        NUDGE if getattr(centre, name) * np.exp(NUDGE) <= LIMITS[name][1] else -NUDGE
        for name in names
    ]
    return np.array(out)


def neighbours(centre: NoiseLevels, names: Sequence[str] = ESTIMATED) -> tuple[NoiseLevels, ...]:
    """One for each level in ``names``, which is nudged, the others being those of ``centre``."""
    apart = np.exp(nudges(centre, names)).tolist()
    return tuple(centre.scaled(name, by) for name, by in zip(names, apart, strict=True))


def between(start: NoiseLevels, end: NoiseLevels, shares: Sequence[float]) -> list[NoiseLevels]:
    """Levels at some shares of the way from ``start`` to ``end``, in log-levels."""
    both = [(getattr(start, f.name), getattr(end, f.name)) for f in fields(NoiseLevels)]
    return [
        NoiseLevels(*(a if a == b else a * (b / a) ** share for a, b in both)) for share in shares
    ]
