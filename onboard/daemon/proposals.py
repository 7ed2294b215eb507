"""Proposals: what would be written for each accelerometer, and every reason why it is not yet.

The policy's reasons come from :mod:`onboard.push.policy`; added here are those of people
(approval, refusal), of past failures, and of what kind of autopilot it is.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from onboard.core.accelerometer import SixParameters
from onboard.core.result import Calibration, Status
from onboard.daemon.snapshot import ChangeView, ProposalView
from onboard.errors import PushError, RefusedError
from onboard.push.plan import PushPlan, propose
from onboard.push.policy import Accelerometer, PolicySettings, VehicleCondition, judge

WAIT_AFTER_FAILURE_S = (30.0, 60.0, 120.0, 300.0)
"""Between a transaction that did not complete and the next for that accelerometer."""
MOVED_SIGMAS = 2.0
"""An approval is of the values shown: it lapses when an estimate moves by more than this."""
PEOPLE = frozenset({"approval", "refused"})
"""Reasons that a person lifts."""


@dataclass(slots=True)
class Standing:
    """Where one accelerometer stands with people and with past failures."""

    approved: PushPlan | None = None
    refused: str = ""
    failures: int = 0
    not_before: float = 0.0


@dataclass(frozen=True, slots=True)
class Proposal:
    """A plan and every reason, by name, why it is not written now, with a sentence each."""

    plan: PushPlan
    held_back: Mapping[str, str] = field(default_factory=dict)


class Proposals:
    """The current proposals and what people said about them."""

    def __init__(
        self, settings: PolicySettings, *, approval: bool, imus: tuple[int, ...] = ()
    ) -> None:
        self.settings = settings
        self.approval = approval
        self.forbidden = ""
        self.current: dict[int, Proposal] = {}
        self.counters: Counter[str] = Counter()
        self._imus = imus
        self._standing: dict[int, Standing] = {}

    def update(
        self,
        now: float,
        *,
        system_id: int,
        calibrations: Mapping[int, Calibration],
        parameters: Mapping[str, float],
        condition: VehicleCondition,
    ) -> None:
        """Make them anew from the estimates and the autopilot's values of this moment."""
        plans: dict[int, PushPlan] = {}
        for imu, calibration in calibrations.items():
            try:
                plans[imu] = propose(
                    calibration,
                    parameters,
                    system_id=system_id,
                    scale_bounds=(self.settings.scale_min, self.settings.scale_max),
                    offset_bound=self.settings.offset_max,
                )
            except PushError:
                self.counters["not_proposed"] += 1
        alone = {
            imu: judge(plan, calibrations[imu], condition, self.settings, values=parameters)
            for imu, plan in plans.items()
        }
        self.current = {}
        for imu, plan in plans.items():
            others = [
                Accelerometer(
                    other,
                    SixParameters(calibrations[other].scale, calibrations[other].offset),
                    # Those that nothing holds back are written in the same sitting.
                    plans[other].six_before() if alone[other] else plans[other].six_wanted(),
                )
                for other in plans
                if other != imu and calibrations[other].status is Status.CALIBRATED
            ]
            refusals = judge(
                plan, calibrations[imu], condition, self.settings, values=parameters, others=others
            )
            held_back = self._beyond_policy(imu, plan, now)
            for refusal in refusals:  # several of one name (six sigmas): the first says enough
                held_back.setdefault(refusal.objection.value, refusal.sentence)
            self.current[imu] = Proposal(plan, held_back)

    def ready(self) -> PushPlan | None:
        """The first plan that nothing holds back."""
        return next((p.plan for p in self.current.values() if not p.held_back), None)

    def approve(self, imus: Sequence[int]) -> str:
        """A person allows what is proposed now (no number: all that wait for one).

        Raises:
            RefusedError: nothing waits for a person.
        """
        waiting = [
            imu
            for imu in imus or self.current
            if imu in self.current and PEOPLE & self.current[imu].held_back.keys()
        ]
        if not waiting:
            raise RefusedError("nothing waits for approval")
        for imu in waiting:
            self._standing[imu] = Standing(approved=self.current[imu].plan)
        self.counters["approvals"] += len(waiting)
        return f"{named(waiting)} approved: written as soon as policy and flight state allow"

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
        standing.refused = why

    def succeeded(self, imu: int) -> None:
        """A transaction completed: its approval is used up."""
        standing = self.standing(imu)
        standing.approved = None
        standing.failures = 0

    def failed(self, imu: int, now: float) -> None:
        """A transaction did not complete: wait, the longer the oftener."""
        standing = self.standing(imu)
        wait = WAIT_AFTER_FAILURE_S[min(standing.failures, len(WAIT_AFTER_FAILURE_S) - 1)]
        standing.failures += 1
        standing.not_before = now + wait

    def standing(self, imu: int) -> Standing:
        """What is remembered of one accelerometer."""
        return self._standing.setdefault(imu, Standing())

    def forget(self) -> None:
        """What was learned is reset: what was said about it means nothing any more."""
        self._standing.clear()
        self.current = {}

    def view(self) -> tuple[ProposalView, ...]:
        """For the snapshot."""
        return tuple(
            ProposalView(
                imu=imu,
                changes=tuple(
                    ChangeView(
                        name=c.name, before=c.before, after=c.wanted, sigma=c.sigma, kept=c.kept
                    )
                    for c in proposal.plan.changes
                ),
                held_back=dict(proposal.held_back),
                approved=self.standing(imu).approved is not None,
                rejected=bool(self.standing(imu).refused),
            )
            for imu, proposal in self.current.items()
        )

    def _beyond_policy(self, imu: int, plan: PushPlan, now: float) -> dict[str, str]:
        standing = self.standing(imu)
        found: dict[str, str] = {}
        if self.forbidden:
            found["advise_only"] = self.forbidden
        if self._imus and imu not in self._imus:
            found["not_selected"] = f"IMU {imu} is not among [push] imus"
        if standing.refused:
            found["refused"] = f"{standing.refused}; `onboard approve {imu}` lifts that"
        if now < standing.not_before:
            wait = standing.not_before - now
            found["failed_before"] = f"the last try failed: the next one in {wait:.0f} s"
        if standing.approved is not None and _moved(standing.approved, plan):
            standing.approved = None
            self.counters["approvals_lapsed"] += 1
        if self.approval and standing.approved is None:
            found["approval"] = "a person has to approve"
        return found


def named(imus: Sequence[int]) -> str:
    """IMU 1, IMU 2."""
    return ", ".join(f"IMU {imu}" for imu in imus)


def _moved(approved: PushPlan, plan: PushPlan) -> bool:
    return any(
        abs(now.wanted - then.wanted) > MOVED_SIGMAS * max(now.sigma, then.sigma)
        for then, now in zip(approved.changes, plan.changes, strict=True)
        if not (then.kept and now.kept)
    )
