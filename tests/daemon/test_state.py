"""The one sentence about an accelerometer: it never says two things at once."""

from __future__ import annotations

import itertools
import math

import pytest

from onboard.core.estimate.result import Coverage, Status
from onboard.daemon.view.accelerometers import imu_view
from onboard.daemon.view.snapshot import ChangeView, ProposalView
from onboard.daemon.view.state import NAMES, Circumstances, next_step, state_of
from tests.daemon.daemons import calibration

SENTENCES = {
    "armed": "armed, and the push policy is 'landed'",
    "not_calibrated": "the calibration is 'collecting'",
    "disarmed_too_short": "disarmed for 1.2 s, 5 s needed",
    "approval": "a person has to approve",
    "not_diagnosed": "no flight was diagnosed yet: that is done after a landing",
    "diagnosing": "the flight is being diagnosed",
    "physics_missing": "physics missing: the offset follows the temperature",
    "nothing_to_change": "what would change is less than 0.01 m/s^2 over this flight",
    "not_sure": "the new values are better with a probability of 0.97; 0.99 is needed",
    "no_improvement": "the held-out residual would go from 0.9 to 0.89 only",
    "policy_never": "the push policy is 'never': values are proposed only",
    "refused": "a person rejected it; `onboard approve 1` lifts that",
    "failed_before": "the last try failed: the next one in 17 s",
    "step_too_large": "INS_ACCSCAL_X would step by +0.02 in flight, 0.005 allowed: land first",
    "ekf_unhealthy": "in flight, and the EKF is not known to be healthy",
    "unheard_of": "the moon is full",
    "unconfirmed": "learned before the autopilot last started",
}


def proposal(*held, approved=False):
    change = ChangeView(name="INS_ACCSCAL_X", before=1.0, after=1.02, sigma=0.001)
    return ProposalView(
        imu=1,
        changes=(change,),
        held_back={name: SENTENCES[name] for name in held},
        approved=approved,
        rejected="refused" in held,
        approvable="approval" in held or "unconfirmed" in held,
    )


def state(*held, approved=False, **circumstances):
    return state_of(
        calibration(), Circumstances(proposal=proposal(*held, approved=approved), **circumstances)
    )


@pytest.mark.parametrize(
    ("held", "name", "title"),
    [
        ((), "calibrated", "about to be written"),
        (("armed",), "calibrated", "calibrated"),
        (("armed", "not_calibrated", "not_sure"), "calibrated", "calibrated"),
        (("armed", "not_diagnosed"), "calibrated", "calibrated"),
        (("step_too_large",), "calibrated", "calibrated"),
        (("ekf_unhealthy", "step_too_large"), "calibrated", "calibrated"),
        (("step_too_large", "not_sure"), "held_back", "held back"),
        (("diagnosing",), "calibrated", "calibrated"),
        (("diagnosing", "not_sure"), "calibrated", "calibrated"),
        (("diagnosing", "unheard_of", "approval"), "calibrated", "calibrated"),
        (("approval",), "approval", "waits for your approval"),
        (("approval", "armed"), "calibrated", "calibrated"),
        (("approval", "not_diagnosed"), "held_back", "not diagnosed yet"),
        (("physics_missing", "approval"), "held_back", "held back by the diagnosis"),
        (("physics_missing", "nothing_to_change"), "held_back", "held back by the diagnosis"),
        (("nothing_to_change", "approval"), "up_to_date", "up to date"),
        (("refused", "approval"), "rejected", "rejected"),
        (("policy_never", "approval"), "calibrated", "calibrated, not written"),
        (("no_improvement", "approval"), "up_to_date", "up to date"),
        (("no_improvement", "not_sure"), "held_back", "held back"),
        (("policy_never",), "calibrated", "calibrated, not written"),
        (("not_sure", "armed"), "held_back", "held back"),
        (("unconfirmed",), "approval", "waits for your approval"),
        (("unconfirmed", "approval"), "approval", "waits for your approval"),
        (("unheard_of",), "held_back", "held back"),
    ],
)
def test_of_many_reasons_the_telling_one_decides(held, name, title):
    said = state(*held)
    assert (said.name, said.title) == (name, title)


def test_values_that_could_not_be_compared_are_not_called_up_to_date():
    unknown = calibration(held_out_before=math.nan)
    said = state_of(unknown, Circumstances(proposal=proposal("no_improvement")))
    assert said.name == "held_back"


