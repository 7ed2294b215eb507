"""Trouble with somebody outside, told when it begins, when its reason changes, when it is over.

Who tries again for hours, as a service has to, must not write a line for each try: what matters
would drown, and logs on small disks push each other out.
"""

from __future__ import annotations

from dataclasses import dataclass

SETTLE_S = 10.0
"""What comes and goes faster than this has not come back."""


@dataclass(frozen=True, slots=True)
class Over:
    """The end of an outage: how long it was (s), and how many tries were in vain."""

    seconds: float
    tries: int

    def __str__(self) -> str:
        """``31 s and 6 tries``."""
        long = self.seconds >= 120.0
        lasted = f"{self.seconds / 60.0:.0f} min" if long else f"{self.seconds:.0f} s"
        tries = f" and {self.tries} {'try' if self.tries == 1 else 'tries'}" if self.tries else ""
        return f"{lasted}{tries}"


class Outage:
    """What is known of one party's trouble; ``now`` is any monotonic time, s.

    ``since`` is when it began (None: there is none), ``tries`` how many were in vain in it,
    ``times`` how often what worked was lost in it.
    """

    def __init__(self, settle_s: float = SETTLE_S) -> None:
        """Take how long something has to work for its trouble to be over."""
        self.since: float | None = None
        self.tries = 0
        self.times = 0
        self._settle_s = settle_s
        self._works: float | None = None
        self._told: set[str] = set()
        self._expected = False

    def lost(self, reason: str, now: float) -> bool:
        """What worked has stopped.  True if that is to be told."""
        self.times += 1
        begins = self.since is None
        told = self._begin(reason, now)
        # Whatever the next try meets is the same trouble, seen from outside.
        self._expected = begins
        return told

    def failed(self, reason: str, now: float, *, refused: bool = False) -> bool:
        """A try was in vain.  True if that is to be told.

        Args:
            reason: in a few words.
            now: time, s.
            refused: the other side answered, and does not want us: that is never the same trouble.
        """
        self.tries += 1
        if self._expected:
            if not refused:
                self._told.add(reason)
            self._expected = False
        return self._begin(reason, now)

    def works(self, now: float) -> None:
        """It works, for now."""
        if self.since is not None and self._works is None:
            self._works = now

    def over(self, now: float) -> Over | None:
        """The end of it, once: when it has worked for long enough."""
        if self.since is None or self._works is None or now - self._works < self._settle_s:
            return None
        over = Over(self._works - self.since, self.tries)
        self.since, self._works, self.tries, self.times = None, None, 0, 0
        self._told.clear()
        return over

    def _begin(self, reason: str, now: float) -> bool:
        if self.since is None:
            self.since = now
        self._works = None
        news = reason not in self._told
        self._told.add(reason)
        return news
