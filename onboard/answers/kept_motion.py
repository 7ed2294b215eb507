"""The motion of a recording as its sources tell it, before anything is made of it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from onboard.answers.stands import fixes_of
from onboard.core.inputs.samples import AttitudeSample, ImuSample, Sample
from onboard.core.maths.arrays import Array
from onboard.core.vehicle.same_motion import Recorded


def motion_of(kept: Sequence[Sample]) -> Recorded:
    """The samples of a recording as rows of its quantities."""
    inertial = [s for s in kept if isinstance(s, ImuSample)]
    fixes = fixes_of(kept)
    return Recorded(
        force=_rows(((s.t, *s.f_b) for s in inertial), 4),
        rates=_rows(((s.t, *s.w_b) for s in inertial if s.w_b), 4),
        attitude=_rows(
            ((s.t, s.roll, s.pitch, s.yaw) for s in kept if isinstance(s, AttitudeSample)), 4
        ),
        position=_rows(((f.t, f.latitude, f.longitude, f.altitude) for f in fixes), 4),
        velocity=_rows(
            ((f.t, f.v_n, f.v_e, math.nan if f.v_d is None else f.v_d) for f in fixes), 4
        ),
    )


def _rows(rows: Iterable[tuple[float, ...]], width: int) -> Array:
    return np.array(list(rows), dtype=np.float64).reshape(-1, width)