def test_a_reason_that_nobody_here_has_heard_of_is_told_in_its_own_words():
    assert state("unheard_of").sentence.endswith("not written: the moon is full")


def test_what_no_flight_has_confirmed_is_said_to_whoever_is_to_approve_it():
    said = state("unconfirmed", "approval")
    assert said.sentence.endswith("learned before the autopilot last started")
    assert "approve" in said.next


@pytest.mark.parametrize("status", [Status.COLLECTING, Status.INSUFFICIENT])
def test_of_a_flight_that_was_doubted_it_is_not_said_that_it_was_too_short(status):
    """What was withdrawn for missing physics is not to be had by flying more of the same."""
    doubted = calibration(status=status)
    said = state_of(doubted, Circumstances(proposal=proposal("physics_missing", "unheard_of")))
    assert (said.name, said.title) == (status.value, "held back by the diagnosis")
    assert "the offset follows the temperature" in said.sentence
    assert said.next == "see diagnosis"


def test_where_only_another_flight_decides_it_is_what_is_to_be_done():
    """After a boot, of values that somebody has changed: nothing compares old and new."""
    held = {"unconfirmed": "somebody has changed it: fly", "no_improvement": "no residual"}
    shut = ProposalView(imu=1, changes=(), held_back=held, approved=False, rejected=False)
    said = state_of(calibration(held_out_before=math.nan), Circumstances(proposal=shut))
    assert (said.name, said.next.split(":")[0]) == ("held_back", "fly again")


@pytest.mark.parametrize(
    ("held", "what"),
    [("temperature_reference_unknown", "bench"), ("not_sure", "fly again"), ("doubtful", "reset")],
)
def test_what_a_person_can_do_about_it_is_the_next_step(held, what):
    """It is a warning, and beside it stood that there is nothing to do."""
    shut = ProposalView(
        imu=1, changes=(), held_back={held: "why", "approval": "a person"}, approved=False,
        rejected=False,
    )  # fmt: skip
    assert what in state_of(calibration(), Circumstances(proposal=shut)).next


def test_approved_with_nothing_to_change_is_not_about_to_be_written():
    said = state("nothing_to_change", approved=True)
    assert (said.name, said.next) == ("up_to_date", "")
    assert "written as soon" not in said.sentence


def test_what_is_being_written_is_no_estimate_and_no_proposal():
    said = state("approval", writing=True)
    assert (said.name, said.next) == ("writing", "")


def test_collecting_is_never_beside_nothing_more_needed():
    """All six are covered, but it hovered: then this is what is said, and what to do."""
    hovered = calibration(
        status=Status.COLLECTING, note="hovering or standing: fly fast, brake hard, turn both ways."
    )
    view = imu_view(hovered)
    assert view.coverage.advice == ""
    assert view.state.name == "collecting"
    assert "hovering or standing" in view.state.sentence
    assert view.state.next
    assert next_step([view]).text == view.state.next


def test_what_to_fly_is_that_of_the_accelerometer_that_needs_most():
    few = Coverage(20.0, (20.0,) * 6, "y scale", "fly fast to the left and right")
    learning = imu_view(calibration(2, status=Status.COLLECTING, coverage=few))
    done = imu_view(calibration())
    said = next_step([done, learning])
    assert (said.imu, said.text) == (2, "fly fast to the left and right")
    assert next_step([done]).text == "nothing more needed"
    assert next_step([]) is None


def test_seconds_that_pass_do_not_make_another_state():
    a = proposal("failed_before")
    b = proposal("failed_before")
    b.held_back["failed_before"] = "the last try failed: the next one in 16 s"
    said = [state_of(calibration(), Circumstances(proposal=p)) for p in (a, b)]
    assert said[0] == said[1]


def test_every_state_has_a_name_of_the_table_a_title_and_a_sentence():
    for status in Status:
        for held in itertools.combinations(SENTENCES, 2):
            for flying, writing, written, approved in itertools.product((False, True), repeat=4):
                said = state_of(
                    calibration(status=status),
                    Circumstances(
                        proposal=proposal(*held, approved=approved),
                        writing=writing,
                        written=written,
                        flying=flying,
                    ),
                )
                assert said.name in NAMES
                assert said.title
                assert said.sentence
                assert said.severity in {"good", "info", "warning", "error"}
                assert len(f"OBC: IMU 1: {said.title}") <= 50
