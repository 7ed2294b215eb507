"""Writes that have not come to their end: which values are in force, and what a person should do.

A set of six of which a part is new is what nothing may fly with unsaid: scale and offset of an axis
belong together.  It is left where the vehicle armed in the middle, where the link or the service
was lost, and where the autopilot had not stored all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from onboard.daemon.view.snapshot import UnfinishedValue, UnfinishedView
from onboard.push.entries import Purpose, Recovery
from onboard.push.plan import Change, PushPlan
from onboard.push.policy import VehicleCondition

LAND = "land and disarm"


@dataclass(frozen=True, slots=True, kw_only=True)
class Unfinished:
    """One of them; ``waits``: why it is not taken up by itself; ``asks``: a person decides.

    ``unanswered``: names that were written and not read back when it was left, at ``since``
    (monotonic, s): what was told of them before says nothing.
    """

    recovery: Recovery
    waits: str = ""
    asks: bool = False
    unanswered: frozenset[str] = frozenset()
    since: float = -math.inf


def unfinished_view(
    one: Unfinished,
    values: Mapping[str, float],
    condition: VehicleCondition,
    *,
    heard: Mapping[str, float],
    hindered: str = "",
) -> UnfinishedView:
    """It in words.

    Args:
        one: what has not come to its end.
        values: the autopilot's parameters by name, those that were read since it is there.
        condition: the vehicle now.
        heard: when the autopilot told each of them last, monotonic, s.
        hindered: why nothing can be written now whatever the vehicle does, in words.
    """
    plan = one.recovery.plan
    stale = {n for n in one.unanswered if heard.get(n, -math.inf) < one.since}
    values = {name: value for name, value in values.items() if name not in stale}
    half = is_half(plan, values)
    return UnfinishedView(
        imu=plan.imu,
        half=half,
        values=tuple(
            UnfinishedValue(name=c.name, before=c.before, written=c.wanted, now=values.get(c.name))
            for c in plan.changes
            if c.differs
        ),
        sentence=_sentence(one, half, values),
        next="" if half is False else _next(one, condition, hindered),
    )


def is_half(plan: PushPlan, values: Mapping[str, float]) -> bool | None:
    """Whether a part of a plan's new values is in force and a part is not; None: not known."""
    differing = [c for c in plan.changes if c.differs]
    new = [values[c.name] == c.wanted for c in differing if c.name in values]
    if any(new) and not all(new):
        return True
    return None if len(new) < len(differing) else False


def _sentence(one: Unfinished, half: bool | None, values: Mapping[str, float]) -> str:  # noqa: FBT001 - as found
    what = "push" if one.recovery.purpose is Purpose.PUSH else "roll-back"
    changes = [c for c in one.recovery.plan.changes if c.differs]
    if half is None:
        return f"a {what} was interrupted; which of its values are in force is not known yet"
    if half:
        return f"half a set is in force: {_listed(changes, values)}"
    there = values[changes[0].name] == changes[0].wanted if changes else False
    which = "all of its values are in force" if there else "none of its values is in force"
    return f"a {what} was interrupted; {which}" + (f"; {one.waits}" if one.waits else "")


def _listed(changes: list[Change], values: Mapping[str, float]) -> str:
    """Which values are new, which old, and which are somebody's."""
    kinds: dict[str, list[str]] = {"new": [], "old": [], "neither": [], "not known": []}
    for c in changes:
        value = values.get(c.name)
        if value is None:
            kinds["not known"].append(c.name)
            continue
        kind = "new" if value == c.wanted else "old" if value == c.before else "neither"
        kinds[kind].append(f"{c.name} = {value:.5g}")
    return "; ".join(f"{kind} {', '.join(which)}" for kind, which in kinds.items() if which)


def _next(one: Unfinished, condition: VehicleCondition, hindered: str) -> str:
    """What to do about it, the vehicle first."""
    imu = one.recovery.plan.imu
    stands = condition.armed is False and condition.landed is not False
    first = "do not arm" if stands or condition.armed is None else LAND
    if one.asks:
        then = f"`onboard rollback {imu}` puts the old values back"
        return f"{first}: {then}" if stands else f"{first}; then {then}"
    if one.waits:
        return f"{first}: it is not undone by itself, for {one.waits}"
    if hindered:
        return f"{first}: it cannot be undone now, for {hindered}"
    if condition.armed is None:
        return f"{first}: the old values are put back when the autopilot says that it is disarmed"
    return f"{first}: the old values are {'being' if stands else 'then'} put back"
