"""Failures of the learner: how many of them are borne, and what is said of each."""

from __future__ import annotations

from collections.abc import Callable

from onboard.daemon.learning import limits
from onboard.daemon.learning.learned import Learned


class LearnerError(Exception):
    """Something was raised on the learner's thread that is no answer; its cause says what."""


class Failures:
    """Those since a flight was last judged: whoever judges one has got over what it failed of.

    ``stopped`` says in a sentence why no flight is learned any more; empty: flights are learned.
    """

    def __init__(self) -> None:
        self.stopped = ""
        self.heard: Callable[[], object] = _nobody
        """Called at each of them."""
        self._count = 0
        self._judged = ""

    def judged(self, learned: Learned) -> None:
        """Take what was learned: a flight that was judged in full pardons those before it."""
        flight = learned.flight
        if flight is None or not flight.current or flight.support.flight == self._judged:
            return
        self._judged, self._count = flight.support.flight, 0

    def take(self, failure: LearnerError) -> tuple[str, str]:
        """One more; kind and sentence of what is to be said."""
        self._count += 1
        self.heard()
        cause = failure.__cause__
        why = f"{type(cause).__name__}: {cause}"
        if self._count < limits.FAILURES_MAX:
            text = "the estimator has failed and begins anew, without what this flight has shown"
            return "learner_failed", f"{text} ({why})"
        self.stopped = (
            f"the estimator has failed {self._count} times: no flight is learned until the "
            "service is restarted"
        )
        return "learner_stopped", f"{self.stopped} ({why})"


def _nobody() -> None:
    return
