"""Every number of this room that decides something: its unit, and where it comes from.

Provenance in brackets: *service* (systemd/onboard.service), *cost* (memory), *use*
(what people have of it), *physics*, or *tuned*.
"""

from __future__ import annotations

from typing import Final

# The connection

KEEPALIVE_S: Final = 30
"""s; the broker takes us for gone after one and a half times as long [tuned]."""
ANSWER_S: Final = 10.0
"""s; a broker that confirms nothing for so long has hung [tuned]."""
BACKOFF_BASE_S: Final = 1.0
"""s; ceiling of the first wait before the next try [tuned]."""
BACKOFF_CAP_S: Final = 60.0
"""s; ceiling of every wait: nothing hangs on a broker, and many vehicles may share it [tuned]."""
STABLE_S: Final = 10.0
"""s; a connection that held this long starts the back-off from the beginning [tuned]."""
HANG_UPS: Final = 3
"""Connections in a row that end alike before that is taken for the broker's way: two are chance,
and each costs a pause [use]."""
LASTING_S: Final = 120.0
"""s; twice the longest pause: two clients of one id, each of which is hung up on when the other is
back, have no connection that lasts as long [physics]."""
FAREWELL_S: Final = 1.0
"""s for what waits and for the last word at shutdown [service: a stop takes two seconds]."""
HANG_UP_S: Final = 0.2
"""s; a broker that has not taken the rest by then gets as long for each further step [tuned]."""

# What waits

EVENTS_MAX: Final = 200
"""Events that wait for the broker; beyond that the oldest are dropped and counted [cost]."""
COMMANDS_WAITING: Final = 16
"""Commands that wait to be carried out [cost: people do not send more at a time]."""
COMMAND_MAX: Final = 1024
"""bytes; a longer command is none of ours [cost]."""
PACKET_MAX: Final = 16_384
"""bytes; a longer packet ends the connection: commands and acknowledgements are short [cost]."""
DEAF_S: Final = 300.0
"""s without commands after that: a retained one would come again at once, and nothing else be
published [tuned]."""
