"""Accelerometer noise in the regressors: what of a regressor's information is not signal.

The regressors of the scale are integrals of *noisy* accelerations (errors in variables).  What the
velocity walks by along each axis is carried through the same integrals and the same whitening as
the regressors are (:mod:`onboard.core.filter.kernel`), with its density where it is: noise that is
strong in a gust counts little there, and is none in the calm after it, where a little counts much.
Its square in the whitened innovations, times the share of it that samples show as noise, is the
expected part of the sums that is noise.
"""

from __future__ import annotations

import numpy as np

from onboard.core.filter.limits import FEWEST_NOISE_MEANS, NOISE_MEAN_S
from onboard.core.inputs.segments import Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.medians import NORMAL_MEDIAN


def noise_density(segment: Segment) -> Array:
    """That of a segment's samples: :func:`sample_noise_density`."""
    return sample_noise_density(segment.t, segment.raw_s)


def share_of_walk(segment: Segment, walk: Array) -> Array:
    """(3,) of what the velocity walks by in a second (3,), sensor axes, that samples show as noise.

    What looks like noise sample by sample may be a tone that integrates to nothing; the velocity's
    random walk, found from the residuals, is all that it can amount to.
    """
    out: Array = np.minimum(segment.once(noise_density) / walk, 1.0)
    return out


def sample_noise_density(t: Array, raw: Array) -> Array:
    """Density (m/s^2)^2 s of what looks like white noise in each axis' samples.

    Samples are averaged over :data:`NOISE_MEAN_S`, third differences of the means take the
    manoeuvre out (white noise: 20 times its variance), and the median absolute deviation ignores
    the few jerks that are left.

    Args:
        t: (n,) s.
        raw: (n, 3) sensor axes, m/s^2.

    Returns:
        (3,) sensor axes; zeros where there are too few samples to tell.
    """
    step = (t[-1] - t[0]) / max(len(t) - 1, 1)
    size = max(1, round(NOISE_MEAN_S / step))
    count = len(t) // size
    if count < FEWEST_NOISE_MEANS:
        return np.zeros(3)
    blocks = raw[: count * size].reshape(count, size, 3).mean(axis=1)
    third = np.diff(blocks, n=3, axis=0)
    sigma = (
        np.median(np.abs(third - np.median(third, axis=0)), axis=0) / NORMAL_MEDIAN / np.sqrt(20.0)
    )
    out: Array = sigma**2 * size * step
    return out
