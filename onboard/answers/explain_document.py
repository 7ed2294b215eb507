"""``onboard.explain/1``: the diagnosis as other programs read it.

Every number is finite; what is not known is ``null``.  Times are seconds since the first inertial
sample, names are the controlled vocabulary of effects.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from onboard.answers.advice import Advice
from onboard.answers.calibration_document import (
    AdviceDocument,
    CalibrationDocument,
    advice_document,
    calibration_document,
)
from onboard.answers.document_numbers import Number, finite, timing_document
from onboard.answers.json_file import indented
from onboard.answers.verdict import unused_in_words, verdict_of
from onboard.answers.words import DISTRUST
from onboard.core.diagnosis.records import Ambiguity, Diagnosis, Mismatch, NotTestable, Rung, Unused
from onboard.core.physics.catalogue import danger_of
from onboard.core.physics.finding import Finding, Where
from onboard.push.diagnosed import severity_of_effect

EXPLAIN_SCHEMA = "onboard.explain/1"


class UnknownDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One unknown of an effect."""

    value: float | None
    sigma: float | None
    unit: str


class WhereDocument(msgspec.Struct, frozen=True, kw_only=True):
    """Where a mismatch lives."""

    start_s: float | None
    end_s: float | None
    axis: str
    regime: str
    share: float | None


class RivalDocument(msgspec.Struct, frozen=True, kw_only=True):
    """An effect that could stand in, and by how much it does worse."""

    name: str
    delta_bic: float | None


class EffectDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One accepted effect.

    ``severity`` is ``info`` where every calibration has it, ``error`` where it is dangerous to fly
    with (``danger`` says why), else ``warning``.
    """

    name: str
    severity: str
    unknowns: dict[str, UnknownDocument]
    share_of_mismatch: float | None
    delta_bic: float | None
    held_out_whitened_rms_before: float | None
    held_out_whitened_rms_after: float | None
    parameters: dict[str, float]
    cure: str
    where: list[WhereDocument]
    rivals: list[RivalDocument]
    intervals: list[list[float]]
    formula: str = ""
    held_out_velocity_rms_before_m_s: float | None = None
    held_out_velocity_rms_after_m_s: float | None = None
    danger: str = ""


class MismatchDocument(msgspec.Struct, frozen=True, kw_only=True):
    """Residual before (six numbers only) and after (everything that was found)."""

    detected: bool
    whitened_rms_before: float | None
    whitened_rms_after: float | None
    p_value: float | None
    velocity_rms_before_m_s: float | None
    velocity_rms_after_m_s: float | None
    held_out_whitened_rms_before: float | None
    held_out_whitened_rms_after: float | None
    held_out_velocity_rms_before_m_s: float | None
    held_out_velocity_rms_after_m_s: float | None
    where: list[WhereDocument]
    fixes: int
    fixes_believed: int


class AmbiguityDocument(msgspec.Struct, frozen=True, kw_only=True):
    """Effects that this flight cannot tell apart."""

    names: list[str]
    tell_apart: str


class NotTestableDocument(msgspec.Struct, frozen=True, kw_only=True):
    """An effect that this recording cannot speak about."""

    name: str
    why: str


class UnusedDocument(msgspec.Struct, frozen=True, kw_only=True):
    """Flight whose fixes were not used."""

    start_s: float | None
    end_s: float | None
    reason: str
    why: str
    contradicted: bool | None


class RungDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One step of the ladder of models."""

    name: str
    whitened_rms: float | None
    held_out_whitened_rms: float | None
    velocity_rms_m_s: float | None
    held_out_velocity_rms_m_s: float | None


class UnseenDocument(msgspec.Struct, frozen=True, kw_only=True):
    """An effect that was looked for and not found: sizes that this flight would have shown."""

    name: str
    smallest: dict[str, float]
    unit: str


class ExplainedRecording(msgspec.Struct, frozen=True, kw_only=True):
    """What was read; ``damage``: what was skipped of damaged files, in sentences.

    ``notes``: in which order the files are taken, where there is something to say of it.
    """

    files: list[str]
    autopilot: str
    duration_s: float | None
    imu: int
    samples: dict[str, int]
    damage: list[str] = []
    notes: list[str] = []


class ExplainDocument(msgspec.Struct, frozen=True, kw_only=True):
    """``onboard explain --json``.

    ``headline`` is the verdict as a sentence; ``severity`` is ``good``, ``info``, ``warning`` or
    ``error``.
    """

    recording: ExplainedRecording
    calibration: CalibrationDocument
    timing: dict[str, Number]
    verdict: str
    headline: str
    severity: str
    note: str
    mismatch: MismatchDocument
    effects: list[EffectDocument]
    ambiguous: list[AmbiguityDocument]
    not_testable: list[NotTestableDocument]
    ladder: list[RungDocument]
    unused: list[UnusedDocument]
    not_seen: list[UnseenDocument]
    advice: AdviceDocument | msgspec.UnsetType = msgspec.UNSET
    schema: str = EXPLAIN_SCHEMA

    def to_json(self) -> bytes:
        """Indented, ends with a line feed."""
        return indented(self)


