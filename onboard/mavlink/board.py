"""Which board answers on the link: its own unique id, by AUTOPILOT_VERSION; sans-IO.

INS_ACC_ID names a kind of sensor at a place on a bus: it is the same on every board of one
model.  The unique id of the processor is not.  It is asked for with MAV_CMD_REQUEST_MESSAGE,
and with MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES where the firmware is too old for that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from onboard.mavlink import limits
from onboard.mavlink.dialect import COMPONENT, MESSAGE_IDS, Message, mavlink

COMMANDS = (
    (int(mavlink.MAV_CMD_REQUEST_MESSAGE), float(MESSAGE_IDS["AUTOPILOT_VERSION"])),
    (int(mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES), 1.0),
)
"""The two questions with their first parameter, the newer one first."""
REFUSALS = (
    int(mavlink.MAV_RESULT_DENIED),
    int(mavlink.MAV_RESULT_UNSUPPORTED),
    int(mavlink.MAV_RESULT_FAILED),
)
"""What ArduPilot says to a command, or a message, that it does not have."""
_TRIES_EACH = len(limits.ANSWER_TIMEOUT_S) // len(COMMANDS)
_ANOTHER_S = 0.5 * limits.ANSWER_TIMEOUT_S[0]
"""s between two answers that are not one, repeated: questions are twice as far apart."""
_STAGES = {0: "dev", 64: "alpha", 128: "beta", 192: "rc"}
"""FIRMWARE_VERSION_TYPE; 255, an official release, has no name."""


@dataclass(frozen=True, slots=True)
class BoardIdentity:
    """What one AUTOPILOT_VERSION tells.

    ``uid`` is the board's unique id in hex, empty where the board tells none; ``firmware`` its
    version such as ``4.6.1`` or ``4.7.0-dev``, empty where it tells none.
    """

    uid: str
    firmware: str


class Board:
    """Asks who the board is; has the shape of a :class:`onboard.mavlink.link.Participant`.

    A board can be changed for another one only while it has no power, so whatever was known
    ends with each ``start``: between that and the answer nothing is known.  Where two vehicles have
    one system id on one line, both answer.  So another answer than before counts when it comes
    twice: once it may be late, from before a reboot, and who is back after it is one of two.
    """

    names: ClassVar[tuple[str, ...]] = ("AUTOPILOT_VERSION", "COMMAND_ACK")

    def __init__(self) -> None:
        self.identity: BoardIdentity | None = None
        """What the board that is there has told, None until it has."""
        self._target: tuple[int, int] | None = None
        self._tries = 0
        self._next = 0.0
        self._given_up = False
        self._other, self._other_at = "", -math.inf
        self._again = False
        self._asked_at = -math.inf
        self._two_at = -math.inf

    @property
    def uid(self) -> str:
        """Unique id in hex, empty where it has not been told (see ``answered``)."""
        return "" if self.identity is None else self.identity.uid

    @property
    def firmware(self) -> str:
        """Version of the firmware, empty where it has not been told."""
        return "" if self.identity is None else self.identity.firmware

    @property
    def answered(self) -> bool:
        """Whether there is nothing more to wait for: it told, or all tries were in vain."""
        return self._done and not self.in_doubt

    @property
    def in_doubt(self) -> bool:
        """Whether its last answer was another one than that before."""
        return bool(self._other)

    @property
    def _done(self) -> bool:
        return self.identity is not None or self._given_up

    def start(self, system: int, component: int, now: float) -> None:
        """Begin with this autopilot, or again: it may be another board now."""
        self._target = (system, component)
        self.identity = None
        self._tries = 0
        self._next = now
        self._given_up = self._again = False
        self._other = ""

    def confirm(self, now: float) -> None:
        """Have it asked anew if that was long ago: is there one still, and only one?"""
        if self.uid and now - self._asked_at >= limits.BOARD_ASKED_S:
            self._again = True

    def are_two(self, now: float) -> bool:
        """Whether two boards have answered in turn of late."""
        return now - self._two_at < limits.TWO_BOARDS_S

    def poll(self, now: float) -> Sequence[Message]:
        """The question that is due, if one is."""
        asked = now - self._asked_at
        if self._target is not None and self._done and self._again:
            late = asked >= limits.ANSWER_TIMEOUT_S[0]
            return (self._question(self._target, self._stage(), now),) if late else ()
        if self._target is None or self._done or now < self._next:
            return ()
        if self._tries == len(limits.ANSWER_TIMEOUT_S):
            self._given_up = True
            return ()
        stage, confirmation = divmod(self._tries, _TRIES_EACH)
        self._next = now + limits.ANSWER_TIMEOUT_S[self._tries]
        self._tries += 1
        return (self._question(self._target, stage, now, confirmation),)

    def _stage(self) -> int:
        """In which words it was asked last: those that it has answered."""
        return max(0, self._tries - 1) // _TRIES_EACH

    def _question(
        self, target: tuple[int, int], stage: int, now: float, confirmation: int = 0
    ) -> Message:
        self._again, self._asked_at = False, now
        number, parameter = COMMANDS[stage]
        return mavlink.MAVLink_command_long_message(
            *target, number, confirmation, parameter, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        )

    def feed(self, message: Message, now: float) -> Sequence[Message]:
        """Take the answer (also one that somebody else asked for, or a late one), or a refusal."""
        if (message.get_srcSystem(), message.get_srcComponent()) != self._target:
            return ()
        if message.get_msgId() == MESSAGE_IDS["AUTOPILOT_VERSION"]:
            self._told(identity(message), now)
        elif self._refuses(message):
            # No use in asking in the same words again.
            self._tries = (self._stage() + 1) * _TRIES_EACH
            self._next = now
        return ()

    def _told(self, answer: BoardIdentity, now: float) -> None:
        known = self.uid
        if answer.uid and known and answer.uid not in {known, self._other}:
            self._other, self._other_at = answer.uid, now
            self._again |= not self.are_two(now)  # which of them is there now?
            return
        if self.in_doubt and answer.uid == self._other and now - self._other_at < _ANOTHER_S:
            return  # the same one, by a line that repeats
        if self.in_doubt and answer.uid == known:
            self._two_at = now
        self.identity, self._other = answer, ""

    def _refuses(self, ack: Message) -> bool:
        """Whether this is a no to the question that was asked last."""
        if self._target is None or self._done or not self._tries:
            return False
        asked, _ = COMMANDS[self._stage()]
        return (
            ack.command == asked
            and ack.result in REFUSALS
            and ack.target_system in (0, self._target[0])
            and ack.target_component in (0, COMPONENT)
        )


def identity(message: Message) -> BoardIdentity:
    """What an AUTOPILOT_VERSION tells.

    ``uid2`` goes before ``uid``; a field of zeros is one that was not filled in.
    """
    uid2 = bytes(message.uid2)
    uid = uid2.hex() if any(uid2) else f"{message.uid:016x}" if message.uid else ""
    return BoardIdentity(uid, version_text(message.flight_sw_version))


def version_text(number: int) -> str:
    """``flight_sw_version`` for people: major, minor, patch and the stage of the release."""
    if not number:
        return ""
    major, minor, patch, stage = (number >> shift & 0xFF for shift in (24, 16, 8, 0))
    name = _STAGES.get(stage, "")
    return f"{major}.{minor}.{patch}" + (f"-{name}" if name else "")
