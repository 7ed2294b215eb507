"""The state of one accelerometer, in one sentence.

Coverage, status, proposal and push each know a part of it.  Put side by side they contradict
each other; here they are made into one statement, and everybody (page, terminal, parameters,
messages, broker) shows that.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from onboard.answers.knowledge import calibrated, knowledge
from onboard.core.estimate.result import Calibration, Status
from onboard.daemon.view.snapshot import ImuView, ProposalView, StateView, StepView, UnfinishedView

NAMES: Final = (
    "collecting",
    "calibrated",
    "insufficient",
    "invalid",
    "approval",
    "held_back",
    "writing",
    "up_to_date",
    "rejected",
    "half_written",
)
"""All that a state may be called."""
AFTER_LANDING: Final = frozenset(
    {
        "armed",
        "disarmed_too_short",
        "in_air",
        "diagnosing",
        "step_too_large",
        "ekf_unhealthy",
    }
)
"""Reasons against a push that go away by themselves when the vehicle has landed."""
WAITING: Final = frozenset({"approval", "unconfirmed"})
"""Reasons that wait for a person who looks at the values."""
BY_CHOICE: Final = frozenset({"policy_never", "advise_only", "not_selected"})
"""Reasons that somebody has configured: no fault, and nothing to wait for."""
NOTHING_GAINED: Final = frozenset({"nothing_to_change", "no_improvement", "not_calibrated"})
"""Reasons that leave nothing worth writing, and so nothing to approve."""
STEADY: Final[Mapping[str, str]] = MappingProxyType(
    {"failed_before": "the last try to write it failed; it is tried again by itself"}
)
"""Instead of sentences that count seconds: a state is the same until something happens."""
FLY_ON = "fly on with GPS trusted, changing speed and direction often"
FLY_AGAIN = "fly again: the next flight decides on these values"
TO_DO: Final[Mapping[str, str]] = MappingProxyType(
    {
        "no_journal": "see to the companion's disk: it is full, read-only or failing",
        "imu_stuck": "see to the accelerometer before the next flight",
        "doubtful": "find out who else sends, then reset what was learned",
        "temperature_learning": "let the autopilot finish its temperature calibration",
        "temperature_reference_unknown": "calibrate the accelerometers on the bench once",
        "out_of_bounds": "calibrate on the bench, and check how the autopilot is mounted",
        "no_way_back": "set it to what it was, or calibrate on the bench",
        "kept_value_contradicted": "run onboard explain on the recording",
        "unconfirmed": FLY_AGAIN,
        "not_sure": FLY_AGAIN,
    }
)
"""Against what holds a value back that no approval lifts: the first of these."""
GOOD, INFO, WARNING, ERROR = "good", "info", "warning", "error"
_GRAVEST = (ERROR, WARNING, INFO, GOOD)


@dataclass(frozen=True, slots=True, kw_only=True)
class Circumstances:
    """What else decides: ``writing`` and ``written`` are about this accelerometer.

    ``impossible``: why nothing can be proposed, where there is no proposal.  ``half``: half a set
    is in force, or may be.
    """

    proposal: ProposalView | None = None
    writing: bool = False
    written: bool = False
    flying: bool = False
    impossible: str = ""
    half: UnfinishedView | None = None


ALONE: Final = Circumstances()
"""An answer of which nothing has been made yet."""


def state_of(c: Calibration, now: Circumstances = ALONE) -> StateView:
    """Where an accelerometer stands, in one sentence.

    Args:
        c: its answer.
        now: proposal, push and flight.
    """
    if now.writing:
        return _state("writing", "being written", "its values are being written", INFO)
    if now.half is not None:
        half = now.half
        title = "half a set in force" if half.half else "write interrupted"
        return _state(
            "half_written", title, half.sentence, ERROR if half.half else WARNING, half.next
        )
    match c.status:
        case Status.INVALID:
            return _state("invalid", "cannot be used", c.note or "it has no valid answer", ERROR)
        case Status.COLLECTING | Status.INSUFFICIENT if _missing(now):
            return _doubted(c.status.value, f"not calibrated: {_missing(now)}")
        case Status.COLLECTING:
            return _state("collecting", "learning", _so_far(c), INFO, _to_fly(c))
        case Status.INSUFFICIENT:
            return _state("insufficient", "not enough flown", _so_far(c), WARNING, _to_fly(c))
        case _:
            return _calibrated(c, now)


def next_step(views: Sequence[ImuView]) -> StepView | None:
    """What a person should do: of the gravest state, of those the least covered; None: unknown."""
    if not views:
        return None
    wanting = [view for view in views if view.state.next]
    if wanting:
        worst = min(wanting, key=lambda v: (_GRAVEST.index(v.state.severity), v.coverage.percent))
        return StepView(imu=worst.imu, text=worst.state.next, severity=worst.state.severity)
    if all(view.state.severity == GOOD for view in views):
        return StepView(imu=None, text="nothing more needed", severity=GOOD)
    return StepView(imu=None, text="nothing to do now", severity=INFO)


def landing_lifts(name: str, held_back: Mapping[str, str]) -> bool:
    """Whether a reason goes away by itself after the landing; a flight is diagnosed then."""
    flying = bool(held_back.keys() & {"armed", "in_air"})
    return name in AFTER_LANDING or (name == "not_diagnosed" and flying)


def _calibrated(c: Calibration, now: Circumstances) -> StateView:
    known = knowledge(c)
    further = c.coverage.advice if now.flying else ""
    if now.proposal is None and now.impossible and not now.flying:
        return _state("held_back", "held back", f"{known}; not written: {now.impossible}", WARNING)
    # Of an answer that has just become one the proposal may be a moment behind.
    if now.proposal is None or "not_calibrated" in now.proposal.held_back:
        return _state("calibrated", calibrated(c), known, GOOD, further)
    held = now.proposal.held_back
    if now.proposal.rejected:
        why = held.get("refused", "a person rejected it")
        return _state("rejected", "rejected", f"{known}; not written: {why}", INFO)
    lasting = {n: STEADY.get(n, s) for n, s in held.items() if not landing_lifts(n, held)}
    if "physics_missing" in lasting:
        return _doubted("held_back", f"{known}; not written: {lasting['physics_missing']}")
    if "nothing_to_change" in lasting:
        whose = "the values that were written" if now.written else "these values already"
        return _state("up_to_date", "up to date", f"{known}; the autopilot has {whose}", GOOD)
    if (
        "no_improvement" in lasting
        and lasting.keys() <= {"no_improvement", "approval"}
        and _judged(c)
    ):
        why = f"{known}; they would hardly do better than the values in force"
        return _state("up_to_date", "up to date", why, GOOD)
    return _proposed(c, now.proposal, lasting, further)


def _proposed(
    c: Calibration, proposal: ProposalView, lasting: Mapping[str, str], further: str
) -> StateView:
    """What becomes of values that could be written; ``lasting`` is what a landing leaves."""
    known, done = knowledge(c), calibrated(c)
    held, approved = proposal.held_back, "approved, " if proposal.approved else ""
    if not held:
        return _state("calibrated", f"{approved}about to be written", known, GOOD)
    if not lasting:
        then = "it is written after the landing"
        if "diagnosing" in held:
            then = "it is written when the flight has been diagnosed"
        return _state("calibrated", f"{approved}{done}", f"{known}; {then}", GOOD, further)
    chosen = [sentence for name, sentence in lasting.items() if name in BY_CHOICE]
    if chosen and lasting.keys() <= BY_CHOICE | {"approval"}:
        why = "; ".join(chosen)
        return _state("calibrated", f"{done}, not written", f"{known}; {why}", GOOD, further)
    if lasting.keys() <= WAITING:
        if len(held) > len(lasting):
            then = "after the landing a person has to approve it"
            return _state("calibrated", done, f"{known}; {then}", GOOD, further)
        todo = "look at the values, then approve or reject them"
        why = f"{known}; {lasting.get('unconfirmed', 'a person has to approve it')}"
        return _state("approval", "waits for your approval", why, WARNING, todo)
    if "diagnosing" in held:  # what else is against them is against values that are not the last
        then = "what becomes of it is known when the flight has been diagnosed"
        return _state("calibrated", done, f"{known}; {then}", GOOD, further)
    rest = [sentence for name, sentence in lasting.items() if name != "approval"]
    title = "not diagnosed yet" if lasting.keys() <= {"not_diagnosed", "approval"} else "held back"
    more = f" (and {len(rest) - 1} more)" if len(rest) > 1 else ""
    cure = next((what for name, what in TO_DO.items() if name in lasting), "")
    asks = proposal.approvable and "imu_stuck" not in lasting
    todo = further or ("approve it if that is all right" if asks else cure)
    title = f"{approved}but {title}" if approved else title
    severity = ERROR if "imu_stuck" in lasting else WARNING
    return _state("held_back", title, f"{known}; not written: {rest[0]}{more}", severity, todo)


def _missing(now: Circumstances) -> str:
    """What the diagnosis of the last flight says against it: more of the same is no help then."""
    return "" if now.proposal is None else now.proposal.held_back.get("physics_missing", "")


def _doubted(name: str, sentence: str) -> StateView:
    return _state(name, "held back by the diagnosis", sentence, WARNING, "see diagnosis")


def _judged(c: Calibration) -> bool:
    """Whether flight that was not fitted has compared old and new values."""
    return math.isfinite(c.held_out_before) and math.isfinite(c.held_out_after)


def _so_far(c: Calibration) -> str:
    """How far an accelerometer has come that is not calibrated."""
    if not c.coverage.advice and c.note:
        return f"not calibrated: {c.note.strip().rstrip('.')}"
    if not c.coverage.advice:
        return f"all six numbers are covered, {c.trusted_s:.0f} s of flight are not enough yet"
    return f"{knowledge(c)}; least is known of the {c.coverage.weakest}"


def _to_fly(c: Calibration) -> str:
    """Coverage says what to fly; where nothing is left to cover, more of the same is."""
    return c.coverage.advice or FLY_ON


def _state(name: str, title: str, sentence: str, severity: str, then: str = "") -> StateView:
    return StateView(name=name, title=title, sentence=sentence, severity=severity, next=then)
