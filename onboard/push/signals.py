"""What a push transaction is told, what it wants done, and how it ends: frozen records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Self, TypeAlias

from onboard.mavlink.parameter_messages import ParameterEvent, SendAction
from onboard.push.entries import Entry, Purpose, Result
from onboard.push.plan import PushPlan
from onboard.push.policy import VehicleCondition, ekf_healthy


class Reason(Enum):
    """Why a transaction did not simply complete."""

    NONE = "none"
    CHANGED_BY_OTHER = "changed_by_other"
    ARMED = "armed"
    EKF_UNHEALTHY = "ekf_unhealthy"
    DENIED = "denied"
    NOT_SAVED = "not_saved"
    SILENT = "silent"
    LINK_LOST = "link_lost"
    REBOOTED = "rebooted"
    REVERTED = "reverted"
    JOURNAL_FAILED = "journal_failed"
    CANCELLED = "cancelled"
    OTHER_VEHICLE = "other_vehicle"
    TOO_LONG = "too_long"
    RESTARTED = "restarted"
    NO_WAY_BACK = "no_way_back"


@dataclass(frozen=True, slots=True)
class JournalWritten:
    """The oldest unconfirmed ``Record`` is on the disk."""


@dataclass(frozen=True, slots=True)
class JournalFailed:
    """The oldest unconfirmed ``Record`` could not be written."""

    sentence: str


@dataclass(frozen=True, slots=True)
class VehicleReport:
    """Armed, EKF health (:func:`onboard.push.policy.ekf_healthy`), landed; None if unknown."""

    armed: bool | None = None
    ekf_healthy: bool | None = None
    landed: bool | None = None

    @classmethod
    def of(cls, condition: VehicleCondition) -> Self:
        """What a transaction and the watch after it need of a vehicle's condition."""
        flags = condition.ekf_flags
        healthy = None if flags is None else ekf_healthy(flags)
        return cls(condition.armed, healthy, condition.landed)


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """A HEARTBEAT has come this moment; armed counts from whomever it comes.

    ``late``: so much longer than usual it was on its way, s.
    """

    armed: bool
    late: float = 0.0


@dataclass(frozen=True, slots=True)
class Rebooted:
    """The autopilot's boot time went back."""


@dataclass(frozen=True, slots=True)
class LinkLost:
    """No heartbeat: what is sent now will not arrive."""


@dataclass(frozen=True, slots=True)
class Cancelled:
    """It is wanted undone: nobody may write here now, or somebody else does."""

    sentence: str


TransactionEvent: TypeAlias = (
    ParameterEvent
    | JournalWritten
    | JournalFailed
    | VehicleReport
    | Heartbeat
    | Rebooted
    | LinkLost
    | Cancelled
)


@dataclass(frozen=True, slots=True)
class Record:
    """Append ``entry`` to the journal, durably, before the next output."""

    entry: Entry


@dataclass(frozen=True, slots=True)
class Outcome:
    """How it ended; ``values`` are the six as last read back, ``left`` those of somebody else.

    ``open``: the journal still holds the transaction as open, it has to be resumed.
    """

    transaction: str
    plan: PushPlan
    purpose: Purpose
    result: Result
    reason: Reason
    sentence: str
    values: Mapping[str, float] = field(default_factory=dict)
    left: tuple[str, ...] = ()
    open: bool = False


@dataclass(frozen=True, slots=True)
class Finished:
    """The last output of a transaction."""

    outcome: Outcome


TransactionOutput: TypeAlias = SendAction | Record | Finished
