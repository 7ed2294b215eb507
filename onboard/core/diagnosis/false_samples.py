"""Single false samples, as a finding."""

from __future__ import annotations

import math

import numpy as np

from onboard.core.diagnosis.regimes import spans
from onboard.core.inputs.spikes import Spikes
from onboard.core.physics.effects.accelerometer_spikes import AccelerometerSpikes
from onboard.core.physics.finding import Finding, Quantity

APART_S = 2.0
"""Between samples that are told as of two times [use]."""


def spikes_effect(spikes: Spikes, better: float, t0: float) -> Finding:
    """What is said of samples that were replaced.

    Args:
        spikes: which.
        better: twice the logarithm of how much likelier the receiver's velocities are without.
        t0: s on the boot clock.
    """
    square = spikes.size**2
    size = float(np.sqrt(np.mean(square)))
    sigma = float(np.std(spikes.size)) / math.sqrt(len(spikes.size))
    share = len(spikes.t) / spikes.samples
    cuts = np.flatnonzero(np.diff(spikes.t) > APART_S) + 1
    intervals = tuple((float(t[0]) - t0, float(t[-1]) - t0) for t in np.split(spikes.t, cuts))
    return Finding(
        name=AccelerometerSpikes.effect,
        unknowns={
            "size": Quantity(size, sigma, "m/s^2"),
            "share": Quantity(share, share / math.sqrt(len(spikes.t)), "1"),
        },
        share_of_mismatch=share,
        delta_bic=-better,
        held_out_before=float("nan"),
        held_out_after=float("nan"),
        parameters={},
        cure=AccelerometerSpikes.cure,
        where=spans(spikes.batches, t0, intervals, "all"),
        intervals=intervals,
    )
