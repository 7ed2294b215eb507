"""What one of several recordings has to say in the answer merged from all of them.

A flight counts

* if it is calibrated, or lacks nothing but motion that shows all of the six: what it does show is
  right, and others show the rest;
* not if its numbers are wrong by nobody knows how much: its residual is not noise, more than half
  of its fixes are refused, what is missing from the model moves the six and is not modelled beside
  them, its parts contradict each other, or nothing of it could be solved;
* not if it was shorter than the least trusted time: then its noise levels are not known;
* not if it contradicts the others (:mod:`onboard.core.estimate.merged_flights`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from onboard.answers.answer import Answer
from onboard.answers.recorded import NO_FLIGHT, Recorded
from onboard.core.diagnosis.records import Verdict
from onboard.core.diagnosis.together import Asked
from onboard.core.estimate.calibration_record import judged_by
from onboard.core.estimate.calibration_status import doubt_of
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.merged_flights import Apart, FlightSix, flight_six, raw_of
from onboard.core.estimate.merged_record import of_raw
from onboard.core.estimate.result import Calibration, Status
from onboard.core.maths.accelerometer import SixParameters, parameters_of
from onboard.core.maths.arrays import vector3
from onboard.core.physics.catalogue import bearing_of
from onboard.core.physics.effect import Bearing

BESIDE = (Bearing.HARMLESS, Bearing.BESIDE)
NOT_COMPARED = Apart(0.0, 0)


@dataclass(frozen=True, slots=True)
class Share:
    """One recording's answer about an accelerometer, and its part in the merged one.

    Attributes:
        given: the answer, of the raw sensor.
        said: what it says to the others; None if it does not count.
        judged: its calibration, residuals against the parameters in force last.
        why: it does not count, in words; empty if it does.
        applied: what the samples were not raw of; None if they were.
    """

    given: Answer
    said: FlightSix | None
    judged: Calibration
    why: str
    applied: SixParameters | None = None

    def of_raw(self, asked: Asked) -> Asked:
        """What it says of an effect, for the six of the raw sensor."""
        return asked if self.applied is None else asked.of_raw(raw_of(self.applied))


def share_of(
    recorded: Recorded, imu: int, applied: SixParameters | None, in_force: SixParameters
) -> Share:
    """One recording's answer, and whether it counts.

    Args:
        recorded: the recording.
        imu: which accelerometer.
        applied: what the autopilot had in force, where only another recording says it.
        in_force: the parameters that the autopilot used last.
    """
    given = recorded.answer(imu)
    c = given.calibration
    why = _why_not(recorded, given, imu)
    engine = recorded.engine(imu)
    said = None if why or engine is None else flight_six(c, _center(engine))
    if said is None:
        why = why or "it has no numbers"
    judged = c
    if said is None:
        pass
    elif applied is not None:
        said, judged = said.of_raw(applied), of_raw(c, applied)
        given = replace(given, diagnosis=replace(given.diagnosis, calibration=judged))
    elif engine is not None and SixParameters(c.in_force_scale, c.in_force_offset) != in_force:
        judged = judged_by(c, engine, in_force)
    return Share(given, said, judged, why, applied)


def _center(engine: Engine) -> SixParameters | None:
    """Of the prior: what was in force when the flight began."""
    if engine.prior is None:
        return None
    six = parameters_of(engine.prior)
    return SixParameters(vector3(six[:3]), vector3(six[3:]))


def _why_not(recorded: Recorded, given: Answer, imu: int) -> str:
    """Why a flight does not count, in words; empty if it does."""
    c, engine, diagnosis = given.calibration, recorded.engine(imu), given.diagnosis
    if c.status is Status.INVALID:
        return c.note.split(". ")[0].rstrip(".") or "it has no valid result"
    if engine is None or (solution := engine.solution()) is None:
        return c.note.split(". ")[0].rstrip(".") or NO_FLIGHT
    beside = all(bearing_of(e.name) in BESIDE for e in diagnosis.effects)
    if given.missing and not (diagnosis.verdict is Verdict.EXPLAINED and beside):
        return given.missing
    if not (m := diagnosis.mismatch).fit:
        return f"only {m.fixes} of its {m.believed} GPS fixes fit one model"
    if m.leaping:
        return f"its attitude leaps against the gyroscope at {m.leaps} of {m.fixes} fixes"
    if doubt_of(engine, solution):
        return "its parts contradict each other"
    if engine.trusted_s < engine.settings.minimum_s:
        return f"it has {engine.trusted_s:.0f} s of trusted GPS only"
    return ""
