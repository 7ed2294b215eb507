"""The JSON documents that other programs rely on, built from the core's records.

Every number in a document is finite: what is not known, or not finite, is ``null``.  Fields may
be added within a schema's version; renaming or removing one makes a new version.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import msgspec

from onboard.answers.advice import Advice
from onboard.answers.answer import FlightAnswer
from onboard.answers.knowledge import determined, seen
from onboard.core.estimate.result import SIX_NAMES, Calibration, Estimate, Status
from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.core.physics.finding import Finding

REPLAY_SCHEMA = "onboard.replay/1"
TIMING = ("gps_delay_s", "gps_smoothing_window_s", "imu_delay_s")
"""Always in ``timing``, ``null`` where a flight could not tell."""

Numbers = list[float | None]


class Number(msgspec.Struct, frozen=True):
    """A value with its standard deviation, both in the unit that the name carries."""

    value: float | None = None
    sigma: float | None = None


class WorthDocument(msgspec.Struct, frozen=True, kw_only=True):
    """The six as they may be set: estimated as far as the flight tells, else as in force in it.

    ``directions`` of six are determined.  The specific force over the loads flown changes by
    ``change_m_s2`` (root mean square); its expected error falls from ``before`` to ``after``; it is
    better with the ``probability``.
    """

    scale: Numbers
    offset: Numbers
    directions: int
    change_m_s2: float
    error_before_m_s2: float
    error_after_m_s2: float
    probability: float


class CalibrationDocument(msgspec.Struct, frozen=True, kw_only=True):
    """Scale and offset, x, y, z, absolute, ArduPilot's; offsets in m/s^2.

    ``status`` is how far they may be believed; ``parameters`` has them by name, for ArduPilot only;
    ``observable`` is in the order scale x, y, z, offset x, y, z; so is ``known``: ``yes``,
    ``roughly``, ``together`` (with the other number of its axis, as loaded in flight) or ``no``.
    """

    status: str
    scale: Numbers
    offset: Numbers
    scale_sigma: Numbers
    offset_sigma: Numbers
    parameters: dict[str, float]
    observable: list[bool]
    known: list[str]
    worth: WorthDocument | None
    note: str


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


class AdviceDocument(msgspec.Struct, frozen=True, kw_only=True):
    """What the push policy lets be set of a recording's answer, for ArduPilot.

    ``set`` has the six and the cures of effects by name; ``held_back`` says why there are no more:
    for the six by the policy's objection, for a cure by its effect.  ``conditions`` says when an
    offset holds that is not one number for the whole flight.
    """

    set: dict[str, float]
    held_back: dict[str, str]
    conditions: dict[str, str]


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


class FlightDocument(msgspec.Struct, frozen=True, kw_only=True):
    """What one of several recordings says of one accelerometer by itself.

    ``counted`` flights are in the merged answer; ``why`` says why another one is not.
    ``chi_square`` (``dof`` degrees of freedom) and ``p_value`` are of its difference from the
    others that count, in what both know; ``null`` where it is not compared.
    """

    imu: int
    status: str
    scale: Numbers
    offset: Numbers
    scale_sigma: Numbers
    offset_sigma: Numbers
    timing: dict[str, Number]
    effects: list[str]
    trusted_s: float | None
    chi_square: float | None
    dof: int
    p_value: float | None
    contradicted: bool
    counted: bool
    why: str


class FlightsDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One of several recordings: an entry for each accelerometer that has an answer."""

    file: str
    imus: list[FlightDocument]


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
        return msgspec.json.format(msgspec.json.encode(ordered), indent=2) + b"\n"


def finite(value: float | None) -> float | None:
    """The number, or None where it is not one."""
    return float(value) if value is not None and math.isfinite(value) else None


def number(estimate: Estimate | None) -> Number:
    """An estimate; both fields ``null`` where there is none."""
    if estimate is None:
        return Number()
    return Number(finite(estimate.value), finite(estimate.sigma))


def calibration_document(calibration: Calibration, autopilot: str) -> CalibrationDocument:
    """The calibration object that replay, explain and the daemon share."""
    names = parameter_names(calibration.imu).six
    values = calibration.scale + calibration.offset
    named = zip(names, values, strict=True) if autopilot == "ardupilot" else ()
    return CalibrationDocument(
        status=calibration.status.value,
        scale=numbers(calibration.scale),
        offset=numbers(calibration.offset),
        scale_sigma=numbers(calibration.scale_sigma),
        offset_sigma=numbers(calibration.offset_sigma),
        parameters={name: float(value) for name, value in named if math.isfinite(value)},
        observable=[bool(flag) for flag in calibration.observable],
        known=list(seen(calibration)),
        worth=worth_document(calibration),
        note=calibration.note,
    )


def worth_document(calibration: Calibration) -> WorthDocument | None:
    """What the flight determines, and what it is worth; None if nothing can be said."""
    found = determined(calibration)
    if found is None:
        return None
    return WorthDocument(
        scale=numbers(found.six.scale),
        offset=numbers(found.six.offset),
        directions=found.directions,
        change_m_s2=found.change,
        error_before_m_s2=found.error_before,
        error_after_m_s2=found.error_after,
        probability=found.probability,
    )


def timing_document(timing: Mapping[str, Estimate]) -> dict[str, Number]:
    """The three that are always estimated, then whatever else the core knows."""
    names = (*TIMING, *(name for name in timing if name not in TIMING))
    return {name: number(timing.get(name)) for name in names}


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


def flight_document(imu: int, flight: FlightAnswer) -> FlightDocument:
    """One accelerometer's entry of one recording in ``flights``."""
    given, apart = flight.given, flight.apart
    c = None if given is None else given.calibration
    nothing: Numbers = [None, None, None]
    return FlightDocument(
        imu=imu,
        status=Status.INSUFFICIENT.value if c is None else c.status.value,
        scale=nothing if c is None else numbers(c.scale),
        offset=nothing if c is None else numbers(c.offset),
        scale_sigma=nothing if c is None else numbers(c.scale_sigma),
        offset_sigma=nothing if c is None else numbers(c.offset_sigma),
        timing=timing_document({} if c is None else c.timing),
        effects=[] if given is None else [e.name for e in given.diagnosis.effects],
        trusted_s=0.0 if c is None else finite(c.trusted_s),
        chi_square=finite(apart.chi_square) if apart.dof else None,
        dof=apart.dof,
        p_value=finite(apart.p_value) if apart.dof else None,
        contradicted=flight.contradicted,
        counted=flight.counted,
        why=flight.why,
    )


def advice_document(
    advice: Advice | None, effects: Sequence[Finding] = ()
) -> AdviceDocument | None:
    """The advice as other programs read it; None where there is none.

    Args:
        advice: for one accelerometer.
        effects: whose cures it judges.
    """
    if advice is None:
        return None
    held_back: dict[str, str] = {}
    for refusal in advice.refusals:
        held_back.setdefault(refusal.objection.value, refusal.sentence)
    return AdviceDocument(
        set=advice.to_set(effects),
        held_back=held_back
        | {e.name: advice.against[e.name] for e in effects if e.name in advice.against},
        conditions=dict(advice.conditions),
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


def numbers(values: Sequence[float]) -> Numbers:
    """Numbers for a document; None where one is not finite."""
    return [finite(value) for value in values]
