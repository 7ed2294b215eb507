"""What became of the fixes: seconds that were trusted, and those that were refused and why."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import replace

from onboard.core.gps.distrust import Distrust, RefusedFixes
from onboard.core.gps.limits import MOST_REFUSED_SPANS


class FixLedger:
    """Counts fixes; remembers the latest spans of refused ones."""

    def __init__(self) -> None:
        self.trusted_s = 0.0
        self._rejected: Counter[Distrust] = Counter()
        self._spans: deque[RefusedFixes] = deque(maxlen=MOST_REFUSED_SPANS)
        self._in_a_row = False

    @property
    def rejected(self) -> dict[str, int]:
        """Fixes refused, by the name of the gravest reason at the time."""
        return {r.value: self._rejected[r] for r in Distrust if r in self._rejected}

    @property
    def spans(self) -> tuple[RefusedFixes, ...]:
        """When fixes were refused and why, the latest last."""
        return tuple(self._spans)

    def count(self, reason: Distrust) -> None:
        """A fix is refused that is of no time, or of a time that is past."""
        self._rejected[reason] += 1

    def refuse(self, t: float, reason: Distrust) -> None:
        """The fix at ``t`` (s) is refused."""
        self.count(reason)
        last = self._spans[-1] if self._spans else None
        if self._in_a_row and last is not None and last.reason is reason and t >= last.end:
            self._spans[-1] = replace(last, end=t)
        else:
            self._spans.append(RefusedFixes(t, t, reason))
        self._in_a_row = True

    def accept(self, seconds: float) -> None:
        """A fix is believed; ``seconds`` of trusted time lie before it."""
        self._in_a_row = False
        self.trusted_s += seconds
