"""Batches of flight through a pass, and what is seen of it."""

from __future__ import annotations

from onboard.core.filter.passes import Pass
from onboard.core.filter.traces import PassResult
from onboard.core.inputs.segments import Batch


class Watched:
    """What sees its own passes whose sums count, if it has something to do with their epochs.

    Attributes:
        traced: whether these passes keep their epochs.
    """

    traced = False

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
