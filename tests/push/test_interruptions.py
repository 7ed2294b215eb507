"""A push that something happens to after its first write: it goes back, or stays open."""

import math

import pytest

from onboard.mavlink.parameter_messages import SendAction, SendParamSet, ValueReceived
from onboard.push import limits
from onboard.push.entries import Planned, Result, audit
from onboard.push.signals import Cancelled, LinkLost, Reason, Rebooted, VehicleReport
from tests.push.pushing import OLD, PushWorld, finish, make_plan, when_written


@pytest.mark.parametrize("number", range(6))
def test_what_somebody_sets_between_our_look_and_our_write_is_told(world, number):
    name, receive = world.plan.names[number], world.autopilot.receive
    theirs = [ValueReceived(name, 0.875)]

    def overtaken(action, now):
        if isinstance(action, SendParamSet) and action.name == name and theirs:
            world.feed(theirs.pop())  # they set it, all heard of it, and then ours came
        receive(action, now)

    world.autopilot.receive = overtaken
    outcome = finish(world)
    assert not theirs
    assert (outcome.result, outcome.reason) == (Result.ROLLED_BACK, Reason.CHANGED_BY_OTHER)
    assert name in outcome.sentence
    assert world.holds() == world.journal_says() == "old"


class TestARebootOrASilenceWhenAllSixAreWritten:
    """As README says: old values go back where it shows before all six are verified."""

    def late(self, world, what):
        """Let it happen when the last of the six has been read back, before they are verified."""
        when_written(world, 6, lambda: world.at(world.now + 0.5 * limits.SETTLE_S, what))

    def test_a_reboot_that_shows_before_they_are_verified_is_undone(self, world):
        def reboot():
            world.autopilot.reboot(world.now, silence=0.5)
            world.feed(Rebooted())

        self.late(world, reboot)
        outcome = finish(world)
        assert (outcome.result, outcome.reason) == (Result.ROLLED_BACK, Reason.REBOOTED)
        assert world.holds() == world.journal_says() == "old"

    def test_a_reboot_that_shows_later_leaves_what_was_stored(self, world):
        self.late(world, lambda: world.autopilot.reboot(world.now, silence=0.5))
        assert finish(world).result is Result.COMPLETED
        world.audit()  # as after any boot that is noticed
        assert world.holds() == world.journal_says() == "new"

    def test_a_reboot_that_has_lost_some_is_undone_whenever_it_shows(self, world):
        def reboot():
            world.autopilot.stored["INS_ACCSCAL_Z"] = world.plan.before["INS_ACCSCAL_Z"]
            world.autopilot.reboot(world.now, silence=0.5)

        self.late(world, reboot)
        outcome = finish(world)
        assert (outcome.result, outcome.reason) == (Result.ROLLED_BACK, Reason.REVERTED)
        assert world.holds() == world.journal_says() == "old"

    @pytest.mark.parametrize("lost", [(), ("INS_ACCOFFS_X",)], ids=["all there", "one lost"])
    def test_after_a_silence_it_is_finished_if_all_six_are_still_there(self, world, lost):
        def cut():
            for name in lost:
                world.autopilot.stored[name] = world.plan.before[name]
            world.autopilot.reboot(world.now, silence=30.0)
            world.feed(LinkLost())

        self.late(world, cut)
        outcome = finish(world)
        assert (outcome.result, outcome.open) == (Result.INTERRUPTED, True)
        assert world.restart(wait=60.0) == 1
        assert world.holds() == world.journal_says() == ("old" if lost else "new")


