"""The snapshot: everything that anybody outside the service may read, frozen, as JSON.

The control API, the status page, MQTT, the parameter view and the terminal all show this one
record and nothing else, so that they cannot disagree.  SI units and radians, times of events in
seconds since the epoch, ages and durations in seconds.
"""

from __future__ import annotations

from typing import Any

import msgspec

SCHEMA = "onboard.state/1"


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """Base of everything in a snapshot."""


class MessageRate(Record, frozen=True, kw_only=True):
    """One message type of the link: how many came, how often, and what was asked for."""

    count: int
    rate_hz: float
    wanted_hz: float | None = None


class LinkView(Record, frozen=True, kw_only=True):
    """Health of the link and identity of the autopilot behind it."""

    state: str
    endpoints: tuple[str, ...]
    signed: bool
    heartbeat_age_s: float | None
    system_id: int | None
    component_id: int | None
    autopilot: str | None
    vehicle: str | None
    armed: bool | None
    landed: bool | None
    messages: dict[str, MessageRate]
    counters: dict[str, int]


class TrustView(Record, frozen=True, kw_only=True):
    """The trust window: whether GPS may teach us now, and by name why not."""

    open: bool
    reasons: tuple[str, ...]
    windows: int
    trusted_s: float
    rejected: dict[str, int]


class Number(Record, frozen=True, kw_only=True):
    """A value with its standard deviation, same unit."""

    value: float
    sigma: float


class CoverageView(Record, frozen=True, kw_only=True):
    """How far the flight excites the six numbers, and what to fly next."""

    percent: float
    per_parameter: dict[str, float]
    weakest: str
    advice: str


class ImuView(Record, frozen=True, kw_only=True):
    """One accelerometer.

    ``calibration`` is the calibration object that replay and explain write too.
    """

    imu: int
    status: str
    calibration: dict[str, Any]
    in_force_scale: tuple[float, float, float]
    in_force_offset: tuple[float, float, float]
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
    certificate: dict[str, float] | None
    dead_reckoning: dict[str, float] | None
    temperature: Number | None
    advice: str


class ChangeView(Record, frozen=True, kw_only=True):
    """One parameter that would be (or was) written."""

    name: str
    before: float | None
    after: float
    sigma: float | None = None


class ProposalView(Record, frozen=True, kw_only=True):
    """What would be written for one accelerometer, and by name what still holds it back."""

    imu: int
    changes: tuple[ChangeView, ...]
    held_back: tuple[str, ...]
    approved: bool


class PushView(Record, frozen=True, kw_only=True):
    """Policy, state of the transaction, proposals and the last outcome."""

    policy: str
    approval_required: bool
    approval_needed: bool
    state: str
    active_imu: int | None
    proposals: tuple[ProposalView, ...]
    last_outcome: str | None
    can_roll_back: tuple[int, ...]


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
    journal: tuple[dict[str, Any], ...]
    counters: dict[str, int]
    diagnosis: dict[str, Any] | None = None
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
