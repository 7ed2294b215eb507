"""What a person may allow: said by the service, so that page and terminal need not guess."""

from __future__ import annotations

import pytest

from onboard.daemon.pushing.people import approvable, told
from onboard.daemon.pushing.proposals import Proposal, Proposals
from onboard.daemon.pushing.push_view import proposal_views
from onboard.errors import RefusedError
from onboard.push.plan import propose
from onboard.push.policy import PolicySettings
from tests.daemon.daemons import calibration
from tests.daemon.test_written import parameters


@pytest.mark.parametrize(
    ("held_back", "expected"),
    [
        ([], False),
        (["armed"], False),
        (["approval"], True),
        (["approval", "armed"], True),
        (["refused"], True),
        (["physics_missing"], True),
        (["not_diagnosed"], True),
        (["not_diagnosed", "armed"], False),
        (["approval", "nothing_to_change"], False),
        (["refused", "nothing_to_change"], False),
        (["approval", "no_improvement"], False),
        (["physics_missing", "not_calibrated"], False),
        (["not_sure"], False),
    ],
)
def test_a_reason_that_a_person_lifts_makes_it_approvable(held_back, expected):
    assert approvable(dict.fromkeys(held_back, "because")) is expected


@pytest.mark.parametrize("despite", [False, True])
def test_nothing_to_change_is_not_approved_as_about_to_be_written(despite):
    proposals = Proposals(PolicySettings(), approval=True)
    held_back = dict.fromkeys(("approval", "nothing_to_change", "not_diagnosed"), "because")
    pushing = propose(calibration(), parameters(), system_id=1)
    proposals.current = {1: Proposal(pushing, held_back)}
    assert not proposal_views(proposals)[0].approvable
    with pytest.raises(RefusedError, match=r"^nothing waits for approval$"):
        proposals.approve((1,), despite_diagnosis=despite)


@pytest.mark.parametrize("reason", ["refused", "unconfirmed"])
@pytest.mark.parametrize(
    "beside",
    [(), ("armed",), ("no_improvement",), ("out_of_bounds",), ("physics_missing",), ("not_sure",)],
)
def test_a_command_that_is_named_is_taken(reason, beside):
    proposals = Proposals(PolicySettings(), approval=False)
    held = told(1, dict.fromkeys((reason, *beside), "because"))
    proposals.current = {1: Proposal(propose(calibration(), parameters(), system_id=1), held)}
    despite = "--despite-diagnosis" in held[reason]
    named = "onboard approve 1" in held[reason]
    assert named == (not {"no_improvement", "out_of_bounds"} & set(beside))
    if named:
        assert "IMU 1 approved" in proposals.approve((1,), despite_diagnosis=despite)
    else:
        with pytest.raises(RefusedError):
            proposals.approve((1,), despite_diagnosis=True)
