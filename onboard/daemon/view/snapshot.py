"""The snapshot: everything that anybody outside the service may read, frozen, as JSON.

The control API, the status page, MQTT, the parameter view and the terminal all show this one
record and nothing else, so that they cannot disagree.  SI units and radians, times of events in
seconds since the epoch, ages and durations in seconds.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import msgspec

from onboard.answers.calibration_document import WorthDocument

Three: TypeAlias = tuple[float | None, float | None, float | None]
SCHEMA = "onboard.state/1"
DATED_FROM = 1_600_000_000.0
"""Unix time, s; what is dated before that, years before there was this program, was dated by a
clock that nobody had set, and its date is not known [bound]."""


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """Base of everything in a snapshot."""


class MessageRate(Record, frozen=True, kw_only=True):
    """One message type of the link: how many came, how often, what was asked for and granted."""

    count: int
    rate_hz: float
    wanted_hz: float | None = None
    granted_hz: float | None = None
    stream: str | None = None


class EndpointView(Record, frozen=True, kw_only=True):
    """One endpoint: its connection's state and the last error, empty if there was none.

    ``tries``: how many were in vain since it was lost; 0 while it works.
    """

    endpoint: str
    state: str
    reason: str
    tries: int = 0


class LinkView(Record, frozen=True, kw_only=True):
    """Health of the link and identity of the autopilot behind it.

    ``warnings``: what on the wire, or of the estimator, is not as it should be now, one sentence
    each.
    """

    state: str
    endpoints: tuple[EndpointView, ...]
    signed: bool
    system_id: int | None
    component_id: int | None
    autopilot: str | None
    vehicle: str | None
    armed: bool | None
    landed: bool | None
    messages: dict[str, MessageRate]
    counters: dict[str, int]
    warnings: tuple[str, ...] = ()


class TrustView(Record, frozen=True, kw_only=True):
    """The trust window: whether GPS may teach us now, and by name why not."""

    phase: str
    open: bool
    reason: str | None
    reasons: tuple[str, ...]
    windows: int
    trusted_s: float
    rejected: dict[str, int]


class Number(Record, frozen=True, kw_only=True):
    """A value with its standard deviation, same unit."""

    value: float | None
    sigma: float | None


class CoverageView(Record, frozen=True, kw_only=True):
    """How far the flight excites the six numbers, and what to fly next."""

    percent: float
    per_parameter: dict[str, float]
    weakest: str
    advice: str


class CalibrationView(Record, frozen=True, kw_only=True):
    """The six numbers; the same object that ``onboard replay`` and ``explain`` write.

    ``known`` says how far each is: ``yes``, ``roughly``, ``together`` (with the other number of its
    axis, as loaded in flight) or ``no``; ``worth`` what setting what is known is worth.
    """

    scale: Three
    offset: Three
    scale_sigma: Three
    offset_sigma: Three
    parameters: dict[str, float]
    observable: tuple[bool, ...]
    known: tuple[str, ...]
    worth: WorthDocument | None
    note: str


class StateView(Record, frozen=True, kw_only=True):
    """Where one accelerometer stands: made in :mod:`onboard.daemon.view.state`, shown as it is.

    ``name`` is for programs, ``title`` a few words, ``sentence`` why, ``next`` what a person
    should do (empty: nothing).  ``severity``: ``good``, ``info``, ``warning`` or ``error``.
    """

    name: str
    title: str
    sentence: str
    severity: str
    next: str = ""


class StepView(Record, frozen=True, kw_only=True):
    """What a person should do next; ``imu``: for which accelerometer, None: for none."""

    imu: int | None
    text: str
    severity: str


class ImuView(Record, frozen=True, kw_only=True):
    """One accelerometer; ``None`` where a number is not known (yet).

    ``in_force_*`` are what the autopilot uses now.  Residuals "before" are with the values in
    force; None until the flight has been solved with those that were written since.
    """

    imu: int
    status: str
    state: StateView
    calibration: CalibrationView
    in_force_scale: Three
    in_force_offset: Three
    parameters_known: bool
    timing: dict[str, Number]
    trusted_s: float
    rejected: dict[str, int]
    whitened_rms_before: float | None
    whitened_rms_after: float | None
    held_out_before: float | None
    held_out_after: float | None
    velocity_rms_before_m_s: float | None
    velocity_rms_after_m_s: float | None
    coverage: CoverageView
    certificate: dict[str, float | None] | None
    dead_reckoning: dict[str, float | None] | None
    temperature: Number | None


class ChangeView(Record, frozen=True, kw_only=True):
    """One parameter that would be written; ``kept``: not shown by the flight, stays as it is."""

    name: str
    before: float
    after: float
    sigma: float
    kept: bool = False


class ProposalView(Record, frozen=True, kw_only=True):
    """What would be written for one accelerometer.

    ``held_back`` is every reason why it is not written now, by name, with a sentence; empty: it
    is about to be.  ``approved``: a person has allowed it; ``rejected``: has refused it;
    ``approvable``: a person's approval would lift one of the reasons.
    """

    imu: int
    changes: tuple[ChangeView, ...]
    held_back: dict[str, str]
    approved: bool
    rejected: bool
    approvable: bool = False


class WrittenValue(Record, frozen=True, kw_only=True):
    """One parameter of a push; ``read_back``: what the autopilot said last, None: nothing."""

    name: str
    before: float
    written: float
    read_back: float | None


class AccountView(Record, frozen=True, kw_only=True):
    """The account of a push, a sentence each (:mod:`onboard.push.account`)."""

    wrong: str
    written: str
    improved: str
    next: str


class WrittenView(Record, frozen=True, kw_only=True):
    """One push that was completed, as the journal has it; ``at`` is Unix time.

    Residuals ``before`` and ``after`` are of the flight that taught the values: with those that
    were in force then, and with those written.  ``next_*`` are of the flight after it, with the
    values written; ``verdict`` is what that flight said.  ``in_force``: the last push, and the
    autopilot has its values, as far as it has told them.  ``account`` is all of it in sentences.
    """

    imu: int
    at: float
    values: tuple[WrittenValue, ...]
    in_force: bool
    held_out_before: float | None
    held_out_after: float | None
    velocity_rms_before_m_s: float | None
    velocity_rms_after_m_s: float | None
    verdict: str | None = None
    verdict_sentence: str = ""
    next_held_out: float | None = None
    next_velocity_rms_m_s: float | None = None
    account: AccountView | None = None


class JudgedView(Record, frozen=True, kw_only=True):
    """What the flight after the last push said; residuals with the parameters then in force."""

    imu: int
    verdict: str
    sentence: str
    held_out_before_push: float | None
    held_out_after_push: float | None
    velocity_rms_before_push_m_s: float | None
    velocity_rms_after_push_m_s: float | None


class UnfinishedValue(Record, frozen=True, kw_only=True):
    """One parameter of a write that has not ended; ``now``: as read last, None: not known yet."""

    name: str
    before: float
    written: float
    now: float | None


class UnfinishedView(Record, frozen=True, kw_only=True):
    """A write that has not come to its end (:mod:`onboard.daemon.view.unfinished`).

    ``half``: a part of its values is in force and a part is not; None: not known yet.  ``next`` is
    what a person should do about it, empty: nothing.
    """

    imu: int
    half: bool | None
    values: tuple[UnfinishedValue, ...]
    sentence: str
    next: str


class PushView(Record, frozen=True, kw_only=True):
    """Policy, proposals, the transaction under way and the outcome of the last.

    ``approval_needed``: some proposal waits for a person and for nothing else.
    ``can_roll_back``: accelerometers that have the values of their last push, or, nobody knows
    why, some of them and some of those from before.  ``written``: pushes
    that were completed, oldest first; of each accelerometer the first and the last few.
    ``unfinished``: writes that have not come to their end, and are not under way.
    """

    policy: str
    approval_required: bool
    approval_needed: bool
    state: str
    active_imu: int | None
    proposals: tuple[ProposalView, ...]
    last_outcome: str | None
    can_roll_back: tuple[int, ...]
    judged: tuple[JudgedView, ...] = ()
    written: tuple[WrittenView, ...] = ()
    unfinished: tuple[UnfinishedView, ...] = ()


class JournalLine(Record, frozen=True, kw_only=True):
    """One fact of the journal for people; ``at`` is Unix time.

    ``earlier``: of a run of the service before this one, whatever its time says: clocks are set.
    """

    at: float
    kind: str
    transaction: str
    imu: int | None
    text: str
    earlier: bool = False


class Notice(Record, frozen=True, kw_only=True):
    """Something that happened; ``at`` is Unix time, ``kind`` a name for programs."""

    at: float
    kind: str
    text: str
    warning: bool = False


class Snapshot(Record, frozen=True, kw_only=True):
    """Everything, at one moment."""

    version: str
    time: float
    uptime_s: float
    phase: str
    mode: str
    mode_reason: str
    link: LinkView
    trust: TrustView
    imus: tuple[ImuView, ...]
    push: PushView
    parameters: dict[str, float]
    journal: tuple[JournalLine, ...]
    notices: tuple[Notice, ...]
    counters: dict[str, int]
    diagnosis: dict[str, Any] | None = None
    next_step: StepView | None = None
    schema: str = SCHEMA

    def to_json(self) -> bytes:
        """UTF-8 JSON; numbers that are not finite become null."""
        return _ENCODER.encode(self)

    @classmethod
    def from_json(cls, data: bytes) -> Snapshot:
        """Inverse of :meth:`to_json`.

        Raises:
            msgspec.ValidationError: not a snapshot.
        """
        return _DECODER.decode(data)


_ENCODER = msgspec.json.Encoder()
_DECODER = msgspec.json.Decoder(Snapshot)
