"""Who hears what: messages by their name, and what happens to autopilot and connections."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeAlias

from onboard.mavlink.autopilot import LinkEvent
from onboard.mavlink.dialect import Message, message_ids

Handler: TypeAlias = Callable[[float, Message], None]
EventHandler: TypeAlias = Callable[[float, LinkEvent], None]


class Audience:
    """Handlers in the order in which they came; ``wanted`` are the messages that one of them hears.

    Args:
        wanted: messages that are wanted in any case.
    """

    def __init__(self, wanted: Iterable[int]) -> None:
        self.wanted = frozenset(wanted)
        self._handlers: dict[int, tuple[Handler, ...]] = {}
        self._event_handlers: list[EventHandler] = []

    def add(self, handler: Handler, names: Iterable[str]) -> None:
        """Have ``handler(now, message)`` called for each of these messages.

        Raises:
            ValueError: the dialect has no such message.
        """
        for number in message_ids(names):
            self._handlers[number] = (*self._handlers.get(number, ()), handler)
            self.wanted |= {number}

    def add_for_events(self, handler: EventHandler) -> None:
        """Have ``handler(now, event)`` called for each event."""
        self._event_handlers.append(handler)

    def hear(self, now: float, message_id: int, message: Message) -> None:
        """Hand a message to all that want it."""
        for handler in self._handlers.get(message_id, ()):
            handler(now, message)

    def hear_of(self, now: float, event: LinkEvent) -> None:
        """Tell everybody of an event."""
        for handler in self._event_handlers:
            handler(now, event)