def explain_document(
    diagnosis: Diagnosis,
    *,
    files: Sequence[str],
    autopilot: str,
    duration_s: float,
    samples: dict[str, int],
    advice: Advice | None = None,
    damage: Sequence[str] = (),
    notes: Sequence[str] = (),
) -> ExplainDocument:
    """The document of one diagnosis; ``advice`` on what may be set, where it is asked for."""
    sentence, severity = verdict_of(diagnosis)
    return ExplainDocument(
        recording=ExplainedRecording(
            files=list(files),
            autopilot=autopilot,
            duration_s=finite(duration_s),
            imu=diagnosis.imu,
            samples=samples,
            damage=list(damage),
            notes=list(notes),
        ),
        calibration=calibration_document(diagnosis.calibration, autopilot),
        timing=timing_document(diagnosis.timing),
        verdict=diagnosis.verdict.value,
        headline=sentence,
        severity=severity,
        note=" ".join(x for x in (diagnosis.note, *unused_in_words(diagnosis)) if x),
        mismatch=_mismatch(diagnosis.mismatch),
        effects=[_effect(e, autopilot) for e in diagnosis.effects],
        ambiguous=ambiguity_documents(diagnosis.ambiguous),
        not_testable=not_testable_documents(diagnosis.not_testable),
        ladder=[_rung(rung) for rung in diagnosis.ladder],
        unused=[_unused(stretch) for stretch in diagnosis.unused],
        not_seen=[
            UnseenDocument(name=u.name, smallest=u.smallest, unit=u.unit) for u in diagnosis.unseen
        ],
        advice=advice_document(advice, diagnosis.effects) or msgspec.UNSET,
    )


def _mismatch(m: Mismatch) -> MismatchDocument:
    return MismatchDocument(
        detected=m.detected,
        whitened_rms_before=finite(m.whitened_rms_before),
        whitened_rms_after=finite(m.whitened_rms_after),
        p_value=finite(m.p_value),
        velocity_rms_before_m_s=finite(m.velocity_rms_before),
        velocity_rms_after_m_s=finite(m.velocity_rms_after),
        held_out_whitened_rms_before=finite(m.held_out_before),
        held_out_whitened_rms_after=finite(m.held_out_after),
        held_out_velocity_rms_before_m_s=finite(m.held_out_velocity_before),
        held_out_velocity_rms_after_m_s=finite(m.held_out_velocity_after),
        where=[where_document(w) for w in m.where],
        fixes=m.fixes,
        fixes_believed=m.believed,
    )


def _rung(r: Rung) -> RungDocument:
    return RungDocument(
        name=r.name,
        whitened_rms=finite(r.whitened_rms),
        held_out_whitened_rms=finite(r.held_out),
        velocity_rms_m_s=finite(r.velocity_rms),
        held_out_velocity_rms_m_s=finite(r.held_out_velocity),
    )


def _unused(u: Unused) -> UnusedDocument:
    return UnusedDocument(
        start_s=finite(u.start_s),
        end_s=finite(u.end_s),
        reason=u.reason,
        why=DISTRUST.get(u.reason, u.reason),
        contradicted=u.contradicted,
    )


def _effect(e: Finding, autopilot: str) -> EffectDocument:
    return EffectDocument(
        name=e.name,
        severity=severity_of_effect(e.name, danger_of(e)),
        danger=danger_of(e),
        unknowns={
            name: UnknownDocument(value=finite(q.value), sigma=finite(q.sigma), unit=q.unit)
            for name, q in e.unknowns.items()
        },
        share_of_mismatch=finite(e.share_of_mismatch),
        delta_bic=finite(e.delta_bic),
        held_out_whitened_rms_before=finite(e.held_out_before),
        held_out_whitened_rms_after=finite(e.held_out_after),
        parameters=dict(e.parameters) if autopilot == "ardupilot" else {},
        cure=e.cure,
        where=[where_document(w) for w in e.where],
        rivals=[RivalDocument(name=r.name, delta_bic=finite(r.delta_bic)) for r in e.confounders],
        intervals=[[float(a), float(b)] for a, b in e.intervals],
        formula=e.formula,
        held_out_velocity_rms_before_m_s=finite(e.held_out_velocity_before),
        held_out_velocity_rms_after_m_s=finite(e.held_out_velocity_after),
    )


def where_document(w: Where) -> WhereDocument:
    """A place of a mismatch or of an effect."""
    return WhereDocument(
        start_s=finite(w.start_s),
        end_s=finite(w.end_s),
        axis=w.axis,
        regime=w.regime,
        share=finite(w.share),
    )


def ambiguity_documents(every: Sequence[Ambiguity]) -> list[AmbiguityDocument]:
    """Effects that a flight cannot tell apart."""
    return [AmbiguityDocument(names=list(a.names), tell_apart=a.tell_apart) for a in every]


def not_testable_documents(every: Sequence[NotTestable]) -> list[NotTestableDocument]:
    """Effects that a recording cannot speak about."""
    return [NotTestableDocument(name=n.name, why=n.why) for n in every]