@pytest.mark.parametrize("count", range(1, 7))
class TestInTheMiddle:
    """Something happens just after write number ``count`` took effect."""

    def test_arming_rolls_a_landed_push_back(self, world, count):
        when_written(world, count, lambda: world.feed(VehicleReport(armed=True)))
        outcome = finish(world)
        assert (outcome.result, outcome.reason) == (Result.ROLLED_BACK, Reason.ARMED)
        assert world.holds() == world.journal_says() == "old"

    def test_armed_is_what_an_in_flight_push_expects(self, world, count):
        report = VehicleReport(armed=True, ekf_healthy=True)
        when_written(world, count, lambda: world.feed(report))
        assert finish(world, allow_armed=True).result is Result.COMPLETED

    def test_unhealthy_ekf_rolls_an_in_flight_push_back(self, world, count):
        report = VehicleReport(armed=True, ekf_healthy=False)
        when_written(world, count, lambda: world.feed(report))
        outcome = finish(world, allow_armed=True)
        assert (outcome.result, outcome.reason) == (Result.ROLLED_BACK, Reason.EKF_UNHEALTHY)
        assert world.holds() == "old"

    def test_cancelling_rolls_back(self, world, count):
        when_written(world, count, lambda: world.feed(Cancelled("the operator said so")))
        outcome = finish(world)
        assert (outcome.result, outcome.reason) == (Result.ROLLED_BACK, Reason.CANCELLED)
        assert outcome.sentence == "the operator said so"
        assert world.holds() == "old"

    @pytest.mark.parametrize("noticed", [True, False])
    def test_reboot_that_loses_unsaved_values(self, world, count, noticed):
        def reboot():
            world.autopilot.reboot(world.now, silence=2.0)
            if noticed:
                world.feed(Rebooted())

        world.autopilot.store_delay = 0.3
        when_written(world, count, reboot)
        outcome = finish(world)
        if noticed:
            assert (outcome.result, outcome.reason) == (Result.ROLLED_BACK, Reason.REBOOTED)
        assert world.holds() == world.journal_says()
        assert world.holds() in {"old", "new"}

    def test_long_reboot_is_left_open_and_undone_later(self, world, count):
        def reboot():
            world.autopilot.reboot(world.now, silence=30.0)
            world.feed(Rebooted())

        when_written(world, count, reboot)
        outcome = finish(world)
        assert outcome.result is Result.INTERRUPTED
        assert outcome.open
        assert world.restart(wait=60.0) == 1
        assert world.holds() == world.journal_says() == "old"

    @pytest.mark.parametrize("name", ["INS_ACCOFFS_X", "INS_ACCSCAL_Z"])
    @pytest.mark.parametrize("value", [0.77, None])
    def test_write_of_a_ground_station_stops_it_and_stands(self, world, count, name, value):
        """``None``: the ground station sets the old value; nobody can tell that from ours."""
        value = world.plan.before[name] if value is None else value
        when_written(world, count, lambda: world.autopilot.set_by_other(name, value, world.now))
        outcome = finish(world)
        others = {n for n in world.plan.names if n != name}
        six = world.autopilot.ram
        if outcome.result is Result.COMPLETED:  # we had not come to that name yet
            assert value == world.plan.before[name]
            assert world.holds() == "new"
        else:
            assert outcome.result is Result.ROLLED_BACK
            assert all(six[n] == world.plan.before[n] for n in others)
            assert six[name] == pytest.approx(value, abs=1e-6)
        if value == 0.77:
            assert outcome.reason is Reason.CHANGED_BY_OTHER
            assert outcome.left == (name,)

    def test_full_calibration_by_a_ground_station_stands_as_it_is(self, world, count):
        def calibrate():
            for i, n in enumerate(world.plan.names):
                world.autopilot.set_by_other(n, 0.9 + 0.01 * i, world.now)

        when_written(world, count, calibrate)
        outcome = finish(world)
        assert outcome.reason is Reason.CHANGED_BY_OTHER
        values = {n: world.autopilot.ram[n] for n in world.plan.names}
        assert values == pytest.approx(
            {n: 0.9 + 0.01 * i for i, n in enumerate(world.plan.names)}, abs=1e-6
        )
        assert set(outcome.left) == set(world.plan.names)

    def test_lost_link_leaves_it_open_and_the_next_link_undoes_it(self, world, count):
        def cut():
            world.link.cut = True
            world.feed(LinkLost())

        when_written(world, count, cut)
        outcome = finish(world)
        assert (outcome.result, outcome.reason) == (Result.INTERRUPTED, Reason.LINK_LOST)
        assert outcome.open
        assert world.journal_says() == "open"
        world.link.cut = False
        assert world.restart() == 1
        assert world.holds() == world.journal_says() == "old"

    def test_cut_that_nobody_reports_ends_by_itself(self, world, count):
        when_written(world, count, lambda: setattr(world.link, "cut", True))
        outcome = finish(world)
        assert outcome.result is Result.INTERRUPTED
        world.link.cut = False
        world.restart()
        assert world.holds() == world.journal_says() == "old"

    def test_other_airframe_on_the_new_link_is_not_touched(self, world, count):
        when_written(world, count, lambda: world.feed(LinkLost()))
        finish(world)
        before = dict(world.autopilot.ram)
        assert world.restart(system_id=2) == 1
        assert world.outcomes[-1].result is Result.OTHER_VEHICLE
        assert world.outcomes[-1].open
        world.autopilot.ram["INS_ACC_ID"] = 42.0
        world.restart()
        assert world.outcomes[-1].result is Result.OTHER_VEHICLE
        assert world.journal_says() == "open"
        assert {n: world.autopilot.ram[n] for n in world.plan.names} == {
            n: before[n] for n in world.plan.names
        }

    def test_journal_that_fails_rolls_back_and_stays_open(self, world, count):
        world.journal_broken_after = count + 2
        outcome = finish(world)
        assert outcome.reason is Reason.JOURNAL_FAILED
        assert outcome.open
        assert world.holds() == "old"
        world.restart()
        assert world.holds() == world.journal_says() == "old"


