"""What all accelerometers of a vehicle ask for alike: not sensors, but what they share."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from onboard.core.estimate.joint import Joint
from onboard.core.estimate.limits import LIKE_SHARE, LIKE_SIGMAS
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY


@dataclass(frozen=True, slots=True)
class CommonChange:
    """The same change of an offset in all accelerometers.

    Attributes:
        axis: 0, 1 or 2, sensor axes.
        change: mean of it, m/s^2.
        sigma: of that.
        spread: largest difference between two of them, m/s^2.
    """

    axis: int
    change: float
    sigma: float
    spread: float


def common_changes(found: Joint, least: float) -> tuple[CommonChange, ...]:
    """Offsets of which all accelerometers (two at least) ask for the same change.

    Their mean is beyond three of its sigmas and more than ``least`` (m/s^2).  Their differences are
    within three of their own sigmas; or they are small against it, for pairs are known so well
    that no two sensors are ever quite alike.
    """
    n = len(found.imus)
    if n < 2:
        return ()
    out = []
    for axis in range(3):
        changes = found.value[:, 3 + axis] - found.before[:, 3 + axis]
        C = found.number(3 + axis)
        mean, sigma = float(changes.mean()), math.sqrt(float(C.sum())) / n
        if abs(mean) <= max(LIKE_SIGMAS * sigma, least) or not _alike(changes, C):
            continue
        spread = float(changes.max() - changes.min())
        out.append(CommonChange(axis, mean, sigma, spread))
    return tuple(out)


def _alike(changes: Array, C: Array) -> bool:
    """Whether changes with covariance ``C`` (n, n) are the same, or differ by little of them."""
    apart = np.abs(changes[:, None] - changes[None, :])
    variance = np.diag(C)[:, None] + np.diag(C)[None, :] - 2.0 * C
    sigma = np.sqrt(np.maximum(variance, 0.0))
    little = LIKE_SHARE * abs(float(changes.mean()))
    return bool(np.all(apart <= np.maximum(LIKE_SIGMAS * sigma, little)))


def in_words(changes: tuple[CommonChange, ...], count: int, vertical: int) -> tuple[str, ...]:
    """One sentence for what is level, one for the vertical axis, without a full stop.

    Args:
        changes: of the offsets, by axis.
        count: of accelerometers.
        vertical: the axis along gravity in level flight, 0, 1 or 2.
    """
    who = "both accelerometers" if count == 2 else f"all {count} accelerometers"
    sensors = f"{('two', 'three', 'four', 'five')[count - 2]} sensors alike are off"
    level = [c for c in changes if c.axis != vertical]
    out = []
    if level:
        tilt = math.degrees(math.atan(math.hypot(*(c.change for c in level)) / STANDARD_GRAVITY))
        out.append(
            f"{who} ask for {_named(level)}: it is likelier that the board is tilted by {tilt:.2g} "
            f"degrees, or that the ground was when they were calibrated, than that {sensors}"
        )
    upright = [c for c in changes if c.axis == vertical]
    if upright:
        out.append(
            f"{who} ask for {_named(upright)}: it is likelier that the way they were calibrated, "
            f"or the receiver's vertical speed, is wrong than that {sensors}"
        )
    return tuple(out)


def _named(changes: list[CommonChange]) -> str:
    """``the same change of the x offset, -0.11, and of the y offset, +0.08 m/s^2``."""
    parts = [f"of the {'xyz'[c.axis]} offset, {c.change:+.2f}" for c in changes]
    return f"the same change {', and '.join(parts)} m/s^2"
