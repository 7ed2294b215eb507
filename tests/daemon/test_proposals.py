"""What is written is what is judged, beside what the other accelerometers really have."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onboard.core.gps.trust import TrustWindow
from onboard.daemon.learning.flight import Judged, JudgedFlight
from onboard.daemon.learning.learned import Learned
from onboard.daemon.pushing.people import approvable
from onboard.daemon.pushing.proposals import Proposals
from onboard.daemon.view.trust import trust_view
from onboard.errors import RefusedError
from onboard.mavlink.parameter_messages import to_float32
from onboard.push.diagnosed import Diagnosed
from onboard.push.entries import Support
from onboard.push.policy import Mode, PolicySettings, VehicleCondition
from tests.push.calibrations import calibration, covariance, current

LANDED = VehicleCondition(armed=False, disarmed_for=10.0, landed=True)
FLYING = VehicleCondition(armed=True, landed=False, ekf_flags=0x37)
FINE = covariance((0.0004,) * 3 + (0.002,) * 3)
FAR_OFF = {"scale": (1.0, 1.0, 1.0), "offset": (1.2, 0.1, 0.1)}
"""Both sensors of a board alike: they agree as they are, and as they should be."""


def learned(*calibrations):
    def judged(c):
        in_force = tuple(map(to_float32, (*c.in_force_scale, *c.in_force_offset)))
        return Judged(3e6, in_force, Diagnosed(c.imu, "clean", (), c))

    flight = JudgedFlight(Support("f", 0.0, "", 300.0), {c.imu: judged(c) for c in calibrations})
    trust = trust_view(TrustWindow(), told=False, windows=0)
    return Learned({c.imu: c for c in calibrations}, trust, {}, flight=flight)


def update(proposals, *calibrations, condition=LANDED, system_id=1, board=""):
    parameters = {}
    for c in calibrations:
        parameters |= current(c.imu)
    known = learned(*calibrations)
    proposals.update(
        0.0,
        system_id=system_id,
        learned=known,
        parameters=parameters,
        condition=condition,
        board=board,
    )
    return {imu: set(p.held_back) for imu, p in proposals.current.items()}


def test_in_flight_a_step_that_was_approved_too_large_waits_for_the_landing():
    proposals = Proposals(PolicySettings(mode=Mode.IN_FLIGHT), approval=True)
    large = calibration(scale=(1.0055, 1.004, 1.003), offset=(0.05, -0.05, 0.06), covariance=FINE)
    assert "step_too_large" in update(proposals, large, condition=FLYING)[1]
    proposals.approve((1,))
    smaller = replace(large, scale=(1.00495, 1.004, 1.003))
    assert update(proposals, smaller, condition=FLYING)[1] == {"step_too_large"}
    assert proposals.ready() is None
    assert update(proposals, smaller)[1] == set()
    assert proposals.ready().wanted["INS_ACCSCAL_X"] == to_float32(1.0055)


@pytest.mark.parametrize("approval", [True, False])
def test_nobody_is_asked_to_approve_a_flight_that_is_diagnosed_in_a_moment(approval):
    """The vehicle is seen to have landed before its last samples are learned."""
    proposals = Proposals(PolicySettings(), approval=approval)
    c = calibration()
    ending = replace(learned(c), flight=None, flying=True)
    told = {"system_id": 1, "parameters": current(1)}
    proposals.update(0.0, learned=ending, condition=LANDED, **told)
    held = proposals.current[1].held_back
    assert held.keys() - {"approval"} == {"diagnosing"}
    assert approvable(held) is approval
    proposals.update(0.0, learned=ending, condition=FLYING, **told)
    assert "not_diagnosed" in proposals.current[1].held_back
    never = replace(ending, flying=False)
    proposals.update(0.0, learned=never, condition=LANDED, **told)
    assert "not_diagnosed" in proposals.current[1].held_back


def test_values_that_are_never_written_are_not_approved():
    proposals = Proposals(PolicySettings(), approval=True)
    update(proposals, calibration(scale=(1.2006, 0.988, 1.007)))
    with pytest.raises(RefusedError, match="nothing waits"):
        proposals.approve((1,))
    assert update(proposals, calibration(scale=(1.1994, 0.988, 1.007)))[1] == {"approval"}
    proposals.approve((1,))
    update(proposals, calibration(scale=(1.2006, 0.988, 1.007)))
    assert proposals.ready().wanted["INS_ACCSCAL_X"] == to_float32(1.1994)


def test_what_was_approved_is_worth_what_is_known_now():
    proposals = Proposals(PolicySettings(), approval=True)
    early = calibration(
        scale=(1.0005, 1.0, 1.0), offset=(0.05, -0.03, 0.04), covariance=covariance()
    )
    assert update(proposals, early)[1] == {"approval", "not_sure"}
    proposals.approve((1,))
    assert update(proposals, early)[1] == {"not_sure"}
    assert update(proposals, replace(early, covariance=FINE))[1] == set()
    assert proposals.ready().worth.probability > proposals.settings.sure


def test_what_was_approved_of_one_board_is_not_of_another_one():
    """Of a board that tells its id another system id makes no other one."""
    proposals, known = Proposals(PolicySettings(), approval=True), calibration(covariance=FINE)
    update(proposals, known, board="0a")
    proposals.approve((1,))
    assert update(proposals, known, board="0a", system_id=7)[1] == set()
    assert update(proposals, known, board="0b")[1] == {"approval"}
    assert update(proposals, known, board="0a")[1] == {"approval"}


class TestAnotherAccelerometer:
    def both(self):
        return (
            calibration(imu=1, **FAR_OFF, in_force_offset=(0.02, -0.03, 0.04)),
            calibration(imu=2, **FAR_OFF, in_force_offset=(0.02, -0.03, 0.04)),
        )

    def test_is_written_in_the_same_sitting_where_nothing_is_against_either(self):
        assert update(Proposals(PolicySettings(), approval=False), *self.both()) == {
            1: set(),
            2: set(),
        }

    def test_that_is_not_to_be_written_stays_as_it_is(self):
        proposals = Proposals(PolicySettings(), approval=False, imus=(1,))
        assert update(proposals, *self.both())[1] == {"imus_inconsistent"}

    def test_that_a_person_refused_stays_as_it_is(self):
        proposals = Proposals(PolicySettings(), approval=False)
        proposals.refuse(2, "a person rejected it")
        assert update(proposals, *self.both())[1] == {"imus_inconsistent"}

    def test_waits_for_a_person_as_well_and_both_are_approved_together_or_none_is_written(self):
        proposals = Proposals(PolicySettings(), approval=True)
        assert update(proposals, *self.both()) == {1: {"approval"}, 2: {"approval"}}
        proposals.approve((1,))
        assert update(proposals, *self.both())[1] == {"imus_inconsistent"}
        assert proposals.ready() is None
        proposals.approve((2,))
        assert update(proposals, *self.both()) == {1: set(), 2: set()}

    def test_that_flies_as_well_is_no_other_case(self):
        held = update(Proposals(PolicySettings(), approval=False), *self.both(), condition=FLYING)
        assert held == {1: {"armed"}, 2: {"armed"}}


class TestWhatIsToldAtTheEndOfATransaction:
    """Before the next look at it: nothing is about to be written then."""

    @pytest.fixture
    def proposals(self):
        made = Proposals(PolicySettings(), approval=False)
        assert update(made, calibration())[1] == set()
        assert made.ready() is not None
        return made

    @pytest.mark.parametrize(
        ("end", "name"),
        [
            (lambda p: p.failed(1, 0.0), "failed_before"),
            (lambda p: p.succeeded(1, current(1).values()), "nothing_to_change"),
            (lambda p: p.refuse(1, "a person rolled the last push back"), "refused"),
        ],
    )
    def test_is_why_it_is_not_written_again(self, proposals, end, name):
        end(proposals)
        assert set(proposals.current[1].held_back) == {name}
        assert proposals.ready() is None

    def test_of_an_accelerometer_of_which_nothing_is_proposed_is_nothing(self, proposals):
        proposals.failed(2, 0.0)
        assert set(proposals.current) == {1}