def test_journal_that_fails_first_means_nothing_is_written(world):
    world.journal_broken_after = 0
    outcome = finish(world)
    assert (outcome.result, outcome.reason) == (Result.ABORTED, Reason.JOURNAL_FAILED)
    assert world.autopilot.history == []
    assert world.restart() == 0


def test_full_storage_rolls_back(world):
    """RAM would hold the new values until the next boot only."""
    world.autopilot.full = True
    outcome = finish(world)
    assert outcome.reason is Reason.NOT_SAVED
    world.restart()
    assert world.holds() == world.journal_says() == "old"


def test_late_duplicate_of_a_write_is_caught_before_it_is_believed(world):
    """A radio delivers a second copy of an early PARAM_SET after the roll-back."""
    world.autopilot.denied.add("INS_ACCSCAL_Z")
    first = world.plan.write_order(world.plan.before)[0]
    late = SendParamSet(first, world.plan.wanted[first])
    when_written(world, 5, lambda: world.at(world.now + 1.5, lambda: receive_late(late)))

    def receive_late(action):
        world.autopilot.receive(action, world.now)

    outcome = finish(world)
    assert outcome.result is Result.ROLLED_BACK
    assert world.holds() == "old"


@pytest.mark.parametrize(
    "lost", [("INS_ACCSCAL_X",), ("INS_ACCOFFS_Y", "INS_ACCSCAL_Z"), make_plan().names]
)
def test_push_that_a_boot_took_back_in_part_is_undone(world, lost):
    """Storage that said "stored" and lied."""
    finish(world)
    for name in lost:
        world.autopilot.stored[name] = world.plan.before[name]
    world.autopilot.reboot(world.now)
    world.audit()
    assert world.outcomes[-1].result is Result.ROLLED_BACK
    assert world.holds() == world.journal_says() == "old"
    assert world.journal.last_completed(1) is None


def test_audit_leaves_a_whole_push_and_somebody_elses_values_alone(world):
    finish(world)
    (planned,) = [e for _, e in world.journal.entries if isinstance(e, Planned)]
    assert audit(planned, world.autopilot.ram) is None
    assert audit(planned, world.plan.wanted | {"INS_ACCSCAL_X": 0.9}) is None


