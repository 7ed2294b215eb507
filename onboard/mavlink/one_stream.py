"""One message that is wanted at a rate, and where its negotiation is; for all: ``streams``."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from onboard.mavlink import limits
from onboard.mavlink.dialect import MESSAGE_IDS


class StreamState(Enum):
    """Where one message is in the negotiation, for people to read."""

    WAITING = "waiting"
    ASKED = "asked"
    GRANTED = "granted"
    FLOWING = "flowing"
    SLOW = "slow"
    SILENT = "silent"
    UNSUPPORTED = "unsupported"


@dataclass(frozen=True, slots=True)
class StreamRequest:
    """A message that is wanted at a rate (Hz)."""

    name: str
    rate: float

    @property
    def interval_ms(self) -> int:
        """The interval to ask for, whole ms."""
        return max(1, round(1000.0 / self.rate))


class Stream:
    """The negotiation of one message: which intervals were denied, which one was granted.

    ``ladder`` holds the intervals to choose from, fastest first; all up to ``denied`` are
    known to be too fast, and ``granted`` is the fastest one accepted, which is also the one
    in force, since a denial changes nothing.
    """

    def __init__(self, request: StreamRequest) -> None:
        self.request = request
        self.number = MESSAGE_IDS[request.name]
        wanted = request.interval_ms
        self.ladder = (wanted, *(step for step in limits.LADDER_MS if step > wanted))
        self.unwanted = False
        """Whether nothing is to be had from it: what it carries is not there."""
        self.restart(0.0)

    def restart(self, now: float) -> None:
        """Forget what was agreed: the autopilot has."""
        self.state = StreamState.WAITING
        self.denied = -1
        self.granted: int | None = None
        self.due: float | None = now
        self.measured: float | None = None
        if self.unwanted:
            self.rest()
        self.again = 0
        self.rechecked = False
        self._since = now
        self._count = 0

    @property
    def granted_ms(self) -> int | None:
        """The interval in force, ms."""
        return None if self.granted is None else self.ladder[self.granted]

    @property
    def is_short(self) -> bool:
        """Whether much less of it comes than was granted: the line is full."""
        granted = self.granted_ms
        if granted is None or not self.measured:
            return False
        return self.measured < limits.RATE_FULL * 1e3 / granted

    def choose(self, too_fast: int) -> int | None:
        """The rung of the ladder to ask for next, None when there is nothing left to ask.

        ``too_fast`` is an interval (ms) that the autopilot denied for another message that
        it does know: the limit is its loop rate, the same for all.
        """
        last = len(self.ladder) - 1
        if self.granted is not None:
            between = (self.denied + self.granted) // 2
            return between if between > self.denied else None
        if self.denied < 0:
            fast = [rung for rung, step in enumerate(self.ladder) if step <= too_fast]
            self.denied = min(fast[-1], last - 1) if fast else -1
            return self.denied + 1
        return last if self.denied < last else None

    def count(self) -> None:
        """One message came."""
        self._count += 1

    def measure(self, now: float) -> None:
        """When the window of measurement is over: take the rate and judge it."""
        elapsed = now - self._since
        expected = 1e3 / (self.granted_ms or self.request.interval_ms)
        if elapsed < max(limits.RATE_WINDOW_S, 4.0 / expected):
            return
        self.measured = self._count / elapsed
        self._begin_window(now)
        if self.granted is None or self.state is StreamState.ASKED or self.unwanted:
            return
        if self.measured >= limits.RATE_SHORTFALL * expected:
            self.state, self.again, self.due = StreamState.FLOWING, 0, None
        elif self.due is None:
            self.ask_later(now, StreamState.SLOW if self.measured else StreamState.SILENT)

    def settle(self, now: float, rung: int) -> None:
        """An interval was granted: measure what comes of it."""
        self.granted = rung
        self.due = None
        self.state = StreamState.GRANTED
        self._begin_window(now)

    def begin_again(self, now: float) -> None:
        """It is to be asked for as it was granted."""
        if self.granted is not None:
            self.state, self.due = StreamState.WAITING, now
        self._begin_window(now)

    def rest(self) -> None:
        """It is not asked for any more."""
        self.state = StreamState.UNSUPPORTED
        self.due = self.granted = None

    def want(self, now: float, *, wanted: bool) -> None:
        """Whether what it carries is there; where it was asked for in vain, that is taken back."""
        if wanted is not self.unwanted:
            return
        self.unwanted = not wanted
        if wanted:
            self.restart(now)
        elif self.granted is not None:
            self.due = now
        elif self.state is not StreamState.ASKED:
            self.rest()

    def give_up(self, now: float) -> None:
        """Even the slowest interval was denied: there is no such message, unless we misheard."""
        self.state = StreamState.UNSUPPORTED
        self.due = None if self.rechecked else now + limits.RECHECK_S
        self.rechecked = True
        self.denied = -1

    def ask_later(self, now: float, state: StreamState) -> None:
        """Ask again, the later the oftener it did not help."""
        self.state = state
        self.due = now + limits.AGAIN_S[min(self.again, len(limits.AGAIN_S) - 1)]
        self.again += 1

    def _begin_window(self, now: float) -> None:
        self._since, self._count = now, 0
