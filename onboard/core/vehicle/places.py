"""Where in a flight an effect acts: blocks, axes, kinds of flight."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array, Mask
from onboard.core.physics.finding import Where
from onboard.core.vehicle.flight import Flight

MOST = 4
LEAST_SHARE = 0.05
AXES = ("x", "y", "z", "airspeed")
"""Names of the columns of a prediction."""
FORCE = (0, 1, 2)
"""Those of them that are forces; a further one is airspeed."""
CLIMB_M_S, FAST_M_S, TURN_RAD_S = 1.0, 5.0, 0.3


def regime_of(flight: Flight, mine: Mask) -> str:
    """A word for what the vehicle mostly did in these steps."""
    v = flight.v_n[mine]
    speed = float(np.median(np.hypot(v[:, 0], v[:, 1])))
    climb = float(np.median(-v[:, 2]))
    if climb > CLIMB_M_S:
        return "climbing"
    if climb < -CLIMB_M_S:
        return "descending"
    if float(np.median(np.abs(flight.w_b[mine, 2]))) > TURN_RAD_S:
        return "turning"
    return "fast" if speed > FAST_M_S else "slow"


def places_of(
    flight: Flight, made: Array, axes: tuple[int, ...], block: NDArray[np.int64]
) -> tuple[Where, ...]:
    """Blocks in which an effect moves the force most, neighbours joined.

    Args:
        flight: n steps; of several recordings, the first is told of.
        made: (n, k) what the effect adds to the force, m/s^2.
        axes: body axes of the columns.
        block: (n,) number of the block of each step.
    """
    squares = np.where(flight.part[:, None] == 0, made**2, 0.0)
    whole = float(squares.sum())
    if whole <= 0.0:
        return ()
    axis = AXES[axes[int(np.argmax(squares.sum(axis=0)))]]
    by_block = {b: float(squares[block == b].sum()) / whole for b in np.unique(block).tolist()}
    keep = sorted(sorted(by_block, key=lambda b: -by_block[b])[:MOST])
    groups: list[list[float]] = []
    for b in keep:
        if by_block[b] < LEAST_SHARE:
            continue
        if groups and b == groups[-1][-1] + 1:
            groups[-1].append(b)
        else:
            groups.append([b])
    out = []
    for group in groups:
        mine = np.isin(block, group)
        t = flight.t[mine] - flight.t[0]
        share = sum(by_block[b] for b in group)
        out.append(
            Where(
                float(t[0]),
                float(t[-1]),
                axis if axis == AXES[-1] else f"body_{axis}",
                regime_of(flight, mine),
                round(share, 4),
            )
        )
    return tuple(out)
