"""What goes through the whitening filter: steps and epochs in, whitened innovations out.

What a regressor adds is kept as the filter takes it: beside what is known (column 0, the value at
``theta = 0``), so that the whole at ``theta`` is the product with ``(1, -theta)``.  A *stack* is
three vectors in body axes, one above the other: (9, m + 1); turned to NED, they belong to
velocity, height (of which only the component down counts) and attitude: (7, m + 1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.state import MEASURED
from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import skew


@dataclass(frozen=True, slots=True)
class Step:
    """One step of prediction, in body axes of its start; ``P`` turns to them from a later moment.

    Attributes:
        duration: T, s.
        turn: (3, 3) ``P`` at the end.
        moved: (3, 8) side by side ``integral P f dtau``, m/s; ``integral (T - tau) P f dtau``, m;
            ``integral P dtau`` (3, 3), s; and what a bias of the gyroscope changes the velocity
            by, (3, 3), m/s per rad/s.
        columns: (9, m + 1) stack of what the m unknowns add to velocity, height and attitude;
            nothing is known, column 0 is zero.
        missed: (6,) variances of what the samples miss: of velocity, (m/s)^2, and turn, rad^2.
        shaken: (3,) variances of velocity if all that shakes the force were missed, (m/s)^2.
        stated: of the fix that it leads to, as in :class:`Epoch`.
    """

    duration: float
    turn: Array
    moved: Array
    columns: Array
    missed: Array
    shaken: Array
    stated: float = 1.0


@dataclass(frozen=True, slots=True)
class Steps:
    """K steps of prediction side by side: fields as in :class:`Step`, each with (K,) in front."""

    duration: Array
    turn: Array
    moved: Array
    columns: Array
    missed: Array
    shaken: Array
    stated: Array

    def __len__(self) -> int:
        return len(self.duration)

    def __getitem__(self, k: int) -> Step:
        duration = float(self.duration[k])
        return Step(
            duration,
            self.turn[k],
            self.moved[k],
            self.columns[k],
            self.missed[k],
            self.shaken[k],
            float(self.stated[k]),
        )


def steps(
    duration: Array,
    turn: Array,
    force: Array,
    mean_turn: Array,
    stack: Array,
    missed: Array,
    shaken: Array,
    stated: Array,
) -> Steps:
    """K steps of prediction from their integrals.

    Args:
        duration: (K,) T, s.
        turn: (K, 3, 3) ``P`` at the end.
        force: (K, 2, 3) ``integral P f dtau``, m/s, and ``integral (T - tau) P f dtau``, m.
        mean_turn: (K, 3, 3) ``integral P dtau``, s.
        stack: (K, 9, m + 1) both of these per unit of each of the m unknowns, and the turn that
            they add, rad per unit, behind a column of zeros: becomes the columns of the steps.
        missed: (K, 6) as in :class:`Step`.
        shaken: (K, 3) see there.
        stated: (K,) see there.
    """
    # What turns at a steady rate meets the force on the mean in proportion to its time left.
    arm = skew(force[:, 0] - force[:, 1] / duration[:, None])
    moved = np.concatenate([force.swapaxes(1, 2), mean_turn, arm @ mean_turn], axis=2)
    gained, turned = stack[:, 0:3], stack[:, 6:9]
    np.subtract(arm @ turned, gained, out=gained)
    np.negative(turned, out=turned)
    return Steps(duration, np.ascontiguousarray(turn), moved, stack, missed, shaken, stated)


@dataclass(frozen=True, slots=True)
class Epoch:
    """What one fix measures, and the direct regressors there.

    Attributes:
        t: time on the boot clock, latency removed, s.
        velocity: (3,) NED, m/s; NaN down where the receiver has no vertical speed.
        height: above the ellipsoid or mean sea level, m.
        latitude: rad.
        R_attitude: (3, 3) recorded attitude, body to NED; None where no sample is near.
        body: (9, m + 1) stack of what a measurement has in body axes: in column 0 less what the
            reported one is known to differ by (the receiver's averaging, the lever arm).
        ned: (7, m + 1) what it has in NED: in column 0 velocity and height.
        along_velocity: (m,) regressors of the position as multiples of the velocity, s per unit.
        trusted: whether the receiver is to be believed.
        noise: (7,) variances beside those of the levels.
        moving: (7,) squares of how fast each number changes, its unit squared per s^2.
        stamp: the receiver's, on the boot clock, s: whatever latency is taken out of ``t``.
        stated: square of the velocity's accuracy by the receiver's own word, over that of
            :data:`~onboard.core.filter.limits.STATED_M_S`; 1 where it says nothing.
    """

    t: float
    velocity: Array
    height: float
    latitude: float
    R_attitude: Array | None
    body: Array
    ned: Array
    along_velocity: Array
    trusted: bool
    noise: Array = field(default_factory=lambda: np.zeros(MEASURED))
    moving: Array = field(default_factory=lambda: np.zeros(MEASURED))
    stamp: float = math.nan
    stated: float = 1.0


@dataclass(frozen=True, slots=True)
class Epochs:
    """n epochs side by side: fields as in :class:`Epoch`, each with (n,) in front.

    ``near`` (n,) says where a sample of the recorded attitude is near; elsewhere there is none.
    Few unknowns act in NED: ``ned`` (n, 7, c) has the c columns that are not zero, which are the
    columns ``acting`` (c,) of an epoch's own.
    """

    t: Array
    velocity: Array
    height: Array
    latitude: Array
    R_attitude: Array
    near: NDArray[np.bool_]
    body: Array
    ned: Array
    acting: NDArray[np.int64]
    along_velocity: Array
    trusted: NDArray[np.bool_]
    noise: Array
    moving: Array
    stamp: Array
    stated: Array

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, e: int) -> Epoch:
        ned = np.zeros((MEASURED, self.body.shape[2]))
        ned[:, self.acting] = self.ned[e]
        return Epoch(
            float(self.t[e]),
            self.velocity[e],
            float(self.height[e]),
            float(self.latitude[e]),
            self.R_attitude[e] if self.near[e] else None,
            self.body[e],
            ned,
            self.along_velocity[e],
            bool(self.trusted[e]),
            self.noise[e],
            self.moving[e],
            float(self.stamp[e]),
            float(self.stated[e]),
        )


@dataclass(frozen=True, slots=True)
class WhitenedInnovations:
    """Whitened innovations of one epoch for all B members of the filter bank.

    Attributes:
        t: time of the epoch, s.
        y: (B, r) whitened innovations at ``theta = 0``, dimensionless.
        h: (B, r, m) their regressors: at ``theta`` they are ``y - h theta``.
        log_var: (B, r) log variance of each before whitening, given those before it.
        log_det: (B,) log determinant of the covariance before whitening, and what else is taken off
            twice the log-likelihood.
        velocities: how many of the r are of velocity: they come first.
        height: whether one of height follows; the rest are of attitude.
        innovation: (v,) velocity innovation of member 0 at the current estimate, NED, m/s.
        raw_innovation: (v,) the same at ``theta = 0``.
        raw_columns: (v, m) its regressors.
        refused: names of what the gates refused.
        refused_by: (2 or 3,) innovation of a velocity that was refused, NED, m/s; else empty.
    """

    t: float
    y: Array
    h: Array
    log_var: Array
    log_det: Array
    velocities: int
    height: bool
    innovation: Array
    raw_innovation: Array
    raw_columns: Array
    refused: tuple[str, ...]
    refused_by: Array