def test_roll_back_that_had_begun_is_carried_on_even_where_all_six_are_new(world):
    """Killed between the decision to go back and the first write back."""

    def arm_and_die():
        world.feed(VehicleReport(armed=True))
        world.life = 0

    when_written(world, 6, lambda: world.at(world.now + 1.0, arm_and_die))
    assert not world.run_through()
    assert world.holds() == "new"
    (recovery,) = world.journal.recover()
    assert recovery.undo
    assert recovery.all_confirmed
    world.restart()
    assert world.holds() == world.journal_says() == "old"


def test_crash_after_the_last_confirmation_is_finished_and_not_undone(world):
    when_written(world, 6, lambda: world.at(world.now + 1.0, lambda: setattr(world, "life", 0)))
    assert not world.run_through()
    world.restart()
    assert world.outcomes[-1].result is Result.COMPLETED
    assert world.holds() == world.journal_says() == "new"


def test_roll_back_that_is_not_stored_stays_open(world):
    def arm_and_wear_out():
        world.autopilot.full = True
        world.autopilot.places.clear()
        world.feed(VehicleReport(armed=True))

    when_written(world, 3, lambda: world.at(world.now + 0.03, arm_and_wear_out))
    outcome = finish(world)
    assert (outcome.result, outcome.reason) == (Result.INTERRUPTED, Reason.ARMED)
    assert outcome.open
    assert {n: world.autopilot.ram[n] for n in world.plan.names} == world.plan.before


@pytest.mark.parametrize("flies", [False, True])
def test_an_armed_vehicle_that_does_not_answer_is_asked_nothing_any_more(world, flies):
    """Repetitions end with the time that there is for undoing, or at once in the air."""
    ends, sent = [], []
    handle, beat = world.handle, world.beat

    def handled(outputs):
        outputs = tuple(outputs)
        sent.extend(world.now for output in outputs if isinstance(output, SendAction))
        handle(outputs)

    def beaten():
        if world.armed and not flies:
            ends.append(world.now + limits.ARMED_UNDO_S + 0.5)  # the line's delay is in it
        beat()

    def take_off():
        ends.append(world.now)
        world.feed(VehicleReport(armed=True, landed=False))

    def arm_and_hear_no_more():
        world.arm()
        world.autopilot.receive = lambda *_: None
        world.feed(VehicleReport(armed=True, landed=True))
        if flies:
            world.at(world.now + 0.7, take_off)

    world.handle, world.beat = handled, beaten
    when_written(world, 3, arm_and_hear_no_more)
    assert world.run_through()
    (outcome,) = world.outcomes
    assert (outcome.result, outcome.reason) == (Result.INTERRUPTED, Reason.ARMED)
    assert max(sent) <= ends[0]


def test_undoing_that_nobody_answers_ends_at_its_own_deadline(world):
    """Whoever wakes at deadlines alone: no heartbeat, no answer and no report comes any more."""
    armed = []

    def arm_and_go():
        armed.append(world.now)
        world.feed(VehicleReport(armed=True, landed=True))
        world.autopilot.receive = lambda *_: None
        world.autopilot.silent_until = math.inf

    when_written(world, 3, arm_and_go)
    assert world.run_through()
    (outcome,) = world.outcomes
    assert (outcome.result, outcome.reason) == (Result.INTERRUPTED, Reason.ARMED)
    assert world.now - armed[0] == pytest.approx(limits.ARMED_UNDO_S, abs=1e-6)


def test_old_values_that_no_calibration_can_have_made_are_not_written_back(tmp_path):
    """A journal that somebody has changed: half of it is in force, and that is left and told."""
    world = PushWorld(tmp_path / "journal", make_plan(old=((0.3, 1.0, 1.0), OLD[1])), life=30)
    assert not world.run_through()
    assert world.holds() == "mixed"
    written = len(world.autopilot.history)
    world.restart()
    (outcome,) = world.outcomes
    assert outcome.open
    assert "INS_ACCSCAL_X = 0.3" in outcome.sentence
    assert len(world.autopilot.history) == written
