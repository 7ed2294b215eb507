"""Messages of the autopilot, counted by name, with their rates over the last seconds."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from onboard.daemon.view.snapshot import MessageRate
from onboard.mavlink.streams import StreamStatus

WINDOW_TICKS = 5


class Traffic:
    """``count`` with each message, ``tick`` now and then; ``now`` is a monotonic clock, s."""

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}
        self._history: deque[tuple[float, dict[str, int]]] = deque(maxlen=WINDOW_TICKS + 1)

    def count(self, name: str) -> None:
        """One more message of this name."""
        self._counts[name] = self._counts.get(name, 0) + 1

    def tick(self, now: float) -> None:
        """Remember the counts, to measure rates against."""
        self._history.append((now, dict(self._counts)))

    def view(self, streams: Iterable[StreamStatus]) -> dict[str, MessageRate]:
        """All messages that came or were asked for."""
        asked = {status.name: status for status in streams}
        rates = {}
        for name in sorted(self._counts.keys() | asked.keys()):
            status = asked.get(name)
            rates[name] = MessageRate(
                count=self._counts.get(name, 0),
                rate_hz=self.rate(name),
                wanted_hz=None if status is None else status.asked,
                granted_hz=None if status is None else status.granted,
                stream=None if status is None else status.state.value,
            )
        return rates

    def rate(self, name: str) -> float:
        """How often a second it came of late, Hz."""
        if len(self._history) < 2:
            return 0.0
        (start, before), (end, after) = self._history[0], self._history[-1]
        if end <= start:
            return 0.0
        return round((after.get(name, 0) - before.get(name, 0)) / (end - start), 1)
