"""Failures of the learner: how many of them are borne, and what is said of each."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from onboard.core.inputs.samples import ParameterValue, Sample, VehicleState
from onboard.daemon.learning import limits
from onboard.daemon.learning.learned import Learned

RESTING = (ParameterValue, VehicleState)
"""What a learner is told that learns nothing of a flight."""


class LearnerError(Exception):
    """Something was raised on the learner's thread that is no answer; its cause says what."""


class Failures:
    """Those since a flight was last judged: whoever judges one has got over what it failed of.

    ``stopped`` says in a sentence why nothing is learned of this flight any more; empty: it is.
    """

    def __init__(self) -> None:
        self.stopped = ""
        self.heard: Callable[[], object] = _nobody
        """Called at each of them."""
        self._count = 0
        self._judged = ""
        self._disarmed = False

    def take(self, failure: LearnerError) -> tuple[str, str]:
        """One more; kind and sentence of what is to be said."""
        self._count += 1
        self.heard()
        cause = failure.__cause__
        why = f"{type(cause).__name__}: {cause}"
        if self._count < limits.FAILURES_MAX:
            text = "the estimator has failed and begins anew, without what this flight has shown"
            return "learner_failed", f"{text} ({why})"
        self._disarmed = False
        self.stopped = (
            f"the estimator has failed {self._count} times: nothing is learned before the next "
            "flight"
        )
        return "learner_stopped", f"{self.stopped} ({why})"

    def judged(self, learned: Learned) -> None:
        """Take what was learned: a flight that was judged in full pardons those before it."""
        flight = learned.flight
        if flight is None or not flight.current or flight.support.flight == self._judged:
            return
        self._judged, self._count = flight.support.flight, 0

    def left_over(self, samples: list[Sample]) -> list[Sample]:
        """What of these a learner is to be told; from the next arming on it is everything."""
        if self.stopped and self._armed_anew(samples):
            self.stopped, self._count = "", 0
        return [s for s in samples if type(s) in RESTING] if self.stopped else samples

    def _armed_anew(self, samples: Iterable[Sample]) -> bool:
        for sample in samples:
            if isinstance(sample, VehicleState) and sample.armed is not None:
                if sample.armed and self._disarmed:
                    return True
                self._disarmed = not sample.armed
        return False


def _nobody() -> None:
    return
