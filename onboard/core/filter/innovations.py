"""What goes through the whitening filter: steps and epochs in, whitened rows out."""

from __future__ import annotations

from dataclasses import dataclass

from onboard.core.maths.arrays import Array


@dataclass(frozen=True, slots=True)
class Step:
    """What one interval brings, in body axes of its start (m unknowns)."""

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
    """What one GPS epoch measures, and the direct columns there.

    ``known_body`` (m/s) and ``known_height`` (m) are what the report differs by, as far as known:
    the receiver's averaging and the place of its antenna.
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
class Rows:
    """Whitened rows of one epoch for every member of the bank.

    ``y`` (B, r), ``h`` (B, r, m); ``log_det`` (B,); the first ``velocities`` rows are velocity,
    then height if ``height``, then attitude.  ``innovation`` (v rows, m/s) is that of member 0 at
    the current estimate, not whitened, ``raw_innovation`` and ``raw_columns`` its two parts,
    ``refused_by`` that of a velocity that was refused.
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
