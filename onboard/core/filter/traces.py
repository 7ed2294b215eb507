"""What each epoch of a pass leaves behind, besides its share of the sums."""

from __future__ import annotations

from dataclasses import dataclass

from onboard.core.maths.arrays import Array


@dataclass(frozen=True, slots=True)
class EpochState:
    """Filter's state after an epoch: where dead reckoning may start.  ``innovation`` as below."""

    t: float
    innovation: Array
    R_nb: Array
    v_n: Array
    bias_b: Array


@dataclass(frozen=True, slots=True)
class EpochTrace:
    """What one epoch left, for plots, gates and localisation.

    The velocity residual, NED, m/s, at ``theta`` is ``innovation - columns @ theta``; ``y`` and
    ``h`` are the whitened rows.
    """

    t: float
    innovation: Array
    columns: Array
    y: Array
    h: Array
    velocities: int
    height: bool
    refused: tuple[str, ...]
    refused_by: Array
