import pytest

from onboard.errors import PushError
from onboard.mavlink.parameter_messages import SendParamSet, ValueReceived
from onboard.push.entries import Closed, Planned, Purpose, ReadBack, Result, Writing, audit
from onboard.push.limits import UNCHANGED
from onboard.push.signals import (
    Cancelled,
    JournalWritten,
    LinkLost,
    Reason,
    Rebooted,
    VehicleReport,
)
from onboard.push.states import FORWARD, TRANSITIONS, State, Trigger
from onboard.push.transaction import PushTransaction
from tests.push.pushing import NEW, OLD, PushWorld, make_plan


@pytest.fixture(params=["eager", "patient"])
def world(tmp_path, request):
    w = PushWorld(tmp_path / "journal.jsonl")
    w.eager = request.param == "eager"
    yield w
    w.journal.close()


def finish(world, **kwargs):
    assert world.run_through(**kwargs)
    (outcome,) = world.outcomes
    assert world.only_allowed_names_were_written()
    assert all(
        not all(abs(state[n]) < UNCHANGED for n in world.plan.names[3:])
        for state in world.autopilot.states
    )
    return outcome


def when_written(world, count, what):
    """Call ``what`` just after the autopilot has taken ``count`` writes."""
    original = world.autopilot.receive

    def receive(action, now):
        before = len(world.autopilot.history)
        original(action, now)
        if before < count <= len(world.autopilot.history):
            world.at(now, what)

    world.autopilot.receive = receive


def test_all_six_are_written_stored_and_read_back(world):
    outcome = finish(world)
    assert outcome.result is Result.COMPLETED
    assert outcome.values == world.plan.wanted
    assert world.holds() == world.journal_says() == "new"
    entries = [e for _, e in world.journal.entries]
    assert isinstance(entries[0], Planned)
    assert isinstance(entries[-1], Closed)
    assert {e.name for e in entries if isinstance(e, ReadBack)} == set(world.plan.names)
    assert world.journal.recover() == ()


def test_each_write_is_journalled_before_it_leaves(world):
    finish(world)
    writes = [e.name for _, e in world.journal.entries if isinstance(e, Writing)]
    sent = [o.name for o in world.sent if isinstance(o, SendParamSet)]
    assert writes == sent == list(world.plan.write_order(world.plan.before))


def test_scale_and_offset_of_an_axis_follow_each_other(world):
    finish(world)
    order = [o.name[-1] for o in world.sent if isinstance(o, SendParamSet)]
    assert order[0] == order[1]
    assert order[2] == order[3]
    assert order[4] == order[5]


def test_values_that_stay_are_not_written(tmp_path):
    new = ((1.013, 1.0, 1.0), (0.15, -0.03, 0.04))
    world = PushWorld(tmp_path / "j", make_plan(new=new))
    assert finish(world).result is Result.COMPLETED
    assert sorted(n for n, _ in world.autopilot.history) == ["INS_ACCOFFS_X", "INS_ACCSCAL_X"]


def test_current_values_that_are_not_the_plans_abort_before_anything_is_written(world):
    world.autopilot.ram["INS_ACCOFFS_Z"] = 0.5
    outcome = finish(world)
    assert (outcome.result, outcome.reason) == (Result.ABORTED, Reason.CHANGED_BY_OTHER)
    assert not outcome.open
    assert world.autopilot.history == []
    assert "INS_ACCOFFS_Z" in outcome.sentence


def test_another_accelerometer_is_not_written(world):
    world.autopilot.ram["INS_ACC_ID"] = 3000002.0
    outcome = finish(world)
    assert (outcome.result, outcome.reason) == (Result.ABORTED, Reason.OTHER_VEHICLE)
    assert world.autopilot.history == []


@pytest.mark.parametrize(("system", "board"), [(2, ""), (1, "beef")])
def test_another_airframe_is_not_even_asked(tmp_path, system, board):
    world = PushWorld(tmp_path / "j", make_plan(board="cafe"))
    outcome = finish(world, system_id=system, board=board)
    assert (outcome.result, outcome.reason) == (Result.ABORTED, Reason.OTHER_VEHICLE)
    assert world.sent == []


@pytest.mark.parametrize("name", make_plan().names)
def test_denial_of_any_of_the_six_rolls_back(world, name):
    world.autopilot.denied.add(name)
    outcome = finish(world)
    assert (outcome.result, outcome.reason) == (Result.ROLLED_BACK, Reason.DENIED)
    assert world.holds() == world.journal_says() == "old"


def test_silence_of_one_name_rolls_back(world):
    """E.g. a firmware that dropped the parameter: the set gets no reply."""
    original = world.autopilot.receive
    world.autopilot.receive = lambda action, now: (
        None
        if isinstance(action, SendParamSet) and action.name == "INS_ACCOFFS_Z"
        else original(action, now)
    )
    outcome = finish(world)
    assert outcome.result is Result.ROLLED_BACK
    assert world.holds() == "old"


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


def test_no_write_before_the_journal_has_confirmed(world):
    """Rule one, at the transaction's own border: a driver that never confirms."""
    transaction = PushTransaction(world.plan, identifier="t", system_id=1)
    outputs = list(transaction.start(0.0))
    for name in (*world.plan.names, world.plan.device_id_name):
        outputs += transaction.feed(ValueReceived(name, world.autopilot.ram[name]), 0.1)
    assert transaction.state is State.RECORDING
    for second in range(1, 200):
        outputs += transaction.tick(float(second))
    assert not any(isinstance(o, SendParamSet) for o in outputs)


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


def test_stale_value_in_the_middle_is_not_taken_for_a_change(world):
    when_written(world, 2, lambda: world.feed(ValueReceived("INS_ACCOFFS_Z", 0.9)))
    assert finish(world).result is Result.COMPLETED


