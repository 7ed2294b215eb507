"""The journal's entries as lines for people."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.daemon.view.snapshot import (
    JournalLine,
)
from onboard.push.entries import (
    Closed,
    Entry,
    Found,
    Planned,
    Purpose,
    Refused,
    Replaced,
    Support,
    Undoing,
    Watched,
    Writing,
)


def journal_view(
    lines: Sequence[tuple[float, Entry]], of_this_run: int = 0
) -> tuple[JournalLine, ...]:
    """The journal for people, oldest first; read-backs go without saying.

    Args:
        lines: entries with their Unix time.
        of_this_run: so many of them, the last ones.
    """
    imus: dict[str, int] = {}
    shown = []
    for number, (at, entry) in enumerate(lines, start=1):
        match entry:
            case Planned(transaction, plan, purpose, support):
                imus[transaction] = plan.imu
                changed = sum(change.differs for change in plan.changes)
                what = "push" if purpose is Purpose.PUSH else "roll-back"
                text = f"{what} of {changed} values begins{_resting_on(support)}"
            case Writing(name=name, before=before, value=value, undo=undo):
                text = f"{name}: {before:.6g} -> {value:.6g}{' (undo)' if undo else ''}"
            case Undoing(sentence=sentence):
                text = f"undoing: {sentence}"
            case Closed(result=result, sentence=sentence):
                text = f"{result.value.replace('_', ' ')}: {sentence}"
            case Watched(verdict=verdict, sentence=sentence):
                text = f"flight after the push: {verdict.value}: {sentence}"
            case Replaced(sentence=sentence):
                text = f"not ours any more: {sentence}"
            case Found(imu=imu, verdict=verdict, effects=effects, missing=missing):
                imus[entry.transaction] = imu
                text = f"flight diagnosed: {diagnosis_in_words(verdict, effects)}"
                if missing:
                    text += f"; not to be written by itself: {missing}"
            case Refused(imu=imu, sentence=sentence):
                imus[entry.transaction] = imu
                text = f"held back: {sentence}" if sentence else "no longer held back"
            case _:
                continue
        shown.append(
            JournalLine(
                at=at,
                kind=type(entry).__name__.lower(),
                transaction=entry.transaction,
                imu=imus.get(entry.transaction),
                text=text,
                earlier=number <= len(lines) - of_this_run,
            )
        )
    return tuple(shown)


def _resting_on(support: Support | None) -> str:
    """What a push rests on, in a few words."""
    if support is None:
        return ""
    approved = ", approved by a person" if support.approved else ""
    return f" after {support.trusted_s:.0f} s of flight{approved}"


def diagnosis_in_words(verdict: str, effects: Sequence[str]) -> str:
    """One line about a diagnosis."""
    names = ", ".join(name.replace("_", " ") for name in effects)
    return f"{verdict.replace('_', ' ')}{f': {names}' if names else ''}"
