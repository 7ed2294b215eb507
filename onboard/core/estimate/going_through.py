"""Batches of flight through a pass."""

from __future__ import annotations

from onboard.core.filter.passes import Pass
from onboard.core.filter.traces import PassResult
from onboard.core.inputs.segments import Batch


def through(made: Pass, batch: Batch, coast_s: float) -> PassResult:
    """One batch through a pass.

    Args:
        made: the pass; its filter begins anew where it has gone without fixes for too long.
        batch: flight.
        coast_s: longest dead reckoning, s.
    """
    if batch.fresh or batch.fixes.t[0] - made.dead_reckoning_since > coast_s:
        made.restart()
    return made.process(batch.segment, batch.fixes, batch.trusted)
