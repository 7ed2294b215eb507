"""Whether the autopilot is there: found by its first HEARTBEAT, silent, and back again."""

from __future__ import annotations

from onboard.mavlink import limits
from onboard.mavlink.autopilot import (
    Autopilot,
    AutopilotFound,
    AutopilotReturned,
    AutopilotSilent,
    AutopilotState,
)
from onboard.mavlink.decode import is_autopilot
from onboard.mavlink.dialect import Message


class Presence:
    """Settles on one autopilot for good; ``now`` is the link's clock, s.

    Args:
        system: the only system id that counts; None takes the first autopilot heard.
    """

    def __init__(self, system: int | None) -> None:
        self.autopilot: Autopilot | None = None
        self.state = AutopilotState.SEARCHING
        self._system = system
        self._heard = 0.0

    def heartbeat(
        self, source: tuple[int, int], message: Message, now: float
    ) -> AutopilotFound | AutopilotReturned | None:
        """Take the HEARTBEAT of any source; what it changes."""
        if self.autopilot is None:
            if not is_autopilot(message) or self._system not in (None, source[0]):
                return None
            self.autopilot = Autopilot(*source, message.type, message.autopilot)
            self.state = AutopilotState.PRESENT
            self._heard = now
            return AutopilotFound(self.autopilot)
        if source != (self.autopilot.system, self.autopilot.component):
            return None
        self._heard = now
        if self.state is AutopilotState.SILENT:
            self.state = AutopilotState.PRESENT
            return AutopilotReturned()
        return None

    def check(self, now: float) -> AutopilotSilent | None:
        """See whether the autopilot has fallen silent; tell it once."""
        silence = now - self._heard
        if self.state is AutopilotState.PRESENT and silence > limits.HEARTBEAT_TIMEOUT_S:
            self.state = AutopilotState.SILENT
            return AutopilotSilent(silence)
        return None
