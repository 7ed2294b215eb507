"""Samples that were rounded, without what rounding adds to how they change.

What is in proportion to a signal is found too small where the signal's samples are rounded: the
sums of its squares have the rounding in them, those of its products have not (errors in variables).
Against a throttle in whole per cents a pull of the compass lost two per cent of its size, by five
of its sigmas.  Regressing on what is expected of the signal, given its samples, has no such error
(regression calibration, R. J. Carroll et al., *Measurement Error in Nonlinear Models*, ch. 4).
"""

from __future__ import annotations

import numpy as np

from onboard.core.inputs.limits import WHOLE
from onboard.core.maths.arrays import Array


def unrounded(t: Array, x: Array, step: float) -> Array:
    """What is expected of a signal (n,), by each sample and how far it is off its neighbours' line.

    Rounding is independent from sample to sample, of variance ``step^2 / 12`` (B. Widrow, 1956); so
    much of the mean square by which samples are off their neighbours' lines is theirs, and by that
    share of how far it is off each goes back to its line.

    Args:
        t: (n,) times of the samples, s.
        x: (n,) the samples; as they are if they are not all in whole steps.
        step: to which they were rounded.
    """
    whole = x / step
    if len(x) < 3 or np.any(np.abs(whole - np.round(whole)) > WHOLE) or np.any(np.diff(t) <= 0.0):
        return x
    share = (t[1:-1] - t[:-2]) / (t[2:] - t[:-2])
    off = x[1:-1] - (x[:-2] + share * (x[2:] - x[:-2]))
    square = float(np.mean(off**2))
    if square == 0.0:
        return x
    out = x.copy()
    # Of independent roundings two thirds at the most: where it is all that there is.
    out[1:-1] -= min(step**2 / 12.0 / square, 2.0 / 3.0) * off
    return out
