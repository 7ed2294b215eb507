"""Which way leads to whom: learned from what is heard."""

from __future__ import annotations

from onboard.mavlink import limits
from onboard.mavlink.claims import Source, Way
from onboard.mavlink.dialect import Message


class Routes:
    """The ways to everybody but the vehicle, whose way is pinned (:mod:`.presence`)."""

    def __init__(self) -> None:
        self._known: dict[Source, Way] = {}

    def note(self, source: Source, way: Way) -> None:
        """Somebody was heard on this way."""
        if source in self._known or len(self._known) < limits.SOURCES_KNOWN:
            self._known[source] = way

    def to(self, message: Message, vehicle: Source | None, way: Way | None) -> Way | None:
        """The way that leads to a message's target; None: whoever there is."""
        target = (getattr(message, "target_system", 0), getattr(message, "target_component", 0))
        return way if target == vehicle else self._known.get(target)
