"""What the journal remembers of a push: one frozen record per fact, in the order of the facts.

A transaction is the records with its identifier.  It is *open* from ``Planned`` until
``Closed``; an open one is what a restart has to take care of (:class:`Recovery`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Self, TypeAlias

from msgspec import Struct

from onboard.push.plan import PushPlan

INTERRUPTED = "the transaction had been interrupted"
NOT_STORED = "the autopilot had not stored it"


class Result(Enum):
    """How a transaction ended.

    ``COMPLETED``, ``ROLLED_BACK`` and ``ABORTED`` (nothing was written) are final.
    ``INTERRUPTED`` and ``OTHER_VEHICLE`` leave it open: it is to be resumed when the
    autopilot, or the right one, is there again.
    """

    COMPLETED = "completed"
    ROLLED_BACK = "rolled_back"
    ABORTED = "aborted"
    INTERRUPTED = "interrupted"
    OTHER_VEHICLE = "other_vehicle"


class Purpose(Enum):
    """Why a plan is written: a new calibration, or the way back from one."""

    PUSH = "push"
    ROLL_BACK = "roll_back"


class Verdict(Enum):
    """What the flight after a push said; after ``DOUBTED`` the next one is asked, too."""

    KEPT = "kept"
    DOUBTED = "doubted"
    WORSE = "worse"
    SUPERSEDED = "superseded"


class Support(Struct, frozen=True):
    """What a push rests on: the flight, and whether a person approved.

    ``flight`` is its unique id, ``landed_at`` Unix time (of a push in flight: of its diagnosis),
    ``board`` the autopilot's unique id in hex, empty if it tells none, ``trusted_s`` the flight
    with trusted GPS.
    """

    flight: str
    landed_at: float
    board: str
    trusted_s: float
    approved: bool = False


class Planned(Struct, frozen=True, tag="planned"):
    """A transaction begins; holds everything needed to undo it.  Durable before any write.

    ``support`` is None for the way back.
    """

    transaction: str
    plan: PushPlan
    purpose: Purpose = Purpose.PUSH
    support: Support | None = None


class Writing(Struct, frozen=True, tag="writing"):
    """A PARAM_SET is about to be sent (``undo``: on the way back)."""

    transaction: str
    name: str
    before: float
    value: float
    undo: bool = False


class ReadBack(Struct, frozen=True, tag="read_back"):
    """The autopilot confirmed a write; ``saved``: and announced that it is stored."""

    transaction: str
    name: str
    value: float
    saved: bool


class Undoing(Struct, frozen=True, tag="undoing"):
    """From here on the transaction is rolled back, also after a crash."""

    transaction: str
    reason: str
    sentence: str


class Closed(Struct, frozen=True, tag="closed"):
    """The transaction is over; ``values`` are the six as last read back."""

    transaction: str
    result: Result
    reason: str
    sentence: str
    values: dict[str, float]


class Watched(Struct, frozen=True, tag="watched"):
    """The verdict of the flight after a completed push.

    ``held_out`` (whitened) and ``velocity_rms`` (m/s) are that flight's residuals with the values
    that were pushed; None where it was not they that decided.
    """

    transaction: str
    verdict: Verdict
    sentence: str
    held_out: float | None = None
    velocity_rms: float | None = None


class Found(Struct, frozen=True, tag="found"):
    """A flight was diagnosed; ``missing``: why nothing may be written by itself, or empty.

    ``transaction`` names the diagnosis; it belongs to no push.
    """

    transaction: str
    imu: int
    verdict: str
    effects: tuple[str, ...]
    missing: str


class Refused(Struct, frozen=True, tag="refused"):
    """An accelerometer is held back until a person approves; ``sentence`` empty: no longer.

    ``transaction`` names the refusal; it belongs to no push.
    """

    transaction: str
    imu: int
    sentence: str


class Replaced(Struct, frozen=True, tag="replaced"):
    """The values that a completed transaction had left are others now, and not by our doing.

    From then on nobody looks whether they last: they are somebody else's.
    """

    transaction: str
    sentence: str


Entry: TypeAlias = (
    Planned | Writing | ReadBack | Undoing | Closed | Watched | Found | Refused | Replaced
)


@dataclass(frozen=True, slots=True)
class Recovery:
    """An open transaction as the journal knows it.

    ``undo``: a roll-back had begun and is to be carried on.  ``confirmed``: names that were
    read back with their wanted value and announced as stored.  ``sentence``: why it is taken up.
    """

    transaction: str
    plan: PushPlan
    purpose: Purpose
    undo: bool
    confirmed: frozenset[str]
    sentence: str = INTERRUPTED

    @classmethod
    def undoing(cls, completed: Planned, sentence: str) -> Self:
        """What was completed is to be taken back, as if it had been interrupted."""
        return cls(
            completed.transaction,
            completed.plan,
            completed.purpose,
            undo=True,
            confirmed=frozenset(),
            sentence=sentence,
        )

    @property
    def all_confirmed(self) -> bool:
        """Whether every write is known to have been stored: then it may be finished."""
        return all(c.name in self.confirmed for c in self.plan.changes if c.differs)


class Remains(Enum):
    """What is left of the six values that a transaction has written.

    ``WHOLE``: all.  ``MIXED``: some, the others are those of before.  ``GONE``: all are those of
    before.  ``OTHERS``: somebody has set values that are neither.
    """

    WHOLE = "whole"
    MIXED = "mixed"
    GONE = "gone"
    OTHERS = "others"


def remains(plan: PushPlan, values: Mapping[str, float]) -> Remains | None:
    """What is left of a plan that was written; None where not all six values are known.

    Args:
        plan: what was written.
        values: the autopilot's parameters by name.
    """
    if not all(name in values for name in plan.names):
        return None
    if any(values[c.name] not in {c.before, c.wanted} for c in plan.changes):
        return Remains.OTHERS
    there = {values[c.name] == c.wanted for c in plan.changes if c.differs}
    if False not in there:
        return Remains.WHOLE
    return Remains.MIXED if True in there else Remains.GONE


def audit(completed: Planned, values: Mapping[str, float]) -> Recovery | None:
    """What a completed push, or roll-back, needs that a boot of the autopilot has lost, or None.

    That a value is *stored* cannot be proved over MAVLink: the announcement "stored" and a
    (duplicated, late) answer to a read look alike.  So after a boot compare: where any of
    the six came back old, the push is to be undone, as a transaction that had been
    interrupted (which only writes it down where all six are old).  Where somebody else has
    set values meanwhile, nothing is touched.  Whether it was the boot that brought the old ones
    back is for the caller to know.

    Args:
        completed: what was written last (:meth:`onboard.push.journal.Journal.last_written`).
        values: the autopilot's parameters by name, read after the boot.
    """
    if remains(completed.plan, values) not in {Remains.MIXED, Remains.GONE}:
        return None
    return Recovery.undoing(completed, NOT_STORED)
