"""Where everything is published: below the prefix that is given, or the vehicle's own.

Whom the link takes for the vehicle may turn out to be somebody else: the vehicle that takes its
place has a place of its own, which is moved to between two connections.
"""

from __future__ import annotations

import asyncio


class Place:
    """The prefix now, and the one to move to.

    Args:
        given: [mqtt] prefix; None for ``onboard/<system id>``.
    """

    def __init__(self, given: str | None) -> None:
        self.prefix = (given or "").rstrip("/")
        """What all topics begin with; empty until the vehicle is known."""
        self.named = asyncio.Event()
        self.moving = asyncio.Event()
        """Set from when another place is due until :meth:`move`."""
        self._given = bool(self.prefix)
        self._due = self.prefix
        if self._given:
            self.named.set()

    def hear(self, system_id: int | None) -> None:
        """The system of the vehicle, None where there is none now."""
        if self._given or system_id is None:
            return
        self._due = f"onboard/{system_id}"
        if not self.named.is_set():
            self.prefix = self._due
            self.named.set()
        if self._due == self.prefix:
            self.moving.clear()
        else:
            self.moving.set()

    def move(self) -> str | None:
        """Go where it is due; the prefix that was left, None if nothing changes."""
        if not self.moving.is_set():
            return None
        left, self.prefix = self.prefix, self._due
        self.moving.clear()
        return left

    def topic(self, name: str) -> str:
        """Below the prefix; what begins with a stroke is a whole topic."""
        if name.startswith("/"):
            return name[1:]
        return f"{self.prefix}/{name}"
