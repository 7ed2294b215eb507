"""Whether a plan may be written now: every objection has a name and a sentence.

Modes: ``never`` (advise only), ``landed`` (default: disarmed for 5 s), ``in_flight`` (opt-in:
small steps, EKF healthy; landed counts too).  :func:`judge` gives *all* objections to a plan:
those of :func:`objections` to its values, which hold for whoever would set them, by a link or by
a parameter file, and those of :func:`moment` to writing now, which is also what a roll-back, or
the resumption of an interrupted transaction, has to pass.

What the estimate must show: that the specific force over the loads that were flown comes out better
with it, as probably as :attr:`PolicySettings.sure`, and that flight which the fit did not see is
likelier with it by the same odds.  What a flight does not show is not changed; then the others are
those that belong to the values left in force (:mod:`onboard.core.estimate.determined`), and if the
flight contradicts leaving them (0.999 quantile) nothing is written at all.

Temperature calibration (INS_TCALn_ENABLE = 1) corrects *before* offset and scale, towards
INS_ACCn_CALTEMP.  The estimate is made behind that correction and so belongs to the existing
CALTEMP: it can be written as long as CALTEMP is there, and is not touched.  While the
autopilot learns it (2), the correction moves, and nothing is written.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from onboard.core.estimate.limits import LEAST_CHANGE, SURE
from onboard.core.estimate.result import Calibration, Status
from onboard.core.inputs.airborne import grounded
from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.push import limits
from onboard.push.plan import GRAVITY, Change, PushPlan, offset_is_zero

ALLOWED = frozenset(name for imu in range(1, 6) for name in parameter_names(imu).six)
"""The only parameters of the autopilot that are ever written: 30 names, no IDs."""

EKF_NEEDED = 0x001 | 0x002 | 0x004 | 0x010 | 0x020
"""Attitude, both velocities, absolute horizontal and vertical position."""
EKF_FORBIDDEN = 0x080 | 0x400 | 0x8000
"""Constant position mode, not initialised, GPS glitching."""
ARMING_THRESHOLD_NAME = "ARMING_ACCTHRESH"


class Mode(Enum):
    """When parameters may be written."""

    NEVER = "never"
    LANDED = "landed"
    IN_FLIGHT = "in_flight"


PHYSICS_MISSING = "physics missing: "
"""How the sentence of that objection begins."""


class Objection(Enum):
    """Names of the reasons to refuse."""

    NEVER = "policy_never"
    HEARTBEATS = "heartbeats_contradict"
    STATE_UNKNOWN = "armed_state_unknown"
    ARMED = "armed"
    DISARMED_TOO_SHORT = "disarmed_too_short"
    IN_AIR = "in_air"
    EKF_UNHEALTHY = "ekf_unhealthy"
    STEP_TOO_LARGE = "step_too_large"
    NOT_CALIBRATED = "not_calibrated"
    PARAMETERS_UNKNOWN = "parameters_unknown"
    NOTHING_OBSERVED = "nothing_observed"
    NOT_ALLOWED = "name_not_allowed"
    OUT_OF_BOUNDS = "out_of_bounds"
    NO_WAY_BACK = "no_way_back"
    ZERO_OFFSETS = "zero_offsets"
    NOT_SURE = "not_sure"
    CONTRADICTED = "kept_value_contradicted"
    NO_IMPROVEMENT = "no_improvement"
    NOTHING_TO_CHANGE = "nothing_to_change"
    IMUS_INCONSISTENT = "imus_inconsistent"
    TEMPERATURE_LEARNING = "temperature_learning"
    TEMPERATURE_REFERENCE = "temperature_reference_unknown"
    PHYSICS_MISSING = "physics_missing"


@dataclass(frozen=True, slots=True)
class Refusal:
    """One objection and a sentence for a person."""

    objection: Objection
    sentence: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicySettings:
    """Limits; offsets in m/s^2.

    ``sure``: probability of an improvement that a push needs; ``least_change``: of the force over
    the flight, root mean square, m/s^2, that is worth a push.
    """

    mode: Mode = Mode.LANDED
    disarmed_s: float = limits.DISARMED_S
    scale_min: float = limits.SCALE_BOUNDS[0]
    scale_max: float = limits.SCALE_BOUNDS[1]
    offset_max: float = limits.OFFSET_BOUND
    sure: float = SURE
    least_change: float = LEAST_CHANGE
    in_flight_scale_step: float = limits.IN_FLIGHT_SCALE_STEP
    in_flight_offset_step: float = limits.IN_FLIGHT_OFFSET_STEP
    arming_threshold: float = limits.ARMING_THRESHOLD


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleCondition:
    """The vehicle now; None where it has not said.  ``disarmed_for`` is in seconds.

    ``contradicted``: its HEARTBEATs say armed and disarmed at the same time.
    """

    armed: bool | None = None
    disarmed_for: float = 0.0
    landed: bool | None = None
    ekf_flags: int | None = None
    contradicted: bool = False

    @property
    def may_fly(self) -> bool:
        """Whether it is in the air as far as it says; what it does not say counts as yes."""
        return not grounded(armed=self.armed, landed=self.landed)


@dataclass(frozen=True, slots=True)
class Accelerometer:
    """Another accelerometer of the vehicle: what it is, and what the autopilot believes.

    ``truth`` is its estimated calibration, ``in_force`` what it will have when the plan is
    written (its own plan's wanted values if it is to be written in the same sitting).
    """

    imu: int
    truth: SixParameters
    in_force: SixParameters


def context_names(imu: int) -> tuple[str, ...]:
    """Parameters that :func:`judge` likes to know besides the six; not every autopilot has them."""
    names = parameter_names(imu)
    return (f"{names.correction}ENABLE", names.reference, ARMING_THRESHOLD_NAME)


def ekf_healthy(flags: int | None) -> bool:
    """Whether EKF_STATUS_REPORT's flags allow a step in flight; unknown is not healthy."""
    return flags is not None and flags & EKF_NEEDED == EKF_NEEDED and not flags & EKF_FORBIDDEN


def moment(condition: VehicleCondition, settings: PolicySettings) -> tuple[Refusal, ...]:
    """Objections to writing anything now."""
    if settings.mode is Mode.NEVER:
        return (_no(Objection.NEVER, "the push policy is 'never': values are proposed only"),)
    if condition.contradicted:
        sentence = "heartbeats say armed and disarmed at the same time: two are speaking"
        return (_no(Objection.HEARTBEATS, sentence),)
    if condition.armed is None:
        return (_no(Objection.STATE_UNKNOWN, "the autopilot has not said whether it is armed"),)
    if not condition.armed:
        found = []
        if condition.disarmed_for < settings.disarmed_s:
            sentence = (
                f"disarmed for {condition.disarmed_for:.1f} s, {settings.disarmed_s:g} s needed"
            )
            found.append(_no(Objection.DISARMED_TOO_SHORT, sentence))
        if condition.landed is False:
            found.append(_no(Objection.IN_AIR, "disarmed, but the autopilot says it is in the air"))
        return tuple(found)
    if settings.mode is Mode.LANDED:
        return (_no(Objection.ARMED, "armed, and the push policy is 'landed'"),)
    if not ekf_healthy(condition.ekf_flags):
        return (_no(Objection.EKF_UNHEALTHY, "in flight, and the EKF is not known to be healthy"),)
    return ()


def judge(
    plan: PushPlan,
    calibration: Calibration,
    condition: VehicleCondition,
    settings: PolicySettings,
    *,
    values: Mapping[str, float] | None = None,
    others: Sequence[Accelerometer] = (),
) -> tuple[Refusal, ...]:
    """Every objection to writing this plan now; empty means that it may be written.

    Args:
        plan: from :func:`onboard.push.plan.propose` with this calibration.
        calibration: the estimate that the plan was made from.
        condition: the vehicle now.
        settings: limits and mode.
        values: the autopilot's parameters by name, for :func:`context_names`.
        others: the vehicle's other accelerometers, where their calibration is known.
    """
    found = list(moment(condition, settings))
    if condition.armed and settings.mode is Mode.IN_FLIGHT:
        found += _steps(plan, settings)
    if plan.no_way_back:
        sentence = f"there would be no way back: in force is {plan.no_way_back}"
        found.append(_no(Objection.NO_WAY_BACK, sentence))
    return (*found, *objections(plan, calibration, settings, values=values, others=others))


def objections(
    plan: PushPlan,
    calibration: Calibration,
    settings: PolicySettings,
    *,
    values: Mapping[str, float] | None = None,
    others: Sequence[Accelerometer] = (),
    missing: str = "",
) -> tuple[Refusal, ...]:
    """Every objection to the values of a plan, whenever and by whomever they would be set.

    Args:
        plan: from :func:`onboard.push.plan.propose` with this calibration.
        calibration: the estimate that the plan was made from.
        settings: limits.
        values: the autopilot's parameters by name, for :func:`context_names`.
        others: the vehicle's other accelerometers, where their calibration is known.
        missing: physics that the autopilot lacks and that forbids it, in words
            (:attr:`onboard.answers.answer.Answer.missing`).
    """
    found: list[Refusal] = []
    if missing:
        found.append(_no(Objection.PHYSICS_MISSING, f"{PHYSICS_MISSING}{missing}"))
    elif plan.contradiction > plan.contradiction_limit:
        kept = ", ".join(c.name for c in plan.changes if c.kept)
        sentence = f"the flight does not fit {kept} as in force, nor shows what it should be"
        found.append(_no(Objection.CONTRADICTED, sentence))
    found += _estimate(plan, calibration, settings)
    for change in plan.changes:
        found += _number(change, settings)
    if offset_is_zero(plan.six_wanted().offset):
        sentence = "all three offsets would be zero, which ArduPilot takes for 'not calibrated'"
        found.append(_no(Objection.ZERO_OFFSETS, sentence))
    found += _temperature(plan.imu, values or {})
    found += consistency(plan, settings, values=values, others=others)
    return tuple(found)


def consistency(
    plan: PushPlan,
    settings: PolicySettings,
    *,
    values: Mapping[str, float] | None = None,
    others: Sequence[Accelerometer] = (),
) -> tuple[Refusal, ...]:
    """Those of :func:`objections` that are about the other accelerometers."""
    threshold = (values or {}).get(ARMING_THRESHOLD_NAME, settings.arming_threshold)
    return tuple(r for other in others for r in _consistency(plan, other, threshold))


def _estimate(plan: PushPlan, calibration: Calibration, settings: PolicySettings) -> list[Refusal]:
    found = []
    if calibration.status is not Status.CALIBRATED:
        sentence = f"the calibration is '{calibration.status.value}'"
        found.append(_no(Objection.NOT_CALIBRATED, sentence))
    if not calibration.parameters_known:
        sentence = (
            "it is not known which parameters were in force during the flight, "
            "nor what the sensor read"
        )
        found.append(_no(Objection.PARAMETERS_UNKNOWN, sentence))
    if all(c.kept for c in plan.changes):
        found.append(_no(Objection.NOTHING_OBSERVED, "the flight shows none of the six numbers"))
    elif plan.worth is None or plan.worth.change < settings.least_change:
        sentence = (
            f"what would change is less than {settings.least_change:g} m/s^2 over this flight"
        )
        found.append(_no(Objection.NOTHING_TO_CHANGE, sentence))
    elif not plan.worth.probability >= settings.sure:
        sentence = (
            f"the new values are better with a probability of {plan.worth.probability:.3f}; "
            f"{settings.sure:g} is needed"
        )
        found.append(_no(Objection.NOT_SURE, sentence))
    return found + _held_out(plan, calibration, settings)


def _held_out(plan: PushPlan, calibration: Calibration, settings: PolicySettings) -> list[Refusal]:
    """What flight that the fit has not seen says against it: odds, as sure as the rest."""
    before, after = plan.baseline.held_out_before, plan.baseline.held_out_after
    if before is None or after is None or not math.isfinite(calibration.predictive_gain):
        return [_no(Objection.NO_IMPROVEMENT, "there is no held-out residual to judge by")]
    if calibration.predictive_gain >= -math.log(1.0 - settings.sure):
        return []
    sentence = f"the held-out residual would go from {before:.3g} to {after:.3g} only"
    return [_no(Objection.NO_IMPROVEMENT, sentence)]


def _number(change: Change, settings: PolicySettings) -> list[Refusal]:
    if change.name not in ALLOWED:
        return [_no(Objection.NOT_ALLOWED, f"{change.name} is not on the list of what is written")]
    if change.kept:
        return []
    if "SCAL" in change.name:
        low, high = settings.scale_min, settings.scale_max
    else:
        low, high = -settings.offset_max, settings.offset_max
    if not change.differs or low <= change.wanted <= high:
        return []
    sentence = f"{change.name} = {change.wanted:.5g} is outside {low:g} ... {high:g}"
    return [_no(Objection.OUT_OF_BOUNDS, sentence)]


def _steps(plan: PushPlan, settings: PolicySettings) -> list[Refusal]:
    found = []
    for change in plan.changes:
        scale = "SCAL" in change.name
        limit = settings.in_flight_scale_step if scale else settings.in_flight_offset_step
        if abs(change.wanted - change.before) > limit:
            sentence = (
                f"{change.name} would step by {change.wanted - change.before:+.3g} in flight, "
                f"{limit:g} allowed: land first"
            )
            found.append(_no(Objection.STEP_TOO_LARGE, sentence))
    return found


def _temperature(imu: int, values: Mapping[str, float]) -> list[Refusal]:
    enable, caltemp, _ = context_names(imu)
    mode = values.get(enable, 0.0)
    if mode == 2:
        sentence = f"{enable} = 2: the autopilot is learning its temperature calibration"
        return [_no(Objection.TEMPERATURE_LEARNING, sentence)]
    if mode == 1 and values.get(caltemp, -300.0) <= -200.0:
        sentence = f"{enable} = 1, but {caltemp}, the temperature the offsets are for, is not set"
        return [_no(Objection.TEMPERATURE_REFERENCE, sentence)]
    return []


def _consistency(plan: PushPlan, other: Accelerometer, threshold: float) -> list[Refusal]:
    """ArduPilot's arming check, for either of the two being the primary accelerometer.

    AP_InertialSensor::accels_consistent: length of the difference, z counted half, three
    times the threshold for the third and later.  Taken over the six directions that
    gravity can have in the sensor, since the mounting is not known here.
    """
    limit = threshold * (3.0 if max(plan.imu, other.imu) >= 3 else 1.0)
    after = _largest_difference(plan.six_wanted(), other)
    before = _largest_difference(plan.six_before(), other, truth=plan.six_wanted())
    if after <= limit or after <= before:
        return []
    sentence = (
        f"at rest IMU {plan.imu} would then differ from IMU {other.imu} by {after:.2f} m/s^2; "
        f"arming allows {limit:g}: calibrate both"
    )
    return [_no(Objection.IMUS_INCONSISTENT, sentence)]


def _largest_difference(
    own: SixParameters, other: Accelerometer, truth: SixParameters | None = None
) -> float:
    largest = 0.0
    for axis in range(3):
        for sign in (1.0, -1.0):
            f_s = np.zeros(3)
            f_s[axis] = sign * GRAVITY
            seen = own.apply((truth or own).undo(f_s))
            difference = seen - other.in_force.apply(other.truth.undo(f_s))
            difference[2] *= 0.5
            largest = max(largest, float(np.linalg.norm(difference)))
    return largest


def _no(objection: Objection, sentence: str) -> Refusal:
    return Refusal(objection, sentence)
