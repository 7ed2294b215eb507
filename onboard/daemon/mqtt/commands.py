"""Commands that come over the broker: carried out, counted, answered."""

from __future__ import annotations

import logging
import math
from collections import Counter
from typing import TYPE_CHECKING

from onboard.daemon.mqtt import limits
from onboard.daemon.mqtt.payloads import ReplyMessage, read_command
from onboard.daemon.view.notices import Notices
from onboard.errors import OnboardError, UsageError

if TYPE_CHECKING:
    from onboard.daemon.view.actions import Actions

logger = logging.getLogger(__name__)


class Commands:
    """Carries out what the broker hands over.

    Args:
        actions: what a command may ask for.
        notices: where to tell what was done.
        counters: where to count.
    """

    def __init__(self, actions: Actions, notices: Notices, counters: Counter[str]) -> None:
        self._actions = actions
        self._notices = notices
        self._counters = counters
        self._warned = False
        self._off_until = -math.inf

    def off_for(self, now: float) -> float | None:
        """Time until commands are listened to again, s; None if nothing is against it."""
        left = self._off_until - now
        return left if left > 0.0 else None

    def stop(self, now: float, where: str) -> None:
        """One had no end: whatever keeps coming with every connection is not asked for."""
        if self._off_until == -math.inf:
            self._notices.post(
                "mqtt_command_too_long",
                f"broker {where}: somebody sends commands without end; no commands for "
                f"{limits.DEAF_S:.0f} s each time",
                warning=True,
            )
        self._off_until = now + limits.DEAF_S
        self._counters["mqtt_commands_refused"] += 1

    async def take(self, payload: bytes, *, retained: bool) -> ReplyMessage | None:
        """Carry out one message; what is to be answered, None if it is ignored."""
        if retained:
            # Somebody's mistake: it would be carried out anew at every connection.
            self._counters["mqtt_commands_ignored"] += 1
            if not self._warned:
                logger.warning("a retained command is ignored, and all further ones")
            self._warned = True
            return None
        try:
            wanted = read_command(payload)
        except UsageError as error:
            self._counters["mqtt_commands_refused"] += 1
            return ReplyMessage(command=None, error=str(error))
        action = getattr(self._actions, wanted.command)
        try:
            done = await action(wanted.imus)
        except OnboardError as error:
            self._counters["mqtt_commands_refused"] += 1
            return ReplyMessage(command=wanted.command, id=wanted.id, error=str(error))
        self._counters["mqtt_commands"] += 1
        self._notices.post("mqtt_command", f"over MQTT: {wanted.command}: {done}")
        return ReplyMessage(command=wanted.command, id=wanted.id, done=done)
