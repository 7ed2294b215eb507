"""Whether a receiver's fixes can have become later in flight: by its own time it is seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.inputs.limits import CRYSTAL
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array


def most_growth(batches: Sequence[Batch]) -> float | None:
    """By how much a latency can grow, a sigma, s a second; None where nobody knows.

    A fix is stamped by the autopilot when it comes, and by the receiver with the time that it is
    of.  What comes later and later is stamped later and later against the receiver's time, but for
    what two crystals run apart.

    Args:
        batches: of one flight on one boot clock.
    """
    stamped = np.concatenate([b.fixes.t for b in batches] or [np.zeros(0)])
    own = np.concatenate([b.fixes.own for b in batches] or [np.zeros(0)])
    if len(own) < 2 or len(own) != len(stamped) or not np.all(np.isfinite(own)):
        return None
    apart: Array = stamped - own
    flown = float(stamped[-1] - stamped[0])
    if not flown > 0.0:
        return None
    # All that they part by, the jitter of stamps with it: a receiver that began its time anew
    # leaves room for anything.
    return float(np.hypot(CRYSTAL, np.ptp(apart) / flown))
