"""Proposals, the transaction under way and those before it, for people."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from onboard.daemon.pushing.ledger import Ledger
from onboard.daemon.pushing.people import approvable
from onboard.daemon.pushing.proposals import Proposals
from onboard.daemon.view.snapshot import (
    ChangeView,
    JudgedView,
    ProposalView,
    PushView,
    UnfinishedView,
)
from onboard.daemon.view.state import WAITING
from onboard.daemon.view.written import written_view
from onboard.push.entries import Planned, Purpose
from onboard.push.signals import Outcome
from onboard.push.transaction import PushTransaction


def push_view(
    proposals: Proposals,
    ledger: Ledger,
    *,
    transaction: PushTransaction | None,
    last: Outcome | None,
    judged: tuple[JudgedView, ...],
    in_force: Mapping[int, Planned],
    lost: Collection[int] = (),
    mixed: Collection[int] = (),
    asked: Collection[int] = (),
    unfinished: tuple[UnfinishedView, ...] = (),
) -> PushView:
    """What the snapshot says of pushes.

    Args:
        proposals: what would be written.
        ledger: what was written.
        transaction: under way, None if none is.
        last: how the last one of this run of the service ended.
        judged: what flights said of pushes.
        in_force: pushes whose values the autopilot has, by accelerometer.
        lost: accelerometers whose values the autopilot had not stored: to be put back.
        mixed: accelerometers that have old and new values, nobody knows why.
        asked: accelerometers of which a person decides: those, and writes that came late.
        unfinished: writes that have not come to their end.
    """
    current = proposals.current.items()
    waiting = (p.held_back.keys() for i, p in current if p.held_back and i != proposals.writing)
    state = "interrupted" if ledger.open or lost else "idle"
    return PushView(
        policy=proposals.settings.mode.value,
        approval_required=proposals.approval,
        approval_needed=any(names <= WAITING for names in waiting),
        state=state if transaction is None else transaction.state.value,
        active_imu=None if transaction is None else transaction.plan.imu,
        proposals=proposal_views(proposals),
        last_outcome=None if last is None else told(last),
        can_roll_back=tuple(sorted(in_force.keys() | set(asked))),
        judged=judged,
        written=written_view(
            ledger.entries,
            ledger.system_id,
            ledger.board,
            in_force={imu: pushed.transaction for imu, pushed in in_force.items()},
            mixed=mixed,
        ),
        unfinished=unfinished,
    )


def told(outcome: Outcome) -> str:
    """One sentence about how a transaction ended."""
    what = "push" if outcome.purpose is Purpose.PUSH else "roll-back"
    how = outcome.result.value.replace("_", " ")
    return f"IMU {outcome.plan.imu}: {what} {how}: {outcome.sentence}"


def proposal_views(proposals: Proposals) -> tuple[ProposalView, ...]:
    """The proposals that there are, by accelerometer."""
    return tuple(
        ProposalView(
            imu=imu,
            changes=tuple(
                ChangeView(name=c.name, before=c.before, after=c.wanted, sigma=c.sigma, kept=c.kept)
                for c in proposal.plan.changes
            ),
            held_back=dict(proposal.held_back),
            approved=proposals.standing(imu).approved is not None,
            rejected=bool(proposals.standing(imu).refused),
            approvable=approvable(proposal.held_back),
        )
        for imu, proposal in proposals.current.items()
    )
