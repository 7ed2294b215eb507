"""Another service under our own ids: noticed by its HEARTBEATs; the one that came later yields.

``custom_mode`` means nothing in the HEARTBEAT of an onboard controller.  Ours has how long the
service has run (20 bits, s) and a number drawn at its start (12 bits), so that two services that
hear each other agree on which of them was there first, and each knows its own from what a router
gives back.

An autopilot between two such services, each on a line of its own, passes on everything that is
addressed to all but for HEARTBEATs, which never go where one of that name has come from.  So the
same is said by a TUNNEL, too, the message for what is nobody else's business.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable

from onboard.mavlink import limits
from onboard.mavlink.autopilot import TwinHeard
from onboard.mavlink.dialect import Message, mavlink

NUMBER_BITS = 12
LONGEST_S = (1 << (32 - NUMBER_BITS)) - 1
PAYLOAD_TYPE = 47_191
"""Of our TUNNEL; above 32767 nothing is registered [data sheet: MAV_TUNNEL_PAYLOAD_TYPE]."""
PAYLOAD_LONGEST = 128
"""Bytes that a TUNNEL has room for [data sheet: common.xml]."""
TOGETHER_S = 3
"""Started within so many seconds of each other: then the larger number goes first."""


class Twins:
    """Tells our own HEARTBEATs from those of another service.

    Args:
        clock: monotonic time, s.
        number: drawn at the start; None draws one.
    """

    def __init__(self, clock: Callable[[], float], number: int | None = None) -> None:
        self._began = clock()
        drawn = secrets.randbelow((1 << NUMBER_BITS) - 1) + 1
        self._number = drawn if number is None else number
        self._heard_at: float | None = None
        self._earlier_at: float | None = None

    def signature(self, now: float) -> int:
        """What our HEARTBEAT carries."""
        return min(int(now - self._began), LONGEST_S) << NUMBER_BITS | self._number

    def hear(self, signature: int, now: float) -> TwinHeard | None:
        """Take a HEARTBEAT under our own ids; None if it is ours, or of no service like this."""
        number = signature & ((1 << NUMBER_BITS) - 1)
        if number in (0, self._number):
            return None
        ours, theirs = self.signature(now) >> NUMBER_BITS, signature >> NUMBER_BITS
        earlier = theirs > ours
        if abs(theirs - ours) <= TOGETHER_S:
            earlier = number > self._number
        self._heard_at = now
        if earlier:
            self._earlier_at = now
        return TwinHeard(earlier)

    def there(self, now: float) -> bool:
        """Whether another service was heard of late."""
        return self._heard_at is not None and now - self._heard_at <= limits.TWIN_S

    def first(self, now: float) -> bool:
        """Whether we were there before all others that were heard of late."""
        return self._earlier_at is None or now - self._earlier_at > limits.TWIN_S


def our_heartbeat(signature: int) -> Message:
    """That of an onboard controller, with the signature by which others of our name are told."""
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_ONBOARD_CONTROLLER,
        mavlink.MAV_AUTOPILOT_INVALID,
        0,
        signature,
        mavlink.MAV_STATE_ACTIVE,
        3,
    )


def our_tunnel(signature: int) -> Message:
    """The same signature to everybody, in what an autopilot passes on."""
    told = signature.to_bytes(4, "little")
    payload = [*told, *bytes(PAYLOAD_LONGEST - len(told))]
    return mavlink.MAVLink_tunnel_message(0, 0, PAYLOAD_TYPE, len(told), payload)


def signature_of(message: Message) -> int | None:
    """The signature that a message under our own ids carries; None if it has none."""
    number = message.get_msgId()
    if number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
        return int(message.custom_mode)
    if number == mavlink.MAVLINK_MSG_ID_TUNNEL and message.payload_type == PAYLOAD_TYPE:
        return int.from_bytes(bytes(message.payload[:4]), "little")
    return None
