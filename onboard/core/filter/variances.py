"""The noise levels of a filter bank as the arrays that prediction and update need."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.filter.limits import (
    BIAS_START_RAD_S,
    LEAST_VELOCITY_VAR,
    STATED_M_S,
    UNKNOWN_DOWN_START_M_S,
    UNKNOWN_HEIGHT_VAR,
)
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.smooth_error import rate_walk, settled_rate
from onboard.core.filter.state import (
    BIAS,
    CH,
    CV,
    ERRORS,
    HEADING,
    MEASURED,
    PSI,
    RATE,
    STATES,
    H,
    V,
)
from onboard.core.maths.arrays import Array


class Variances:
    """Variances of the B members of a filter bank.

    Attributes:
        walk: (B, STATES) of the random walks, unit of the state squared per s; the velocity's, as
            of a force, along body axes.
        settled: (B, MEASURED) of the slow errors, Gauss-Markov, of each measured number; its unit
            squared.
        reading: (B, MEASURED) of the white noise of each measured number, its unit squared.
        shaken: (B, 3) shares of what shakes the force that are missed, squared, by body axes.
        jitter: (B,) of the moment that a velocity is of, s^2.
        heading_time: (B,) time of the heading's smooth error, s.
        stated: (B, 2) powers with which the velocity's variances, of white noise and of colour, go
            with the square of what the receiver states.
    """

    __slots__ = (
        "_attitude",
        "heading_time",
        "jitter",
        "reading",
        "settled",
        "shaken",
        "stated",
        "walk",
    )

    def __init__(self, bank: Sequence[NoiseLevels], *, attitude: bool) -> None:
        """Take the noise levels of each member, and whether the attitude may err at all."""
        B = len(bank)
        self._attitude = attitude
        self.walk = np.zeros((B, STATES))
        self.settled = np.zeros((B, MEASURED))
        self.reading = np.zeros((B, MEASURED))
        self.shaken = np.array([q.shaken_b for q in bank])
        self.jitter = np.array([q.jitter**2 for q in bank])
        self.heading_time = np.array([q.heading_time for q in bank])
        self.stated = np.array([(q.stated, q.stated_colour) for q in bank])
        for i, q in enumerate(bank):
            self.walk[i, V] = q.walk_b
            self.walk[i, CH] = q.height_walk**2
            velocity = np.array([1.0, 1.0, q.vertical**2])
            self.settled[i, V] = q.velocity_colour**2 * velocity
            self.reading[i, V] = q.velocity**2 * velocity
            # What is stated is told over the same number for all.
            usual = (STATED_M_S / q.usually_stated) ** (2.0 * self.stated[i])
            self.reading[i, V] *= usual[0]
            self.settled[i, V] *= usual[1]
            self.reading[i, H] = q.height**2
            self.reading[i, PSI] = q.attitude_white**2
            if attitude:
                self.walk[i, PSI] = q.tilt_walk**2
                self.walk[i, BIAS] = q.bias_walk**2
                self.walk[i, HEADING] = q.heading_walk**2
                self.settled[i, PSI] = (q.attitude**2, q.attitude**2, q.heading**2)
        if attitude:
            self.walk[:, RATE] = rate_walk(self.heading_time) * self.settled[:, -1]

    def of_reading(self, noise: Array, moving: Array, stated: float) -> Array:
        """(B, MEASURED) of the white noise of what one epoch measures.

        Args:
            noise: (MEASURED,), moving and stated as in
                :class:`~onboard.core.filter.innovations.Epoch`.
            moving: see there.
            stated: see there.
        """
        out = self.reading.copy()
        least = np.minimum(out[:, V], LEAST_VELOCITY_VAR)
        out[:, V] = np.maximum(out[:, V] * self.times(stated)[:, :1], least)
        out += noise + self.jitter[:, None] * moving
        return out

    def times(self, stated: float) -> Array:
        """(B, 2) times the usual variance, of white noise and of colour; ``stated`` of an epoch."""
        out: Array = stated**self.stated
        return out

    def at_start(
        self, tilt_sigma: float, heading_sigma: float, stated: float, *, down: bool, height: bool
    ) -> Array:
        """Covariance (B, STATES, STATES) of a filter that starts at a fix.

        Args:
            tilt_sigma: of the first attitude's roll and pitch, rad.
            heading_sigma: of its heading, rad.
            stated: as in :class:`~onboard.core.filter.innovations.Epoch`.
            down: whether the fix has a vertical speed.
            height: whether its height is used.
        """
        B = len(self.reading)
        times = self.times(stated)
        colour = self.settled[:, V] * times[:, 1:]
        var = np.zeros((B, STATES))
        var[:, V] = self.reading[:, V] * times[:, :1]
        if not down:
            var[:, 2] = UNKNOWN_DOWN_START_M_S**2
        var[:, H] = self.reading[:, H] if height else UNKNOWN_HEIGHT_VAR
        if self._attitude:
            var[:, PSI] = (tilt_sigma**2, tilt_sigma**2, heading_sigma**2)
            var[:, BIAS] = BIAS_START_RAD_S**2
        var[:, ERRORS:RATE] = self.settled
        var[:, CV] = colour
        var[:, RATE] = settled_rate(self.heading_time) * self.settled[:, -1]
        var[:, V] += colour
        P = np.zeros((B, STATES, STATES))
        P[:, range(STATES), range(STATES)] = var
        # GPS reads velocity + error: the start inherits the first fix's error with minus sign.
        for i in range(3):
            c = CV.start + i
            P[:, i, c] = P[:, c, i] = -colour[:, i]
        return P

    def over(
        self, duration: float, decay: Array, stated: float, shaken: Array
    ) -> tuple[Array, Array]:
        """Process noise of a step, what acts before and what after its transition.

        A random walk acts along the step: half of it before, half after the transition, and so does
        what drives the rate of a smooth error.  What decays (Gauss-Markov) has its exact share
        after it.

        Args:
            duration: s.
            decay: (B, MEASURED) factors by which the slow errors have decayed.
            stated: as in :class:`~onboard.core.filter.innovations.Step`.
            shaken: see there.

        Returns:
            Two arrays (B, STATES), unit of the state squared; the velocity's along body axes.
        """
        before = self.walk * (0.5 * duration)
        before[:, V] += 0.5 * self.shaken * shaken
        after = before.copy()
        driven = self.settled * (1.0 - decay * decay)
        driven[:, V] *= self.times(stated)[:, 1:]
        after[:, ERRORS:HEADING] += driven[:, :-1]
        return before, after
