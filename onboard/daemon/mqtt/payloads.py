"""The documents that go to the broker, and the one that may come from it.

===================  ========  ==========================================================
topic under prefix   retained  document
===================  ========  ==========================================================
``state``            yes       the snapshot (:class:`onboard.daemon.view.snapshot.Snapshot`)
``summary``          yes       :class:`onboard.daemon.mqtt.summary.SummaryMessage`
``calibration``      yes       :class:`CalibrationMessage`
``diagnosis``        yes       what ``onboard explain --json`` writes
``event``            no        :class:`EventMessage`, one per journal entry
``availability``     yes       ``online`` or ``offline``, plain text; the last will
``command``          no        :class:`CommandMessage`, if commands are enabled
``command/reply``    no        :class:`ReplyMessage`
===================  ========  ==========================================================

``schema.json`` beside this file is the JSON Schema of all of them.
"""

from __future__ import annotations

import re
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from onboard.daemon.mqtt import limits
from onboard.daemon.view.snapshot import ImuView, JournalLine, Record, Snapshot
from onboard.errors import UsageError

CALIBRATION_SCHEMA = "onboard.calibration/1"
EVENT_SCHEMA = "onboard.event/1"
REPLY_SCHEMA = "onboard.reply/1"

ImuNumber = Annotated[int, Meta(ge=1, le=5)]
CommandName = Literal["approve", "reject", "rollback", "reset"]


class CalibrationMessage(Record, frozen=True, kw_only=True):
    """The accelerometers, as in the state; published when they change."""

    system_id: int | None
    imus: tuple[ImuView, ...]
    schema: str = CALIBRATION_SCHEMA


class EventMessage(Record, frozen=True, kw_only=True):
    """One journal entry; ``at`` is Unix time, ``transaction`` what belongs together."""

    at: float
    kind: str
    transaction: str
    imu: int | None
    text: str
    schema: str = EVENT_SCHEMA


class CommandMessage(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True
):
    """What a person asks for; no numbers: every accelerometer that it can be about.

    ``id`` comes back in the reply.  The bare word (``approve``) will do for the whole document.
    """

    command: CommandName
    imus: tuple[ImuNumber, ...] = ()
    id: Annotated[str, Meta(max_length=64)] | None = None


class ReplyMessage(Record, frozen=True, kw_only=True):
    """What became of a command: ``done`` or ``error`` has one sentence."""

    command: str | None
    id: str | None = None
    done: str | None = None
    error: str | None = None
    schema: str = REPLY_SCHEMA


def calibration_message(snapshot: Snapshot) -> bytes:
    """The retained document of topic ``calibration``."""
    return _ENCODER.encode(
        CalibrationMessage(system_id=snapshot.link.system_id, imus=snapshot.imus)
    )


def event_message(line: JournalLine) -> bytes:
    """The document of one journal entry."""
    return _ENCODER.encode(
        EventMessage(
            at=line.at,
            kind=line.kind,
            transaction=line.transaction,
            imu=line.imu,
            text=line.text,
        )
    )


def document(value: object) -> bytes:
    """Any record or mapping as UTF-8 JSON."""
    return _ENCODER.encode(value)


def read_command(payload: bytes) -> CommandMessage:
    """A command as it came.

    Raises:
        UsageError: not a command; says what is wrong.
    """
    if len(payload) > limits.COMMAND_MAX:
        raise UsageError(f"a command has at most {limits.COMMAND_MAX} bytes")
    text = payload.strip()
    if re.fullmatch(rb"[a-z]+", text):
        text = b'{"command":"' + text + b'"}'
    try:
        return _COMMAND.decode(text)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise UsageError(str(error)) from None


_ENCODER = msgspec.json.Encoder()
_COMMAND = msgspec.json.Decoder(CommandMessage)
