"""What was written, from the journal: old values, new values, and what they have brought.

An estimate is compared with the values in force, and after a push these are the new ones: what
the push was good for is then seen nowhere but here.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from onboard.daemon.view.snapshot import AccountView, WrittenValue, WrittenView
from onboard.push.account import account
from onboard.push.entries import Closed, Entry, Planned, Purpose, Result, Watched

LATEST_SHOWN = 4
"""Pushes of one accelerometer besides its first, which is mostly the one that mattered."""


def written_view(
    lines: Sequence[tuple[float, Entry]],
    system_id: int | None = None,
    board: str = "",
    *,
    in_force: Mapping[int, str] | None = None,
    mixed: Collection[int] = (),
) -> tuple[WrittenView, ...]:
    """Pushes that were completed, oldest first.

    Args:
        lines: the journal: Unix time and entry, oldest first.
        system_id: of the vehicle that is there: of others nothing is shown; None: of all.
        board: its unique id, empty if it tells none.
        in_force: pushes whose values the autopilot has, transaction by accelerometer; None: as the
            journal has it.
        mixed: accelerometers that have values of the last push and of before it.
    """
    plans: dict[str, Planned] = {}
    verdicts: dict[str, Watched] = {}
    completed: dict[int, dict[str, tuple[float, Closed]]] = {}
    journalled: dict[int, str] = {}
    for at, entry in lines:
        match entry:
            case Planned(plan=plan) if system_id is None or plan.vehicle.same_airframe(
                system_id, board
            ):
                plans[entry.transaction] = entry
            case Watched():
                verdicts[entry.transaction] = entry
            case Closed() if entry.transaction in plans:
                planned = plans[entry.transaction]
                pushes = completed.setdefault(planned.plan.imu, {})
                _take(entry, at, planned, pushes, journalled)
            case _:
                pass
    there = journalled if in_force is None else in_force
    shown = []
    for imu, pushes in completed.items():
        names = list(pushes)
        for name in names[:1] + names[1:][-LATEST_SHOWN:]:
            at, closed = pushes[name]
            view = _view(
                plans[name],
                at,
                closed,
                verdicts.get(name),
                in_force=there.get(imu) == name and imu not in mixed,
                mixed=imu in mixed and name == names[-1],
            )
            shown.append(view)
    return tuple(sorted(shown, key=lambda view: view.at))


def _take(
    entry: Closed,
    at: float,
    planned: Planned,
    pushes: dict[str, tuple[float, Closed]],
    journalled: dict[int, str],
) -> None:
    """A transaction that was closed, into the accelerometer's pushes and what is in force."""
    imu = planned.plan.imu
    if entry.result is Result.COMPLETED:
        journalled.pop(imu, None)
        if planned.purpose is Purpose.PUSH:
            pushes[entry.transaction] = (at, entry)
            journalled[imu] = entry.transaction
    elif journalled.get(imu) == entry.transaction:
        # Completed once; after a reboot it was gone and was taken back.
        pushes.pop(entry.transaction)
        journalled.pop(imu)


def _view(
    planned: Planned,
    at: float,
    closed: Closed,
    watched: Watched | None,
    *,
    in_force: bool,
    mixed: bool,
) -> WrittenView:
    plan, baseline = planned.plan, planned.plan.baseline
    told = account(plan, watched, in_force=in_force, mixed=mixed)
    return WrittenView(
        imu=plan.imu,
        at=at,
        values=tuple(
            WrittenValue(
                name=c.name, before=c.before, written=c.wanted, read_back=closed.values.get(c.name)
            )
            for c in plan.changes
        ),
        in_force=in_force,
        held_out_before=baseline.held_out_before,
        held_out_after=baseline.held_out_after,
        velocity_rms_before_m_s=baseline.velocity_rms_before,
        velocity_rms_after_m_s=baseline.velocity_rms_after,
        verdict=None if watched is None else watched.verdict.value,
        verdict_sentence="" if watched is None else watched.sentence,
        next_held_out=None if watched is None else watched.held_out,
        next_velocity_rms_m_s=None if watched is None else watched.velocity_rms,
        account=AccountView(
            wrong=told.wrong, written=told.written, improved=told.improved, next=told.next
        ),
    )
