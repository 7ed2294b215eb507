"""False GPS velocities, as a finding."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.diagnosis.receiver_errors import ReceiverError
from onboard.core.diagnosis.refusals import within
from onboard.core.diagnosis.regimes import spans
from onboard.core.inputs.limits import LONGEST_FIX_GAP_S
from onboard.core.inputs.segments import Batch
from onboard.core.physics.effects.gps_fault import GpsFault
from onboard.core.physics.finding import Finding, Quantity

AXES = ("earth_north", "earth_east", "earth_down")


def fault_effect(
    errors: Sequence[ReceiverError],
    distrusted: Sequence[tuple[float, float]],
    batches: Sequence[Batch],
    t0: float,
) -> Finding | None:
    """What is said of a receiver that is at fault; None if it is not.

    Args:
        errors: that the inertia has found, in order of time.
        distrusted: s since ``t0`` in which the receiver contradicted itself; they stand for a fault
            where the inertia, lost itself, cannot tell, and do not say by what it is off.
        batches: the flight.
        t0: s on the boot clock, from which intervals count.
    """
    intervals = _joined([(e.start - t0, e.end - t0) for e in errors]) or list(distrusted)
    if not intervals:
        return None
    worst = max(errors, key=lambda error: error.size, default=None)
    off = {} if worst is None else {"offset": Quantity(worst.size, worst.sigma, "m/s")}
    axis = AXES[0 if worst is None else int(np.argmax(np.abs(worst.off)))]
    t = np.unique(np.concatenate([c.fixes.t for c in batches])) - t0
    return Finding(
        name=GpsFault.effect,
        unknowns={
            **off,
            "duration": Quantity(float(sum(b - a for a, b in intervals)), 0.5, "s"),
        },
        share_of_mismatch=float(np.mean(within(t, intervals))),
        delta_bic=0.0,
        held_out_before=float("nan"),
        held_out_after=float("nan"),
        parameters={},
        cure=GpsFault.cure,
        where=spans(batches, t0, intervals, axis),
        intervals=tuple(intervals),
    )


def _joined(intervals: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Intervals in order of time; those that follow on each other are one."""
    out: list[tuple[float, float]] = []
    for a, b in intervals:
        if out and a - out[-1][1] <= LONGEST_FIX_GAP_S:
            out[-1] = (out[-1][0], max(out[-1][1], b))
        else:
            out.append((a, b))
    return out
