"""The noise levels of a filter bank as the arrays that prediction and update need."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.filter.limits import (
    BIAS_START_RAD_S,
    UNKNOWN_DOWN_START_M_S,
    UNKNOWN_HEIGHT_VAR,
)
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.state import ATT, BIAS, CH, CV, PSI, STATES, H, V
from onboard.core.maths.arrays import Array

ROW_KINDS = 7
"""Velocity north, east, down; height; attitude about north, east, down."""


class Variances:
    """Variances of the B members of a filter bank.

    Attributes:
        density: (B, STATES) of the random walks, unit of the state squared per s.
        attitude: (B, 3) of the Gauss-Markov error of the recorded attitude, rad^2.
        colour: (B,) of the Gauss-Markov error of the GPS velocity, (m/s)^2.
        reading: (B, ROW_KINDS) of the white noise of each measured number, its unit squared.
    """

    __slots__ = ("attitude", "colour", "density", "reading")

    def __init__(self, bank: Sequence[NoiseLevels]) -> None:
        B = len(bank)
        self.density = np.zeros((B, STATES))
        self.attitude = np.zeros((B, 3))
        self.colour = np.zeros(B)
        self.reading = np.zeros((B, ROW_KINDS))
        for i, q in enumerate(bank):
            self.density[i, V] = q.force_walk**2
            self.density[i, PSI] = q.tilt_walk**2
            self.density[i, BIAS] = q.bias_walk**2
            self.density[i, CH] = q.height_walk**2
            self.attitude[i] = (q.attitude**2, q.attitude**2, q.heading**2)
            self.colour[i] = q.velocity_colour**2
            self.reading[i] = (*(q.velocity**2,) * 3, q.height**2, *(q.attitude**2,) * 3)

    def at_start(
        self, tilt_sigma: float, heading_sigma: float, *, down: bool, height: bool, attitude: bool
    ) -> Array:
        """Covariance (B, STATES, STATES) of a filter that starts at a fix.

        Args:
            tilt_sigma: of the first attitude's roll and pitch, rad.
            heading_sigma: of its heading, rad.
            down: whether the fix has a vertical speed.
            height: whether its height is used.
            attitude: whether the attitude may err at all.
        """
        B = len(self.colour)
        var = np.empty((B, STATES))
        var[:, V] = self.reading[:, :3]
        if not down:
            var[:, 2] = UNKNOWN_DOWN_START_M_S**2
        var[:, H] = self.reading[:, 3] if height else UNKNOWN_HEIGHT_VAR
        var[:, PSI] = (tilt_sigma**2, tilt_sigma**2, heading_sigma**2)
        var[:, BIAS] = BIAS_START_RAD_S**2
        var[:, ATT] = self.attitude
        var[:, CH] = 0.0
        var[:, CV] = self.colour[:, None]
        if not attitude:
            var[:, PSI] = var[:, BIAS] = var[:, ATT] = 0.0
        P = np.zeros((B, STATES, STATES))
        P[:, range(STATES), range(STATES)] = var
        # GPS reads velocity + error: the start inherits the first fix's error with minus sign.
        for i in range(3):
            c = CV.start + i
            P[:, i, i] += self.colour
            P[:, i, c] = P[:, c, i] = -self.colour
        return P

    def over(
        self, duration: float, keep_att: float, keep_cv: float, *, attitude: bool
    ) -> tuple[Array, Array]:
        """Process noise of a step, what acts before and what after its transition.

        A random walk acts along the step: half of it before, half after the transition.  What
        decays (Gauss-Markov) has its exact share after it.

        Args:
            duration: s.
            keep_att: factor by which the recorded attitude's error has decayed.
            keep_cv: the same of the GPS velocity's error.
            attitude: whether the attitude may err at all.

        Returns:
            Two arrays (B, STATES), unit of the state squared.
        """
        after = self.density * duration
        after[:, ATT] = self.attitude * (1.0 - keep_att**2)
        after[:, CV] = self.colour[:, None] * (1.0 - keep_cv**2)
        if not attitude:
            after[:, PSI] = after[:, BIAS] = after[:, ATT] = 0.0
        before = 0.5 * after
        before[:, ATT] = before[:, CV] = 0.0
        after -= before
        return before, after
