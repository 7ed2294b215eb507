"""Records of the core, the link and the push turned into those of the snapshot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import cast

from onboard.core.estimate.result import SIX_NAMES, Calibration, Estimate, Six
from onboard.core.gps.trust import TrustWindow
from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.view.snapshot import (
    CalibrationView,
    CoverageView,
    EndpointView,
    ImuView,
    JournalLine,
    LinkView,
    MessageRate,
    Number,
    Three,
    TrustView,
)
from onboard.daemon.view.state import ALONE, Circumstances, state_of
from onboard.mavlink.link import Link
from onboard.push.entries import (
    Closed,
    Entry,
    Found,
    Planned,
    Purpose,
    Refused,
    Support,
    Undoing,
    Watched,
    Writing,
)
from onboard.push.policy import VehicleCondition

SAME = 1e-6
"""Parameters are float32."""


def imu_view(
    calibration: Calibration,
    circumstances: Circumstances = ALONE,
    parameters: Mapping[str, float] | None = None,
) -> ImuView:
    """One accelerometer's answer for people; what is not finite becomes None.

    Args:
        calibration: the answer; the learner's thread may be busy and it some minutes old.
        circumstances: proposal, push and flight.
        parameters: the autopilot's, as read last.  Where they are not those that the answer was
            compared with, nothing is known yet of the residual with them.
    """
    c = calibration
    in_force = _in_force(c, parameters or {})
    current = in_force == c.in_force_scale + c.in_force_offset
    return ImuView(
        imu=c.imu,
        status=c.status.value,
        state=state_of(c, circumstances),
        calibration=_calibration_view(c),
        in_force_scale=_three(in_force[:3]),
        in_force_offset=_three(in_force[3:]),
        parameters_known=c.parameters_known,
        timing={name: _number(estimate) for name, estimate in c.timing.items()},
        trusted_s=c.trusted_s,
        rejected=c.rejected,
        whitened_rms_before=finite(c.whitened_rms_before) if current else None,
        whitened_rms_after=finite(c.whitened_rms_after),
        held_out_before=finite(c.held_out_before) if current else None,
        held_out_after=finite(c.held_out_after),
        velocity_rms_before_m_s=finite(c.velocity_rms_before) if current else None,
        velocity_rms_after_m_s=finite(c.velocity_rms_after),
        coverage=_coverage_view(c),
        certificate=_certificate_view(c),
        dead_reckoning=_dead_reckoning_view(c, current=current),
        temperature=None if c.temperature is None else _number(c.temperature),
    )


def _calibration_view(c: Calibration) -> CalibrationView:
    named = zip(parameter_names(c.imu).six, c.scale + c.offset, strict=True)
    return CalibrationView(
        scale=_three(c.scale),
        offset=_three(c.offset),
        scale_sigma=_three(c.scale_sigma),
        offset_sigma=_three(c.offset_sigma),
        parameters={name: value for name, value in named if math.isfinite(value)},
        observable=c.observable,
        note=c.note,
    )


def _coverage_view(c: Calibration) -> CoverageView:
    return CoverageView(
        percent=c.coverage.percent,
        per_parameter=dict(zip(SIX_NAMES, c.coverage.per_parameter, strict=True)),
        weakest=c.coverage.weakest,
        advice=c.coverage.advice,
    )


def _certificate_view(c: Calibration) -> dict[str, float | None] | None:
    certificate = c.certificate
    if certificate is None:
        return None
    return {
        "window_s": finite(certificate.window_s),
        "residual_l2": finite(certificate.residual_l2),
        "acceleration_bound_m_s2": finite(certificate.acceleration_bound),
        "uniform_bound_m_s": finite(certificate.uniform_bound),
        "observed_max_m_s": finite(certificate.observed_max),
    }


def _dead_reckoning_view(c: Calibration, *, current: bool) -> dict[str, float | None] | None:
    """Drift without GPS; ``current``: the values in force are those that it was computed for."""
    drift = c.dead_reckoning
    if drift is None:
        return None
    return {
        "horizon_s": finite(drift.horizon_s),
        "drift_before_m_s": finite(drift.drift_before) if current else None,
        "drift_after_m_s": finite(drift.drift_after),
        "windows": drift.windows,
    }


def _in_force(c: Calibration, parameters: Mapping[str, float]) -> Six:
    """The six that the autopilot uses: as read last, else those of the calibration."""
    known = c.in_force_scale + c.in_force_offset
    names = parameter_names(c.imu).six
    if not c.parameters_known or not parameters.keys() >= set(names):
        return known
    read = tuple(parameters[name] for name in names)
    # The autopilot's are float32; the same number is no other value.
    same = all(abs(a - b) <= SAME for a, b in zip(read, known, strict=True))
    return known if same else cast("Six", read)


def journal_view(lines: Sequence[tuple[float, Entry]]) -> tuple[JournalLine, ...]:
    """The journal for people, oldest first; read-backs go without saying."""
    imus: dict[str, int] = {}
    shown = []
    for at, entry in lines:
        match entry:
            case Planned(transaction, plan, purpose, support):
                imus[transaction] = plan.imu
                changed = sum(change.differs for change in plan.changes)
                what = "push" if purpose is Purpose.PUSH else "roll-back"
                text = f"{what} of {changed} values begins{_resting_on(support)}"
            case Writing(name=name, before=before, value=value, undo=undo):
                text = f"{name}: {before:.6g} -> {value:.6g}{' (undo)' if undo else ''}"
            case Undoing(sentence=sentence):
                text = f"undoing: {sentence}"
            case Closed(result=result, sentence=sentence):
                text = f"{result.value.replace('_', ' ')}: {sentence}"
            case Watched(verdict=verdict, sentence=sentence):
                text = f"flight after the push: {verdict.value}: {sentence}"
            case Found(imu=imu, verdict=verdict, effects=effects, missing=missing):
                imus[entry.transaction] = imu
                text = f"flight diagnosed: {diagnosis_in_words(verdict, effects)}"
                if missing:
                    text += f"; not to be written by itself: {missing}"
            case Refused(imu=imu, sentence=sentence):
                imus[entry.transaction] = imu
                text = f"held back: {sentence}" if sentence else "no longer held back"
            case _:
                continue
        shown.append(
            JournalLine(
                at=at,
                kind=type(entry).__name__.lower(),
                transaction=entry.transaction,
                imu=imus.get(entry.transaction),
                text=text,
            )
        )
    return tuple(shown)


def _resting_on(support: Support | None) -> str:
    """What a push rests on, in a few words."""
    if support is None:
        return ""
    approved = ", approved by a person" if support.approved else ""
    return f" after {support.trusted_s:.0f} s of flight{approved}"


def diagnosis_in_words(verdict: str, effects: Sequence[str]) -> str:
    """One line about a diagnosis."""
    names = ", ".join(name.replace("_", " ") for name in effects)
    return f"{verdict.replace('_', ' ')}{f': {names}' if names else ''}"


NO_TRUST = TrustView(
    phase="waiting", open=False, reason=None, reasons=(), windows=0, trusted_s=0.0, rejected={}
)


def trust_view(window: TrustWindow, *, windows: int) -> TrustView:
    """The trust window; ``windows``: how often it has opened."""
    return TrustView(
        phase=window.phase.value,
        open=window.is_open,
        reason=window.reason.value if window.reason is not None else None,
        reasons=tuple(reason.value for reason in window.reasons),
        windows=windows,
        trusted_s=window.trusted_s,
        rejected=window.rejected,
    )


def link_view(
    link: Link, *, condition: VehicleCondition, messages: dict[str, MessageRate], signed: bool
) -> LinkView:
    """Health of the link, and who is behind it."""
    autopilot = link.autopilot
    counters: dict[str, int] = {
        "standby": link.standby,
        "echoed": link.echoed,
        "reboots": link.boot_clock.reboots,
    }
    for connection in link.connections:
        statistics = connection.codec.statistics
        for name in ("frames", "bad_bytes", "bad_frames", "bad_signatures", "unknown", "sent"):
            counters[name] = counters.get(name, 0) + getattr(statistics, name)
        for source in statistics.sources.values():
            for name in ("lost", "late", "duplicated"):
                counters[name] = counters.get(name, 0) + getattr(source, name)
        for name in ("dropped", "connects", "failures"):
            counters[name] = counters.get(name, 0) + getattr(connection, name)
    return LinkView(
        state=link.state.value,
        endpoints=tuple(
            EndpointView(
                endpoint=str(connection.endpoint),
                state=connection.state.value,
                reason=connection.last_error,
                tries=connection.outage.tries,
            )
            for connection in link.connections
        ),
        signed=signed,
        system_id=autopilot.system if autopilot else None,
        component_id=autopilot.component if autopilot else None,
        autopilot=autopilot.firmware_name if autopilot else None,
        vehicle=autopilot.vehicle if autopilot else None,
        armed=condition.armed,
        landed=condition.landed,
        messages=messages,
        counters=counters,
    )


def finite_values(values: Mapping[str, float]) -> dict[str, float]:
    """The numbers that JSON can carry."""
    return {name: value for name, value in values.items() if math.isfinite(value)}


def finite(value: float) -> float | None:
    """The number, or None where there is none."""
    return value if math.isfinite(value) else None


def _three(values: tuple[float, float, float]) -> Three:
    x, y, z = values
    return (finite(x), finite(y), finite(z))


def _number(estimate: Estimate) -> Number:
    return Number(value=finite(estimate.value), sigma=finite(estimate.sigma))
