"""Links to clients: what is sent on each of them, and when."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.builtin import messages, streams
from sitl.builtin.boot_clock import BootClock
from sitl.builtin.instant import Instant
from sitl.builtin.messages import Message
from sitl.builtin.params import Notice, ParameterStore, Value

SENDING = 4e-4
"""From the start of a main loop to its first message, s."""
BETWEEN = 3e-5
PARAMETERS_PER_SECOND = 200.0
"""Speed of a parameter list, as on a fast telemetry link."""


@dataclass(eq=False, slots=True)
class Link:
    """One client's channel: its own intervals, its own parameter list, its outbox."""

    schedule: streams.Schedule = field(default_factory=streams.Schedule)
    outbox: list[tuple[float, Message]] = field(default_factory=list)
    listing: float | None = None


class Links:
    """All clients of one autopilot.

    Attributes:
        parameters: of the board that is in the vehicle: stream rates, loop rate, lists.
    """

    def __init__(self, clock: BootClock, parameters: ParameterStore) -> None:
        """Nobody is connected yet."""
        self.parameters = parameters
        self._clock = clock
        self._links: list[Link] = []

    def __iter__(self) -> Iterator[Link]:
        return iter(self._links)

    # -- who is there ----------------------------------------------------------------------

    def connect(self, link: Link | None = None) -> Link:
        """A new client; it gets a heartbeat and the stream rates of the parameters."""
        link = link or Link()
        self._links.append(link)
        self._default_intervals(link)
        return link

    def disconnect(self, link: Link) -> None:
        """The client has gone."""
        self._links.remove(link)

    def boot(self) -> None:
        """Power on: every link gets the intervals of the parameters, and no list."""
        for link in self._links:
            self._default_intervals(link)

    # -- intervals -------------------------------------------------------------------------

    def _default_intervals(self, link: Link) -> None:
        link.schedule = streams.Schedule()
        link.listing = None
        link.schedule.set("HEARTBEAT", 1000, self._clock.now * 1e3)
        for names in streams.STREAMS.values():
            for name in names:
                self.set_interval(link, name, self.default_interval(name))

    def default_interval(self, name: str) -> int:
        """Interval that the stream rates in the parameters give a message, ms; 0 is never."""
        if name == "HEARTBEAT":
            return 1000
        for stream, names in streams.STREAMS.items():
            rate = self.parameters[f"MAV1_{stream}"]
            if name in names and rate > 0:
                return round(1000.0 / rate)
        return 0

    def set_rate(self, link: Link, name: str, rate_hz: float) -> bool:
        """Rate of a message on a link; 0 stops it.  False where ArduPilot refuses."""
        return self.set_interval(link, name, int(1000.0 / rate_hz) if rate_hz > 0 else 0)

    def set_interval(self, link: Link, name: str, interval: int) -> bool:
        """Interval of a message on a link, ms; 0 stops it.  False where ArduPilot refuses."""
        if interval and streams.too_fast(interval, self.parameters["SCHED_LOOP_RATE"]):
            return False
        link.schedule.set(name, interval, self._clock.now * 1e3)
        return True

    def request_parameters(self, link: Link) -> None:
        """As PARAM_REQUEST_LIST does."""
        link.listing = 0.0

    # -- sending ---------------------------------------------------------------------------

    @property
    def next_due(self) -> float:
        """Earliest boot time at which something is to be sent, ms; at once while a list goes."""
        due = math.inf  # asked in every loop: no generators
        for link in self._links:
            if link.listing is not None:
                return -math.inf
            due = min(due, link.schedule.next_due)
        return due

    def send_due(self, instant: Callable[[], Instant], period: float) -> None:
        """What is due in this main loop.

        Args:
            instant: what is known now; asked once, and only if something is due.
            period: of the main loop, s.
        """
        now_ms = self._clock.now * 1e3
        known: Instant | None = None
        for link in self._links:
            if link.schedule.next_due <= now_ms:
                known = known or instant()
                for name in link.schedule.due(now_ms):
                    self.send(link, messages.BUILDERS[name](known))
            if link.listing is not None:
                link.listing = self._list(link, link.listing, period)

    def _list(self, link: Link, listed: float, period: float) -> float | None:
        """The next few lines of a parameter list; how far it is then, None at its end."""
        following = listed + PARAMETERS_PER_SECOND * period
        for index in range(math.ceil(listed), math.ceil(following)):
            if index >= len(self.parameters):
                return None
            self.send(link, parameter_message(self.parameters.by_index(index)))
        return following

    def send(self, link: Link, message: Message) -> None:
        """Puts a message into a link's outbox; None is left out."""
        if message is not None:
            last = link.outbox[-1][0] if link.outbox else 0.0
            link.outbox.append((max(self._clock.total + SENDING, last + BETWEEN), message))

    def say(self, item: Value | Notice, link: Link | None = None) -> None:
        """Notices and broadcasts to everyone, answers to one link."""
        if isinstance(item, Notice):
            message = mav.MAVLink_statustext_message(item.severity, item.text.encode(), 0, 0)
        else:
            message = parameter_message(item)
        everyone = link is None or isinstance(item, Notice) or item.broadcast
        for target in self._links if everyone else [link]:
            if target is not None:
                self.send(target, message)


def parameter_message(value: Value) -> Message:
    """PARAM_VALUE."""
    return mav.MAVLink_param_value_message(
        value.name.encode(), value.value, int(value.kind), value.count, value.index
    )
