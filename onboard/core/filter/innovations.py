"""What goes through the whitening filter: steps and epochs in, whitened innovations out."""

from __future__ import annotations

from dataclasses import dataclass

from onboard.core.maths.arrays import Array


@dataclass(frozen=True, slots=True)
class Step:
    """One step of prediction, in body axes of its start; ``P`` turns to them from a later moment.

    Attributes:
        duration: T, s.
        turn: (3, 3) ``P`` at the end.
        force: (3,) ``integral P f dtau``, m/s.
        force_to_end: (3,) ``integral (T - tau) P f dtau``, m.
        mean_turn: (3, 3) ``integral P dtau``, s.
        columns: (3, m) as ``force``, per unit of each of the m unknowns.
        columns_to_end: (3, m) as ``force_to_end``.
        columns_turn: (3, m) the turn that they add, rad per unit.
    """

    duration: float
    turn: Array
    force: Array
    force_to_end: Array
    mean_turn: Array
    columns: Array
    columns_to_end: Array
    columns_turn: Array


@dataclass(frozen=True, slots=True)
class Epoch:
    """What one fix measures, and the direct regressors there.

    Attributes:
        t: time on the boot clock, latency removed, s.
        velocity: (3,) NED, m/s; NaN down where the receiver has no vertical speed.
        height: above the ellipsoid or mean sea level, m.
        latitude: rad.
        R_attitude: (3, 3) recorded attitude, body to NED; None where no sample is near.
        known_body: (3,) what the reported velocity is known to differ by (the receiver's averaging,
            the lever arm), body axes, m/s.
        known_height: the same of the height, m.
        velocity_body: (3, m) regressors of the velocity, body axes, m/s per unit.
        velocity_ned: (3, m) the same in NED.
        position_body: (3, m) regressors of the position, body axes, m per unit.
        position_ned: (3, m) the same in NED.
        along_velocity: (m,) regressors of the position as multiples of the velocity, s per unit.
        attitude_body: (3, m) regressors of the recorded attitude, body axes, rad per unit.
        attitude_ned: (3, m) the same in NED.
        trusted: whether the receiver is to be believed.
    """

    t: float
    velocity: Array
    height: float
    latitude: float
    R_attitude: Array | None
    known_body: Array
    known_height: float
    velocity_body: Array
    velocity_ned: Array
    position_body: Array
    position_ned: Array
    along_velocity: Array
    attitude_body: Array
    attitude_ned: Array
    trusted: bool


@dataclass(frozen=True, slots=True)
class WhitenedInnovations:
    """Whitened innovations of one epoch for all B members of the filter bank.

    Attributes:
        t: time of the epoch, s.
        y: (B, r) whitened innovations at ``theta = 0``, dimensionless.
        h: (B, r, m) their regressors: at ``theta`` they are ``y - h theta``.
        log_det: (B,) log determinant of the covariance before whitening.
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
    log_det: Array
    velocities: int
    height: bool
    innovation: Array
    raw_innovation: Array
    raw_columns: Array
    refused: tuple[str, ...]
    refused_by: Array
