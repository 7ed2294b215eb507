"""Which connection leads to whom, and which packets count where several hear the same sender."""

from __future__ import annotations

from typing import TypeAlias

from onboard.mavlink import limits
from onboard.mavlink.connection import Connection
from onboard.mavlink.dialect import COMPONENT, Message

Source: TypeAlias = tuple[int, int]
"""System and component."""


class Routes:
    """Learned from what is heard; of the connections to the autopilot one is in use.

    ``standby`` counts the autopilot's packets that came by another connection than the one in
    use, ``echoed`` our own that came back: neither are handed on.

    Args:
        system: our system id, until that of the autopilot is known.
    """

    def __init__(self, system: int) -> None:
        self.autopilot: Source | None = None
        self.echoed = 0
        self.standby = 0
        self._own: Source = (system, COMPONENT)
        self._in_use: Connection | None = None
        self._heard = 0.0
        self._known: dict[Source, Connection] = {}

    def settle(self, autopilot: Source, connection: Connection, now: float) -> None:
        """This is the autopilot, heard by this connection; its system id becomes ours."""
        self.autopilot, self._in_use, self._heard = autopilot, connection, now
        self._own = (autopilot[0], COMPONENT)

    def accepts(self, source: Source, connection: Connection, now: float) -> bool:
        """Take note of a packet; whether it is to be handed on."""
        if source == self.autopilot:
            if connection is not self._in_use:
                if now - self._heard <= limits.FAILOVER_S:
                    self.standby += 1
                    return False
                self._in_use = connection
            self._heard = now
        elif source == self._own:
            self.echoed += 1
            return False
        self._known[source] = connection
        return True

    def to(self, message: Message) -> Connection | None:
        """The connection that is up and leads to a message's target; None: whoever there is."""
        target = (getattr(message, "target_system", 0), getattr(message, "target_component", 0))
        if target == self.autopilot and self._in_use is not None:
            route: Connection | None = self._in_use
        else:
            route = self._known.get(target)
        return route if route is not None and route.is_up else None
