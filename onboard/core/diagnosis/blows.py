"""Blows that the samples may have missed, by the vibration that an autopilot reports.

ArduPilot measures vibration at the rate of the sensor: what is above 5 Hz, squared, through a
low-pass of 2 Hz (``AP_InertialSensor::calc_vibration_and_clipping``).  A blow that changes the
velocity by ``J`` within ``tau`` adds ``2 pi f J^2 / tau`` to that square at once, of which
``d = exp(-2 pi f s)`` is left ``s`` later.  What lasts for longer than samples are apart they have
felt, so between two reports no blow has changed the velocity unseen by more than

    ``J^2 = tau (y - d y_before) / (2 pi f d)``,

with the squares ``y`` of both reports, ``d`` of the time between them and ``tau`` of that between
two samples.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.diagnosis.limits import ORDINARY_RISE, VIBRATION_HZ
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array

POLE = 2.0 * np.pi * VIBRATION_HZ
"""Of the low-pass, 1/s [data sheet]."""
LEFT = 1e-12
"""Of a blow, two seconds after it: of what is longer ago no report says anything [physics]."""


class Blows:
    """By how much a velocity may have changed and nobody has felt it, over a flight."""

    def __init__(self, batches: Sequence[Batch]) -> None:
        """Take the flight; one whose vibration is not reported has no blow that is known of."""
        told = [c.segment.slow["vibration"] for c in batches if "vibration" in c.segment.slow]
        self._t, self._step = np.zeros(0), 0.0
        self._most: Array = np.zeros(0)
        if not told:
            return
        t, first = np.unique(np.concatenate([x[0] for x in told]), return_index=True)
        if len(t) < 2:
            return
        y = np.sum(np.concatenate([x[1] for x in told])[first] ** 2, axis=1)
        left = np.exp(-POLE * np.diff(t))
        rise = y[1:] - left * y[:-1]
        beyond = np.maximum(rise - np.quantile(rise, ORDINARY_RISE), 0.0)
        apart = float(np.median(np.concatenate([np.diff(c.segment.t) for c in batches])))
        self._t, self._step = t[1:], float(np.median(np.diff(t)))
        # After a long silence nothing is left, and anything may have been.
        self._most = np.sqrt(apart * beyond / (POLE * np.maximum(left, LEFT)))

    def near(self, t: float, within: float) -> float:
        """The largest change of velocity that may have been missed, m/s.

        Args:
            t: when, s on the boot clock.
            within: how far from it the blow may have been, s.
        """
        first, last = np.searchsorted(self._t, (t - within, t + within + self._step))
        return float(np.max(self._most[first:last], initial=0.0))
