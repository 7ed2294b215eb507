"""What would be written: a calibration and the autopilot's current values make a plan.

Estimates are absolute (raw units), so the wanted parameter simply *is* the estimate, as
float32; what the flight did not show stays at the value in force, and the rest is what belongs to
it (:mod:`onboard.core.estimate.determined`).

**Order of the writes.**  PARAM_SET takes effect on the next sample and there is no atomic
group, so between the writes the autopilot flies on a mixture.  Three choices make each
mixture harmless:

* Scale and offset of one axis follow each other at once: never more than one axis is mixed.
* Within an axis, of the two possible mixtures (old scale, new offset) and (new scale, old
  offset) the one is passed that errs less against the wanted calibration.  With
  ``f = s (raw - o)`` the first errs by ``|s0 / s1 - 1| g`` when that axis carries gravity,
  the second by ``|s1 (o1 - o0)|``.  Usually one of them is smaller than the error that is
  being corrected; where scale and offset cancel each other (a hover calibration), neither
  is, and the smaller one is the best to be had.
* The axis with the largest target offset comes first.  Proof that the offset vector is then
  never exactly zero in between (ArduPilot takes that for "never calibrated"): until that
  axis is written the vector is the starting one, not zero; from then on it holds a non-zero
  element.  The same order and proof hold for a roll-back, and from any mixture.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self, cast

from onboard.core.estimate.determined import Determined, Improvement, determine, improvement
from onboard.core.estimate.result import Calibration, Six
from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.core.maths.arrays import Vector3
from onboard.errors import PushError
from onboard.mavlink.parameter_messages import to_float32
from onboard.push import limits

GRAVITY = 9.80665


@dataclass(frozen=True, slots=True)
class Vehicle:
    """Whom a plan is for; ``device_id`` is the accelerometer's INS_ACC_ID as PARAM_VALUE has it.

    ``board`` is the autopilot's unique id in hex (AUTOPILOT_VERSION), empty if not known.
    """

    system_id: int
    device_id: float
    board: str = ""

    def same_airframe(self, system_id: int, board: str = "") -> bool:
        """Whether a link to this system and board can be this vehicle.

        Where both tell the board it is that, whatever system id somebody has given it; else the
        system id decides.
        """
        if self.board and board:
            return self.board == board
        return self.system_id == system_id


@dataclass(frozen=True, slots=True)
class Change:
    """One parameter: value in force, value wanted (both float32), bounds, sigma.

    ``kept``: the flight does not show this number, it stays as it is.  ``sigma`` is by how much
    another flight like this one would want it otherwise.
    """

    name: str
    before: float
    wanted: float
    low: float
    high: float
    sigma: float
    kept: bool = False

    @property
    def differs(self) -> bool:
        """Whether there is anything to write."""
        return self.before != self.wanted


@dataclass(frozen=True, slots=True)
class Worth:
    """What a plan is worth over the loads that were flown.

    Attributes:
        change: of the specific force by the plan, root mean square, m/s^2.
        error_before: expected error of the force with the values in force, likewise.
        error_after: the same with the plan's.
        probability: that the error becomes smaller.
        directions: how many of six directions the flight determines.
    """

    change: float
    error_before: float
    error_after: float
    probability: float
    directions: int

    @classmethod
    def of(cls, found: Determined | Improvement, directions: int) -> Self:
        """What the estimator says of it."""
        return cls(
            found.change, found.error_before, found.error_after, found.probability, directions
        )


@dataclass(frozen=True, slots=True)
class Baseline:
    """Residuals at the time of the plan, for judging it later; None where not known.

    Whitened RMS on held-out segments with the parameters in force and with the estimate,
    and velocity RMS (m/s) likewise.
    """

    held_out_before: float | None
    held_out_after: float | None
    velocity_rms_before: float | None
    velocity_rms_after: float | None = None

    @classmethod
    def of(cls, calibration: Calibration) -> Self:
        """What the calibration that a plan is made from says; not finite is not known."""
        return cls(
            _finite(calibration.held_out_before),
            _finite(calibration.held_out_after),
            _finite(calibration.velocity_rms_before),
            _finite(calibration.velocity_rms_after),
        )


@dataclass(frozen=True, slots=True)
class PushPlan:
    """Six parameters of one accelerometer, order of ``parameter_names(imu).six``.

    Cannot exist with other names, or with values that are not finite float32s.

    Raises:
        PushError: the changes are not those six, or not float32.
    """

    vehicle: Vehicle
    imu: int
    changes: tuple[Change, ...]
    baseline: Baseline
    worth: Worth | None = None
    contradiction: float = 0.0
    contradiction_limit: float = 0.0

    def __post_init__(self) -> None:
        try:
            names = parameter_names(self.imu)
        except ValueError as error:
            raise PushError(str(error)) from None
        if tuple(c.name for c in self.changes) != names.six:
            raise PushError(f"a plan for IMU {self.imu} holds exactly {', '.join(names.six)}")
        for c in self.changes:
            for value in (c.before, c.wanted):
                if not math.isfinite(value) or to_float32(value) != value:
                    raise PushError(f"{c.name}: {value} is not a float32")

    @property
    def names(self) -> tuple[str, ...]:
        """The six names."""
        return tuple(c.name for c in self.changes)

    @property
    def device_id_name(self) -> str:
        """Parameter that identifies the accelerometer; read, never written."""
        return parameter_names(self.imu).device_id

    @property
    def before(self) -> dict[str, float]:
        """Value in force by name."""
        return {c.name: c.before for c in self.changes}

    @property
    def wanted(self) -> dict[str, float]:
        """Wanted value by name."""
        return {c.name: c.wanted for c in self.changes}

    def six_before(self) -> SixParameters:
        """Scale and offset in force."""
        return _six([c.before for c in self.changes])

    def six_wanted(self) -> SixParameters:
        """Scale and offset wanted."""
        return _six([c.wanted for c in self.changes])

    @property
    def no_way_back(self) -> str:
        """Why the values of before are never written, in words; empty: they may be.

        A value in force may be anybody's mistake, or read with an error.  What no calibration can
        have made is not written back, and so nothing may be written in its place either.
        """
        for c in self.changes:
            if c.differs and not _may_have_been(c):
                return f"{c.name} = {c.before:.5g}, which no calibration can have made"
        return ""

    def reversed(self) -> PushPlan:
        """The plan that takes this one back: written like any other plan."""
        changes = tuple(
            Change(c.name, c.wanted, c.before, c.low, c.high, c.sigma, c.kept) for c in self.changes
        )
        return PushPlan(self.vehicle, self.imu, changes, self.baseline)

    def write_order(self, current: Mapping[str, float], *, undo: bool = False) -> tuple[str, ...]:
        """Names to write, in a safe order, to get from ``current`` to wanted (undo: before)."""
        target = self.before if undo else self.wanted
        names = parameter_names(self.imu)
        axes = sorted(range(3), key=lambda i: -abs(target[names.offset[i]]))
        order: list[str] = []
        for i in axes:
            scale, offset = self.changes[i], self.changes[3 + i]
            # A scale of zero, which ArduPilot takes for none, may have been there.
            ratio = scale.before / scale.wanted if scale.wanted else math.inf
            errs_old_scale = abs(ratio - 1.0) * GRAVITY
            errs_old_offset = abs(scale.wanted * (offset.wanted - offset.before))
            through_old_scale = errs_old_scale <= errs_old_offset
            offset_first = through_old_scale != undo
            pair = (offset.name, scale.name) if offset_first else (scale.name, offset.name)
            order += [name for name in pair if current[name] != target[name]]
        return tuple(order)


def propose(
    calibration: Calibration,
    current: Mapping[str, float],
    *,
    system_id: int,
    board: str = "",
    scale_bounds: tuple[float, float] = limits.SCALE_BOUNDS,
    offset_bound: float = limits.OFFSET_BOUND,
) -> PushPlan:
    """Plan for one accelerometer; ``current`` holds the autopilot's values by name.

    Whether it may be written is :func:`onboard.push.policy.judge`'s to say.

    Raises:
        PushError: a current value is missing or not finite, or the calibration is no usable
            estimate (not finite, covariance not positive definite).
    """
    names = parameter_names(calibration.imu)
    missing = [n for n in (*names.six, names.device_id) if n not in current]
    if missing:
        raise PushError(f"the autopilot has not told {', '.join(missing)}")
    try:
        before = [to_float32(current[n]) for n in names.six]
        found = determine(calibration, before)
        wanted = [to_float32(v) for v in found.six.scale + found.six.offset]
    except ValueError as error:
        raise PushError(f"IMU {calibration.imu}: {error}") from None
    changes = []
    for i, name in enumerate(names.six):
        low, high = scale_bounds if i < 3 else (-offset_bound, offset_bound)
        stays = not found.free[i] or abs(wanted[i] - before[i]) < limits.UNCHANGED
        changes.append(
            Change(
                name=name,
                before=before[i],
                wanted=before[i] if stays else wanted[i],
                low=low,
                high=high,
                sigma=found.sigma[i],
                kept=not found.free[i],
            )
        )
    return PushPlan(
        vehicle=Vehicle(system_id, current[names.device_id], board),
        imu=calibration.imu,
        changes=tuple(changes),
        baseline=Baseline.of(calibration),
        worth=Worth.of(found, found.directions),
        contradiction=found.contradiction,
        contradiction_limit=found.contradiction_limit,
    )


def as_known_now(earlier: PushPlan, known: PushPlan, calibration: Calibration) -> PushPlan:
    """An earlier plan, its values as they are, with what they are worth by what is known now.

    Args:
        earlier: of the same accelerometer with the same values in force.
        known: the plan that would be made now.
        calibration: what that is made from.

    Raises:
        PushError: the calibration is no usable estimate.
    """
    try:
        found = improvement(calibration, list(known.before.values()), list(earlier.wanted.values()))
    except ValueError as error:
        raise PushError(f"IMU {calibration.imu}: {error}") from None
    directions = 0 if known.worth is None else known.worth.directions
    return replace(
        earlier,
        baseline=known.baseline,
        worth=Worth.of(found, directions),
        contradiction=known.contradiction,
        contradiction_limit=known.contradiction_limit,
    )


def offset_is_zero(offset: tuple[float, ...]) -> bool:
    """Whether ArduPilot may take this offset vector for "never calibrated"."""
    return all(abs(o) < limits.UNCHANGED for o in offset)


def _may_have_been(change: Change) -> bool:
    """Whether a value in force may be one that was calibrated, or a default."""
    if "SCAL" not in change.name:
        return abs(change.before) <= limits.BACK_OFFSET_BOUND
    low, high = limits.SCALE_BOUNDS
    return change.before == 0.0 or low <= change.before <= high


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _six(values: list[float]) -> SixParameters:
    six = cast("Six", tuple(values))
    scale: Vector3 = six[:3]
    offset: Vector3 = six[3:]
    return SixParameters(scale, offset)
