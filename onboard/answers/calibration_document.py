"""The calibration of one accelerometer in the documents, and what the policy lets be set of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec

from onboard.answers.advice import Advice
from onboard.answers.document_numbers import Numbers, numbers
from onboard.answers.knowledge import determined, seen
from onboard.core.estimate.result import Calibration
from onboard.core.maths.accelerometer import parameter_names
from onboard.core.physics.finding import Finding


class WorthDocument(msgspec.Struct, frozen=True, kw_only=True):
    """The six as they may be set: estimated as far as the flight tells, else as in force in it.

    ``directions`` of six are determined.  The specific force over the loads flown changes by
    ``change_m_s2`` (root mean square); its expected error falls from ``before`` to ``after``; it is
    better with the ``probability``.  ``imus`` are the accelerometers whose knowledge it is.
    """

    scale: Numbers
    offset: Numbers
    directions: int
    imus: list[int]
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


class AdviceDocument(msgspec.Struct, frozen=True, kw_only=True):
    """What the push policy lets be set of a recording's answer, for ArduPilot.

    ``set`` has the six and the cures of effects by name; ``held_back`` says why there are no more:
    for the six by the policy's objection, for a cure by its effect.  ``conditions`` says when an
    offset holds that is not one number for the whole flight.
    """

    set: dict[str, float]
    held_back: dict[str, str]
    conditions: dict[str, str]


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
        imus=list(calibration.together.imus if calibration.together else (calibration.imu,)),
        change_m_s2=found.change,
        error_before_m_s2=found.error_before,
        error_after_m_s2=found.error_after,
        probability=found.probability,
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
