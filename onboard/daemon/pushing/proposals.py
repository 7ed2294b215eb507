"""Proposals: what would be written for each accelerometer, and every reason why it is not yet.

The policy's reasons come from :mod:`onboard.push.policy`; added here are those of the diagnosis
(:mod:`onboard.push.diagnosed`), of people (approval, refusal), of past failures, and of what kind
of autopilot it is.

What is proposed is what was diagnosed.  Where physics was missing, or nobody could look for it, a
person may have it written all the same, but has to say so: naming the accelerometer and with
``despite_diagnosis``.  That holds for this diagnosis only.

What was learned belongs to a board and to the values in force
(:mod:`onboard.daemon.learning.flight`).  A proposal that no flight since the start has confirmed,
or whose values somebody has changed since, is *unconfirmed*: it waits for the next flight, or for a
person who has read why it waits.  An approval is for the values that were shown, old and new: those
are written, or none.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

from onboard.core.estimate.result import Calibration, Status
from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.daemon.learning.flight import JudgedFlight
from onboard.daemon.learning.learned import Learned
from onboard.daemon.pushing import limits
from onboard.daemon.pushing.people import DIAGNOSIS, approvable, named, told
from onboard.errors import PushError, RefusedError
from onboard.push.diagnosed import Diagnosed
from onboard.push.plan import PushPlan, as_known_now, propose
from onboard.push.policy import (
    Accelerometer,
    Mode,
    PolicySettings,
    VehicleCondition,
    consistency,
    judge,
)

NOT_DIAGNOSED = object()
"""Stands for the diagnosis that there is not."""


@dataclass(slots=True)
class Standing:
    """Where one accelerometer stands with people and with past failures.

    ``despite`` is the diagnosis in spite of which it was approved; ``written`` the six as they
    were after the last transaction, by our own doing.
    """

    approved: PushPlan | None = None
    despite: object = None
    refused: str = ""
    failures: int = 0
    not_before: float = 0.0
    written: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Proposal:
    """A plan and every reason, by name, why it is not written now, with a sentence each."""

    plan: PushPlan
    held_back: Mapping[str, str] = field(default_factory=dict)


class Refusals(Protocol):
    """Where refusals outlive the service."""

    def refusals(self) -> Mapping[int, str]:
        """What is refused, by accelerometer, and why."""

    def refused(self, imu: int, why: str) -> None:
        """A refusal begins, or ends (then with nothing to say)."""

    @property
    def trouble(self) -> str:
        """Why nothing is remembered at all, and so nothing may be written; empty: it is."""


class Proposals:
    """The current proposals and what people said about them.

    Args:
        settings: of the policy.
        approval: whether a person has to approve each push.
        imus: the accelerometers that may be written; empty for all.
        refusals: where refusals are remembered; None: nowhere.
    """

    def __init__(
        self,
        settings: PolicySettings,
        *,
        approval: bool,
        imus: tuple[int, ...] = (),
        refusals: Refusals | None = None,
    ) -> None:
        self.settings = settings
        self.approval = approval
        self.forbidden = ""
        self.doubt = ""
        """Why what was learned since the start is not to be believed, until it is reset."""
        self.current: dict[int, Proposal] = {}
        self.impossible: dict[int, str] = {}
        """Why nothing can be proposed for an accelerometer that has an answer."""
        self.counters: Counter[str] = Counter()
        self.writing: int | None = None
        """Accelerometer of the transaction under way: its values change by our own doing."""
        self._imus = imus
        self._standing: dict[int, Standing] = {}
        self._plans: dict[int, tuple[tuple[object, ...], PushPlan]] = {}
        self._refusals = refusals
        self.recall()
        self._flight: JudgedFlight | None = None
        self._parameters: Mapping[str, float] = {}

    def recall(self) -> None:
        """Take up what was refused before, as far as it is remembered."""
        for imu, why in (self._refusals.refusals() if self._refusals is not None else {}).items():
            self.standing(imu).refused = why

    def update(
        self,
        now: float,
        *,
        system_id: int,
        learned: Learned,
        parameters: Mapping[str, float],
        condition: VehicleCondition,
        board: str = "",
    ) -> None:
        """Make them anew from what was learned and the autopilot's values of this moment."""
        self._flight, self._parameters = learned.flight, parameters
        calibrations = learned.calibrations
        plans: dict[int, PushPlan] = {}
        self.impossible.clear()
        for imu, calibration in calibrations.items():
            try:
                known = self._plan(calibration, parameters, system_id, board)
                plans[imu] = self._to_write(known, calibration)
            except PushError as error:
                self.counters["not_proposed"] += 1
                self.impossible[imu] = str(error)
        held = {}
        for imu, plan in plans.items():
            held[imu] = self._beyond_policy(imu, now)
            # Its end is a batch away from a vehicle that has landed, or more on a slow companion.
            ended = learned.flying and condition.armed is False
            held[imu] |= self._physics(imu, diagnosing=bool(learned.diagnosing) or ended)
            found = judge(plan, calibrations[imu], condition, self.settings, values=parameters)
            for refusal in found:  # several of one name (six sigmas): the first says enough
                held[imu].setdefault(refusal.objection.value, refusal.sentence)
        self.current = {}
        for imu, plan in plans.items():
            others = [
                Accelerometer(
                    other,
                    SixParameters(calibrations[other].scale, calibrations[other].offset),
                    # Written in the same sitting is what nothing holds back that does not hold
                    # this one back as well.
                    its.six_wanted()
                    if held[other].keys() <= held[imu].keys()
                    else its.six_before(),
                )
                for other, its in plans.items()
                if other != imu and calibrations[other].status is Status.CALIBRATED
            ]
            held_back = dict(held[imu])
            for refusal in consistency(plan, self.settings, values=parameters, others=others):
                held_back.setdefault(refusal.objection.value, refusal.sentence)
            self.current[imu] = Proposal(plan, told(imu, held_back))

    def _to_write(self, known: PushPlan, calibration: Calibration) -> PushPlan:
        """What a person approved, as long as that is for what is there and known; else ``known``.

        It is judged as it would be written: what is known has moved a little since.  Values that
        change because they are being written are no reason to ask anew: it may have to be repeated.
        """
        standing = self.standing(known.imu)
        ours = known.imu == self.writing
        if standing.approved is not None and not ours and _lapsed(standing.approved, known):
            standing.approved = standing.despite = None
            self.counters["approvals_lapsed"] += 1
        if standing.approved is None:
            return known
        return as_known_now(standing.approved, known, calibration)

    def _plan(
        self, calibration: Calibration, parameters: Mapping[str, float], system_id: int, board: str
    ) -> PushPlan:
        """The plan, as it was a second ago if nothing that it is made of has changed."""
        names = parameter_names(calibration.imu)
        told = tuple(parameters.get(name) for name in (*names.six, names.device_id))
        asked = (calibration, told, system_id, board, self.settings)
        before = self._plans.get(calibration.imu)
        if before is not None and before[0] == asked:
            return before[1]
        plan = propose(
            calibration,
            parameters,
            system_id=system_id,
            board=board,
            scale_bounds=(self.settings.scale_min, self.settings.scale_max),
            offset_bound=self.settings.offset_max,
        )
        self._plans[calibration.imu] = asked, plan
        return plan

    def ready(self) -> PushPlan | None:
        """The first plan that nothing holds back."""
        return next((p.plan for p in self.current.values() if not p.held_back), None)

    def approve(self, imus: Sequence[int], *, despite_diagnosis: bool = False) -> str:
        """A person allows what is proposed now (no number: all that wait for one).

        Args:
            imus: which accelerometers.
            despite_diagnosis: those, too, that the diagnosis holds back; they must be named.

        Raises:
            RefusedError: nothing waits for a person, or only the diagnosis is against it and
                that was not said.
        """
        chosen = {i: self.current[i].held_back for i in imus or self.current if i in self.current}
        against = {i: held.keys() & DIAGNOSIS for i, held in chosen.items()}
        if despite_diagnosis and not imus:
            raise RefusedError("despite a diagnosis, accelerometers are approved by their number")
        waiting = [
            imu
            for imu, held in chosen.items()
            if approvable(held) and (despite_diagnosis or not against[imu])
        ]
        if not waiting:
            for imu, names in against.items():
                if names and approvable(chosen[imu]):
                    why = chosen[imu][min(names)]
                    raise RefusedError(
                        f"IMU {imu}: {why}; `onboard approve {imu} --despite-diagnosis` "
                        "writes it all the same"
                    )
            raise RefusedError("nothing waits for approval")
        for imu in waiting:
            despite = (self._diagnosed(imu) or NOT_DIAGNOSED) if against[imu] else None
            self._lift(imu)
            written = self.standing(imu).written
            self._standing[imu] = Standing(self.current[imu].plan, despite, written=written)
        self.counters["approvals"] += len(waiting)
        when = "written as soon as policy and flight state allow"
        if self.settings.mode is Mode.NEVER:
            when = "not written, for the push policy is 'never'"
        return f"{named(waiting)} approved: {when}"

    def reject(self, imus: Sequence[int]) -> str:
        """A person refuses, until it is approved or what was learned is reset.

        Raises:
            RefusedError: nothing is proposed.
        """
        chosen = [imu for imu in imus or self.current if imu in self.current]
        if not chosen:
            raise RefusedError("nothing is proposed")
        for imu in chosen:
            self.refuse(imu, "a person rejected it")
        self.counters["rejections"] += len(chosen)
        return f"{named(chosen)} rejected"

    def refuse(self, imu: int, why: str) -> None:
        """Hold this accelerometer back until a person approves."""
        standing = self.standing(imu)
        standing.approved = None
        if standing.refused != why:
            standing.refused = why
            if self._refusals is not None:
                self._refusals.refused(imu, why)
        self._hold(imu, "refused", why)

    def succeeded(self, imu: int, values: Sequence[float]) -> None:
        """A transaction completed: its approval is used up; ``values`` are the six now."""
        standing = self.standing(imu)
        standing.approved = None
        standing.failures = 0
        standing.written = tuple(values)
        self._hold(imu, "nothing_to_change", "the autopilot has these values")

    def failed(self, imu: int, now: float, *, changed_by_other: bool = False) -> None:
        """A transaction did not complete: wait, the longer the oftener.

        An approval outlives that, unless somebody else has changed what it was given for.
        """
        standing = self.standing(imu)
        if changed_by_other:
            standing.approved = standing.despite = None
        wait = limits.WAIT_AFTER_FAILURE_S[
            min(standing.failures, len(limits.WAIT_AFTER_FAILURE_S) - 1)
        ]
        standing.failures += 1
        standing.not_before = now + wait
        self._hold(imu, "failed_before", f"the last try failed: the next one in {wait:.0f} s")

    def _hold(self, imu: int, name: str, why: str) -> None:
        """What is told of a proposal says so at once, and not with the next look at it."""
        if imu in self.current:
            held_back = {**self.current[imu].held_back, name: why}
            self.current[imu] = replace(self.current[imu], held_back=held_back)

    def standing(self, imu: int) -> Standing:
        """What is remembered of one accelerometer."""
        return self._standing.setdefault(imu, Standing())

    def forget(self) -> None:
        """What was learned is reset: what was said about it means nothing any more."""
        for imu in self._standing:
            self._lift(imu)
        self._standing.clear()
        self.doubt = ""
        self.current = {}

    def _lift(self, imu: int) -> None:
        """It is refused no longer."""
        if self.standing(imu).refused:
            self.standing(imu).refused = ""
            if self._refusals is not None:
                self._refusals.refused(imu, "")

    def _physics(self, imu: int, *, diagnosing: bool) -> dict[str, str]:
        """What the diagnosis says against it, unless a person has approved in spite of it."""
        if diagnosing:  # none before all of them are
            return {"diagnosing": "the flight is being diagnosed"}
        found = self._diagnosed(imu)
        standing = self.standing(imu)
        if standing.approved is not None and standing.despite is (found or NOT_DIAGNOSED):
            return {}
        if found is None:
            return {"not_diagnosed": "no flight was diagnosed yet: that is done after a landing"}
        if found.died and not found.missing:
            return {"imu_stuck": found.died}
        if not found.missing:
            return {}
        offered = "; these values have it modelled" if found.modelled else ""
        return {"physics_missing": f"physics missing: {found.missing}{offered}"}

    def _diagnosed(self, imu: int) -> Diagnosed | None:
        return None if self._flight is None else self._flight.diagnosed.get(imu)

    def _unconfirmed(self, imu: int) -> str:
        """Why it takes another flight, or a person, to believe that this is of what is there."""
        flight = self._flight
        if flight is None or imu not in flight.imus or imu == self.writing:
            return ""  # not diagnosed, which is said, or in our own hands
        if not flight.current:
            return (
                "it was learned before the service or the autopilot last started, and no flight "
                "has confirmed it since"
            )
        changed = flight.imus[imu].changed_since(self._parameters, imu, self.standing(imu).written)
        return f"somebody has changed {changed} since the flight began" if changed else ""

    def _beyond_policy(self, imu: int, now: float) -> dict[str, str]:
        standing = self.standing(imu)
        found: dict[str, str] = {}
        if self.forbidden:
            found["advise_only"] = self.forbidden
        if self._refusals is not None and self._refusals.trouble:
            found["no_journal"] = self._refusals.trouble
        if self.doubt:
            found["doubtful"] = self.doubt
        if self._imus and imu not in self._imus:
            found["not_selected"] = f"IMU {imu} is not among [push] imus"
        if standing.refused:
            found["refused"] = standing.refused
        if now < standing.not_before:
            wait = standing.not_before - now
            found["failed_before"] = f"the last try failed: the next one in {wait:.0f} s"
        unconfirmed = self._unconfirmed(imu)
        if unconfirmed and standing.approved is None:
            found["unconfirmed"] = unconfirmed
        if self.approval and standing.approved is None:
            found["approval"] = "a person has to approve"
        return found


def _lapsed(approved: PushPlan, plan: PushPlan) -> bool:
    """Whether what was approved is no longer what is there, or what is known."""
    there = plan.vehicle
    if not approved.vehicle.same_airframe(there.system_id, there.board):
        return True
    return any(
        now.before != then.before
        or (
            abs(now.wanted - then.wanted) > limits.MOVED_SIGMAS * max(now.sigma, then.sigma)
            and not (then.kept and now.kept)
        )
        for then, now in zip(approved.changes, plan.changes, strict=True)
    )
