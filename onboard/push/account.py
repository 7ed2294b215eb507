"""A push told after landing: what was wrong, what was written, what it improved, what is next.

Four sentences for people, made where the plan, its baseline and the verdict of the next flight are
at hand, so that page and terminal say the same.
"""

from __future__ import annotations

from dataclasses import dataclass

from onboard.push.entries import Verdict, Watched
from onboard.push.plan import Change, PushPlan

FREE_S = 10
"""s without GPS over which a velocity residual grows: that of the estimates' residuals."""
MIXED = (
    "Look at the values: some are those from before, lost or set by somebody. "
    "A roll-back puts the others back, too."
)
AXES = {"X": "x", "Y": "y", "Z": "z"}


@dataclass(frozen=True, slots=True)
class Account:
    """One sentence each."""

    wrong: str
    written: str
    improved: str
    next: str


def account(
    plan: PushPlan, watched: Watched | None, *, in_force: bool, mixed: bool = False
) -> Account:
    """Of a push that was completed.

    Args:
        plan: what was written, and what that was expected to bring.
        watched: what the flight after it said; None if there was none.
        in_force: it is the last one, and its values are there.
        mixed: the autopilot has some of these values, and some of those from before.
    """
    return Account(
        wrong=_wrong(plan.changes),
        written=_written(plan.changes),
        improved=_improved(plan, watched),
        next=MIXED if mixed else _next(watched, in_force=in_force),
    )


def _wrong(changes: tuple[Change, ...]) -> str:
    """By how much the old values were off, the largest of each kind."""
    written = [c for c in changes if not c.kept]
    scale = max((c for c in written if "SCAL" in c.name), key=_by, default=None)
    offset = max((c for c in written if "OFFS" in c.name), key=_by, default=None)
    said = []
    if scale is not None:
        said.append(f"the {_axis(scale)} scale was off by {100.0 * _by(scale):.2g} %")
    if offset is not None:
        was = "" if said else "was off "
        said.append(f"the {_axis(offset)} offset {was}by {_by(offset):.2g} m/s²")
    if not said:
        return "Nothing was off."
    less = "; the others were off by less" if len(written) > len(said) else ""
    sentence = f"{' and '.join(said)}{less}."
    return sentence[0].upper() + sentence[1:]


def _written(changes: tuple[Change, ...]) -> str:
    kept = sum(c.kept for c in changes)
    count = len(changes) - kept
    said = f"{count} value{'s' if count != 1 else ''}, each read back from the autopilot."
    if kept:
        stay = (
            "1 stays as it was: the flight does" if kept == 1 else f"{kept} stay: the flight does"
        )
        said += f" {stay} not show {'it' if kept == 1 else 'them'}."
    return said


def _improved(plan: PushPlan, watched: Watched | None) -> str:
    """The velocity's error after a while without GPS: then, with the new values, and since."""
    before, after = plan.baseline.velocity_rms_before, plan.baseline.velocity_rms_after
    if before is None or after is None:
        return "How much it improves was not measured on the flight it was learned from."
    said = (
        f"After {FREE_S} s without GPS the velocity was off by {before:.2g} m/s; "
        f"with the new values it is {after:.2g} m/s on the same flight"
    )
    flown = None if watched is None else watched.velocity_rms
    return f"{said}, and {flown:.2g} m/s on the next one." if flown is not None else f"{said}."


def _next(watched: Watched | None, *, in_force: bool) -> str:
    verdict = None if watched is None else watched.verdict
    if verdict is Verdict.WORSE and watched is not None:
        if in_force:
            return f"Stay on the ground until the old values are back: {watched.sentence}."
        return (
            f"The old values are back, because {watched.sentence}. "
            "Look at the diagnosis before you approve anything again."
        )
    if verdict is Verdict.SUPERSEDED:
        return "Nothing: somebody has changed the parameters since."
    if not in_force:
        return "Nothing: other values are in force since, or it was rolled back."
    if verdict is Verdict.DOUBTED and watched is not None:
        return f"Fly again, the next flight is asked anew. The values are {watched.sentence}."
    if verdict is Verdict.KEPT and watched is not None:
        return f"Nothing: the next flight confirms the new values ({watched.sentence})."
    return "Fly again, anything, for two minutes or more: that flight checks the new values."


def _by(change: Change) -> float:
    return abs(change.wanted - change.before)


def _axis(change: Change) -> str:
    return AXES.get(change.name[-1], change.name)
