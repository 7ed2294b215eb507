"""What an epoch gives when its innovations are whitened, or when all of it was refused."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.filter.innovations import WhitenedInnovations
from onboard.core.filter.kernel import Whitening
from onboard.core.maths.arrays import Array


def whitened(
    made: Whitening,
    kinds: str,
    t: float,
    theta: Array,
    refused: Sequence[str],
    off: Array,
    unlikely: Array,
) -> WhitenedInnovations:
    """What the epoch at ``t`` gives.

    Args:
        made: r innovations before and after whitening.
        kinds: one letter for each of them.
        t: s.
        theta: (m,) current estimate.
        refused: names of what the gates refused before.
        off: innovation of a velocity that was refused, m/s, or empty.
        unlikely: (B,) what the refused takes off twice the log-likelihood.
    """
    n, m1 = kinds.count("v"), made.E.shape[1]
    first, regressors = made.E[:n, 0], made.E[:n, 1:]
    return WhitenedInnovations(
        t=t,
        y=made.W[:, :, 0],
        h=made.W[:, :, 1:m1],
        log_var=made.log_var,
        log_det=made.log_var.sum(axis=1) + unlikely,
        velocities=n,
        height="h" in kinds,
        innovation=first - regressors @ theta,
        raw_innovation=first,
        raw_columns=regressors,
        refused=tuple(refused),
        refused_by=off,
    )


def nothing(
    members: int, m: int, t: float, refused: Sequence[str], off: Array, unlikely: Array
) -> WhitenedInnovations:
    """All that the epoch at ``t`` (s) has measured was refused: see :func:`whitened`."""
    return WhitenedInnovations(
        t=t,
        y=np.zeros((members, 0)),
        h=np.zeros((members, 0, m)),
        log_var=np.zeros((members, 0)),
        log_det=unlikely,
        velocities=0,
        height=False,
        innovation=np.zeros(0),
        raw_innovation=np.zeros(0),
        raw_columns=np.zeros((0, m)),
        refused=tuple(refused),
        refused_by=off,
    )
