"""Batches of flight through a pass, and who is told of it."""

from __future__ import annotations

from typing import Protocol

from onboard.core.filter.passes import Pass
from onboard.core.filter.traces import PassResult
from onboard.core.inputs.segments import Batch


class PassObserver(Protocol):
    """Told of every pass whose sums count; an engine that has one keeps the traces of epochs."""

    def begin(self) -> None:
        """A pass begins: what was seen of the one before is void."""

    def take(self, result: PassResult) -> None:
        """A batch has gone through it."""


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
