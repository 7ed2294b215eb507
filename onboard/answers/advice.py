"""What of an answer may be set, and why not the rest: the policy asked for files and words.

The daemon asks the policy of a plan before it writes; whoever reads a recording and sets what it
says does the same by hand.  So the same :func:`onboard.push.policy.objections` decide here, on a
plan made with the parameters in force in the recording.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from onboard.answers import cures
from onboard.answers.answer import Answer
from onboard.answers.conditions import conditions
from onboard.core.estimate.result import Calibration, Status
from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.core.physics.finding import Finding
from onboard.errors import PushError
from onboard.push.plan import PushPlan, propose
from onboard.push.policy import Accelerometer, Objection, PolicySettings, Refusal, objections


@dataclass(frozen=True, slots=True)
class Advice:
    """What may be set of one accelerometer's answer.

    Attributes:
        plan: the six as they would be set; None where the numbers make none.
        refusals: every objection to its values; it may be set if there is none.
        conditions: where a number holds only under a condition, in words, by parameter.
        against: why the parameters of an effect should not be set, by effect; those that are
            not in it may be.
        names: of the effects' parameters as this autopilot has them, where they differ.
    """

    plan: PushPlan | None
    refusals: tuple[Refusal, ...]
    conditions: Mapping[str, str]
    against: Mapping[str, str]
    names: Mapping[str, str]

    @property
    def settable(self) -> bool:
        """Whether the six may be set."""
        return self.plan is not None and not self.refusals

    @property
    def reasons(self) -> tuple[str, ...]:
        """Sentences against setting the six, one of each kind: the first says enough."""
        first: dict[Objection, str] = {}
        for refusal in self.refusals:
            first.setdefault(refusal.objection, refusal.sentence)
        return tuple(first.values())

    def to_set(self, effects: Sequence[Finding] = ()) -> dict[str, float]:
        """Every parameter that may be set: the six that are seen, and the cures of ``effects``."""
        six = {}
        if self.plan is not None and self.settable:
            six = {c.name: c.wanted for c in self.plan.changes if not c.kept}
        cures = {
            self.names.get(name, name): value
            for e in effects
            if e.name not in self.against
            for name, value in e.parameters.items()
            if math.isfinite(value)
        }
        return cures | six


def advise(
    answers: Sequence[Answer],
    parameters: Mapping[str, float],
    settings: PolicySettings | None = None,
) -> tuple[Advice, ...]:
    """Advice for the accelerometers of one vehicle, in the order of their answers.

    Args:
        answers: one for each accelerometer.
        parameters: the autopilot's, as the recording has them.
        settings: the policy's limits, else those that a service has by default.
    """
    settings = settings or PolicySettings()
    plans = {a.imu: _plan(a.calibration, parameters) for a in answers}
    alone = {
        a.imu: () if plan is None else _objections(a, plan, parameters, settings, ())
        for a in answers
        for plan in (plans[a.imu],)
    }
    out = []
    for a in answers:
        plan = plans[a.imu]
        others = [
            Accelerometer(
                other.imu,
                SixParameters(other.calibration.scale, other.calibration.offset),
                # Those that nothing is against are set in the same sitting.
                its.six_before() if alone[other.imu] else its.six_wanted(),
            )
            for other in answers
            if other is not a and (its := plans[other.imu]) is not None
            if other.calibration.status is Status.CALIBRATED
        ]
        refusals = (
            (Refusal(Objection.NOT_CALIBRATED, "there is no usable estimate"),)
            if plan is None
            else _objections(a, plan, parameters, settings, others)
        )
        against = {
            e.name: why
            for e in a.diagnosis.effects
            if e.parameters and (why := cures.against(e, a.diagnosis, parameters, settings.sure))
        }
        names = cures.former_names(parameters)
        out.append(Advice(plan, refusals, conditions(a.diagnosis, parameters), against, names))
    return tuple(out)


def _plan(calibration: Calibration, parameters: Mapping[str, float]) -> PushPlan | None:
    names = parameter_names(calibration.imu)
    in_force = calibration.in_force_scale + calibration.in_force_offset
    current = dict(zip(names.six, in_force, strict=True))
    current[names.device_id] = parameters.get(names.device_id, 0.0)
    try:
        return propose(calibration, current, system_id=1)
    except PushError:
        return None


def _objections(
    given: Answer,
    plan: PushPlan,
    parameters: Mapping[str, float],
    settings: PolicySettings,
    others: Sequence[Accelerometer],
) -> tuple[Refusal, ...]:
    return objections(
        plan,
        given.calibration,
        settings,
        values=parameters,
        others=others,
        missing=given.missing,
    )