def test_roll_back_is_the_plan_reversed(world):
    finish(world)
    back = PushWorld(world.path.with_name("second"), world.plan.reversed())
    outcome = finish(back, purpose=Purpose.ROLL_BACK)
    assert outcome.result is Result.COMPLETED
    assert {n: back.autopilot.ram[n] for n in back.plan.names} == world.plan.before
    assert back.journal.last_completed(1) is None


def test_second_and_fourth_accelerometer(tmp_path):
    for imu in (2, 4):
        world = PushWorld(tmp_path / str(imu), make_plan(imu=imu))
        world.autopilot.ram[world.plan.device_id_name] = world.plan.vehicle.device_id
        assert finish(world).result is Result.COMPLETED


def test_starting_twice_is_our_bug(world):
    transaction = world.push()
    with pytest.raises(PushError):
        transaction.start(0.0)


def test_after_the_end_nothing_happens(world):
    transaction = world.push()
    world.run(stop=lambda: world.client is None)
    assert transaction.state is State.FINISHED
    assert transaction.feed(LinkLost(), 100.0) == ()
    assert transaction.tick(1e6) == ()
    assert transaction.next_deadline() is None


class TestTable:
    """The machine as data."""

    def test_every_state_leads_to_the_end(self):
        reach = {State.FINISHED}
        while True:
            more = {s for s, t in TRANSITIONS.items() if set(t.values()) & reach} | reach
            if more == reach:
                break
            reach = more
        assert reach == set(State)

    def test_trouble_after_the_first_write_turns_back_and_nothing_turns_forward(self):
        for state in (State.WRITING, State.SETTLING, State.VERIFYING):
            assert TRANSITIONS[state][Trigger.TROUBLE] is State.INSPECTING
        for state in (State.UNDOING, State.UNDO_SETTLING, State.UNDO_VERIFYING):
            assert not set(TRANSITIONS[state].values()) & FORWARD
        assert TRANSITIONS[State.INSPECTING][Trigger.ALL_NEW] is State.SETTLING
        assert State.WRITING not in TRANSITIONS[State.INSPECTING].values()

    def test_writing_is_entered_only_from_a_durable_plan(self):
        into = [
            (s, t) for s, row in TRANSITIONS.items() for t, to in row.items() if to is State.WRITING
        ]
        assert into == [(State.RECORDING, Trigger.DURABLE)]


class TestOffsetsNeverAllZero:
    @pytest.mark.parametrize(
        ("old", "new"),
        [
            ((0.1, 0.0, 0.0), (0.0, 0.2, 0.0)),
            ((0.0, 0.0, 0.3), (0.0, 0.1, 0.0)),
            ((0.1, 0.2, 0.0), (0.0, 0.0, -0.5)),
            ((0.0, 0.0, 0.0), (0.0, 0.0, -0.5)),
        ],
    )
    @pytest.mark.parametrize("deny", [None, "INS_ACCSCAL_X"])
    def test_on_the_way_there_and_back(self, tmp_path, old, new, deny):
        world = PushWorld(tmp_path / "j", make_plan((OLD[0], old), (NEW[0], new)))
        if deny:
            world.autopilot.denied.add(deny)
        assert world.run_through()
        zero = [not any(s[n] for n in world.plan.names[3:]) for s in world.autopilot.states]
        # Only the old values themselves may be zero: at the beginning, and after a roll-back.
        if any(old):
            assert not any(zero)
        else:
            inner = zero[zero.index(False) :] if False in zero else []
            assert inner.count(True) == (1 if deny else 0) or not any(inner)
        assert world.holds() == ("old" if deny else "new")


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


def test_roll_back_beside_somebody_elses_zero_leaves_an_offset(tmp_path):
    """Old (0.1, 0, 0); another station zeroes x meanwhile: undoing y would leave three zeros."""
    world = PushWorld(
        tmp_path / "j", make_plan((OLD[0], (0.1, 0.0, 0.0)), (NEW[0], (0.2, 0.3, 0.0)))
    )
    when_written(world, 4, lambda: world.autopilot.set_by_other("INS_ACCOFFS_X", 0.0, world.now))
    outcome = finish(world)
    assert outcome.result is Result.ROLLED_BACK
    assert outcome.left == ("INS_ACCOFFS_X", "INS_ACCOFFS_Y")
    scales = world.plan.names[:3]
    assert all(world.autopilot.ram[n] == world.plan.before[n] for n in scales)


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


def test_abort_before_the_first_write_ends_only_when_it_is_written_down(world):
    transaction = PushTransaction(world.plan, identifier="t", system_id=1)
    transaction.start(0.0)
    for name in (*world.plan.names, world.plan.device_id_name):
        transaction.feed(ValueReceived(name, world.autopilot.ram[name]), 0.1)
    (record,) = transaction.feed(VehicleReport(armed=True), 0.2)
    assert record.entry.result is Result.ABORTED
    assert transaction.feed(JournalWritten(), 0.3) == ()  # of the plan
    (finished,) = transaction.feed(JournalWritten(), 0.4)  # of the end
    assert finished.outcome.result is Result.ABORTED
    assert not finished.outcome.open


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


def test_however_often_time_is_told_nothing_is_believed_before_late_packets_have_come(world):
    """A driver ticks when it likes, not only when something is due."""
    transaction, entered = world.push(), {}
    while world.client is not None:
        entered.setdefault(transaction.state, world.now)
        until = world.now + 0.05
        world.run(until=until)
        if world.client is not None:
            world.handle(transaction.tick(world.now))
    assert entered[State.VERIFYING] - entered[State.SETTLING] >= 1.9
    assert world.outcomes[0].result is Result.COMPLETED
