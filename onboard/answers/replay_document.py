"""``onboard.replay/1``: the calibration of every accelerometer as other programs read it.

Every number is finite: what is not known, or not finite, is ``null``.  Fields may be added within a
schema's version; renaming or removing one makes a new version.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from onboard.answers.calibration_document import (
    AdviceDocument,
    CalibrationDocument,
    calibration_document,
)
from onboard.answers.document_numbers import (
    Number,
    Numbers,
    finite,
    number,
    numbers,
    timing_document,
)
from onboard.answers.flight_document import FlightsDocument
from onboard.answers.json_file import indented
from onboard.core.estimate.result import SIX_NAMES, Calibration
from onboard.core.maths.accelerometer import SixParameters

REPLAY_SCHEMA = "onboard.replay/1"


class CertificateDocument(msgspec.Struct, frozen=True, kw_only=True):
    """Bound on the velocity residual everywhere in the window, from its L2 norm."""

    window_s: float | None
    residual_l2: float | None
    acceleration_bound_m_s2: float | None
    uniform_bound_m_s: float | None
    observed_max_m_s: float | None


class DeadReckoningDocument(msgspec.Struct, frozen=True, kw_only=True):
    """Velocity drift without GPS over the horizon, with the old parameters and the new."""

    horizon_s: float | None
    drift_before_m_s: float | None
    drift_after_m_s: float | None
    windows: int


class AtRestDocument(msgspec.Struct, frozen=True, kw_only=True):
    """By how much more than gravity the accelerometer reads at rest, which is not in the fit."""

    in_force_m_s2: float | None
    estimate_m_s2: float | None
    sigma_m_s2: float | None
    seconds: float | None


class CoverageDocument(msgspec.Struct, frozen=True, kw_only=True):
    """How far the flight excited the six, and what to fly next."""

    percent: float | None
    per_parameter: dict[str, float | None]
    weakest: str
    advice: str


class SixDocument(msgspec.Struct, frozen=True, kw_only=True):
    """A scale and an offset: the parameters in force, or a simulator's truth."""

    scale: Numbers
    offset: Numbers


class PushedDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One parameter that was written and read back."""

    name: str
    before: float | None
    wanted: float
    read_back: float | None


class ResidualDocument(msgspec.Struct, frozen=True, kw_only=True):
    """Residuals with the parameters in force and with the estimate.

    ``whitened`` is in units of the expected noise, ``held_out`` the same on segments that
    the fit did not see.
    """

    whitened_rms_before: float | None
    whitened_rms_after: float | None
    held_out_whitened_rms_before: float | None
    held_out_whitened_rms_after: float | None
    velocity_rms_before_m_s: float | None
    velocity_rms_after_m_s: float | None


class ImuDocument(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One accelerometer.

    ``advice`` is there where a recording of an ArduPilot was read; ``truth`` and ``pushed`` are
    there in the demo only.
    """

    imu: int
    status: str
    calibration: CalibrationDocument
    in_force: SixDocument
    parameters_known: bool
    timing: dict[str, Number]
    trusted_s: float | None
    rejected: dict[str, int]
    residual: ResidualDocument
    certificate: CertificateDocument | None
    dead_reckoning: DeadReckoningDocument | None
    at_rest: AtRestDocument | None
    coverage: CoverageDocument
    temperature: Number | None
    advice: AdviceDocument | msgspec.UnsetType = msgspec.UNSET
    truth: SixDocument | msgspec.UnsetType = msgspec.UNSET
    pushed: list[PushedDocument] | msgspec.UnsetType = msgspec.UNSET


class RecordingDocument(msgspec.Struct, frozen=True, kw_only=True):
    """What was read; ``damage`` and ``notes`` are sentences for people."""

    files: list[str]
    autopilot: str
    duration_s: float | None
    samples: dict[str, int]
    damage: list[str] = []
    notes: list[str] = []


class PairDocument(msgspec.Struct, frozen=True, kw_only=True):
    """Mean force of the first accelerometer less that of the second, x, y, z, over the flight.

    ``own`` is what it should be, as the pair itself has it without GPS; ``chi_square`` (three
    degrees of freedom) and ``p_value`` are of the estimates against that.  The first is further
    from the second than configured by ``distance_m``, body axes.
    """

    imus: list[int]
    windows: int
    in_force_m_s2: Numbers
    estimated_m_s2: Numbers
    own_m_s2: Numbers
    own_sigma_m_s2: Numbers
    chi_square: float | None
    p_value: float | None
    distance_m: Numbers
    distance_sigma_m: Numbers


class JointDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One accelerometer's six from all accelerometers together; nothing is set from them."""

    imu: int
    scale: Numbers
    offset: Numbers
    scale_sigma: Numbers
    offset_sigma: Numbers


class AccelerometersDocument(msgspec.Struct, frozen=True, kw_only=True):
    """The accelerometers of the vehicle compared.

    ``common_cause`` has sentences: what all of them ask for alike is not their own.
    """

    pairs: list[PairDocument]
    joint: list[JointDocument]
    common_cause: list[str]


class ReplayDocument(msgspec.Struct, frozen=True, kw_only=True):
    """``onboard replay --json`` (and, with ``truth`` and ``pushed``, ``onboard demo --json``).

    ``accelerometers`` is there where a recording has several that can be compared, ``flights``
    where several recordings were merged.
    """

    recording: RecordingDocument
    imus: list[ImuDocument]
    accelerometers: AccelerometersDocument | msgspec.UnsetType = msgspec.UNSET
    flights: list[FlightsDocument] | msgspec.UnsetType = msgspec.UNSET
    schema: str = REPLAY_SCHEMA

    def to_json(self) -> bytes:
        """Indented JSON, ``schema`` first, with a final newline."""
        fields = msgspec.to_builtins(self)
        ordered = {"schema": fields.pop("schema"), **fields}
        return indented(ordered)


def imu_document(
    calibration: Calibration,
    autopilot: str = "ardupilot",
    *,
    advice: AdviceDocument | None = None,
    truth: SixParameters | None = None,
    pushed: Sequence[PushedDocument] | None = None,
) -> ImuDocument:
    """One accelerometer's entry in ``imus``."""
    c = calibration
    return ImuDocument(
        imu=c.imu,
        status=c.status.value,
        calibration=calibration_document(c, autopilot),
        in_force=SixDocument(scale=numbers(c.in_force_scale), offset=numbers(c.in_force_offset)),
        parameters_known=c.parameters_known,
        timing=timing_document(c.timing),
        trusted_s=finite(c.trusted_s),
        rejected={name: int(n) for name, n in c.rejected.items()},
        residual=ResidualDocument(
            whitened_rms_before=finite(c.whitened_rms_before),
            whitened_rms_after=finite(c.whitened_rms_after),
            held_out_whitened_rms_before=finite(c.held_out_before),
            held_out_whitened_rms_after=finite(c.held_out_after),
            velocity_rms_before_m_s=finite(c.velocity_rms_before),
            velocity_rms_after_m_s=finite(c.velocity_rms_after),
        ),
        certificate=_certificate(c),
        dead_reckoning=_dead_reckoning(c),
        at_rest=_at_rest(c),
        coverage=CoverageDocument(
            percent=finite(c.coverage.percent),
            per_parameter=dict(zip(SIX_NAMES, numbers(c.coverage.per_parameter), strict=True)),
            weakest=c.coverage.weakest,
            advice=c.coverage.advice,
        ),
        temperature=None if c.temperature is None else number(c.temperature),
        advice=msgspec.UNSET if advice is None else advice,
        truth=msgspec.UNSET
        if truth is None
        else SixDocument(scale=numbers(truth.scale), offset=numbers(truth.offset)),
        pushed=msgspec.UNSET if pushed is None else list(pushed),
    )


def _certificate(calibration: Calibration) -> CertificateDocument | None:
    c = calibration.certificate
    if c is None:
        return None
    return CertificateDocument(
        window_s=finite(c.window_s),
        residual_l2=finite(c.residual_l2),
        acceleration_bound_m_s2=finite(c.acceleration_bound),
        uniform_bound_m_s=finite(c.uniform_bound),
        observed_max_m_s=finite(c.observed_max),
    )


def _dead_reckoning(calibration: Calibration) -> DeadReckoningDocument | None:
    d = calibration.dead_reckoning
    if d is None:
        return None
    return DeadReckoningDocument(
        horizon_s=finite(d.horizon_s),
        drift_before_m_s=finite(d.drift_before),
        drift_after_m_s=finite(d.drift_after),
        windows=d.windows,
    )


def _at_rest(calibration: Calibration) -> AtRestDocument | None:
    r = calibration.at_rest
    if r is None:
        return None
    return AtRestDocument(
        in_force_m_s2=finite(r.in_force),
        estimate_m_s2=finite(r.estimate),
        sigma_m_s2=finite(r.sigma),
        seconds=finite(r.seconds),
    )
