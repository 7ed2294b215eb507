"""What an accelerometer's offsets owe to the axes of the gyroscope beside it."""

from __future__ import annotations

import math

import numpy as np

from onboard.core.estimate.limits import GYRO_CROSS_SIGMA
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY


def gyro_sigma(R_bs: Array) -> Array:
    """Sigmas (6,) of scale (1) and offset (m/s^2) by the gyroscope's axes, sensor axes.

    An offset forwards or sideways is told from a tilt by turning: a tilt stays where it is, the
    offset turns with the vehicle.  What has turned is known from the gyroscope.  One that reads
    ``e`` of a turn about the vertical as a turn about a level axis takes the vertical for tilted by
    ``e`` in the body, and the accelerometer seems to have an offset of ``g e``.  At one load both
    make the same velocity: an ordinary flight does not tell them apart, and navigation is right
    with their sum.  Where the load varies much, a turn of one against the other is found as
    :mod:`~onboard.core.physics.effects.mount_tilt`.  A bench, which turns the accelerometer by its
    faces, finds the offset alone.

    Args:
        R_bs: (3, 3) board orientation, turns of 90 degrees.
    """
    level = np.abs(R_bs[2]) < math.sqrt(0.5)
    return np.concatenate([np.zeros(3), np.where(level, STANDARD_GRAVITY * GYRO_CROSS_SIGMA, 0.0)])
