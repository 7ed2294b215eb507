"""A push from its plan to its end: what is written, in which order, and what stops it before."""

import pytest

from onboard.errors import PushError
from onboard.mavlink.parameter_messages import SendParamSet, ValueReceived
from onboard.push.entries import Closed, Planned, Purpose, ReadBack, Result, Writing
from onboard.push.signals import JournalWritten, LinkLost, Reason, VehicleReport
from onboard.push.states import State
from onboard.push.transaction import PushTransaction
from tests.push.pushing import PushWorld, finish, make_plan, when_written


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


def test_stale_value_in_the_middle_is_not_taken_for_a_change(world):
    when_written(world, 2, lambda: world.feed(ValueReceived("INS_ACCOFFS_Z", 0.9)))
    assert finish(world).result is Result.COMPLETED


def test_another_device_that_is_only_said_in_the_middle_changes_nothing(world):
    """A packet of before, or of somebody else: the vehicle itself is asked, and says the same."""
    when_written(world, 2, lambda: world.feed(ValueReceived("INS_ACC_ID", 5e6)))
    assert finish(world).result is Result.COMPLETED


def test_another_device_in_the_middle_ends_the_push(world):
    def swapped():
        world.autopilot.ram["INS_ACC_ID"] = 5e6
        world.feed(ValueReceived("INS_ACC_ID", 5e6))

    when_written(world, 2, swapped)
    outcome = finish(world)
    assert outcome.result is not Result.COMPLETED
    assert len({name for name, _ in world.autopilot.history}) < 6


def test_a_second_copy_of_what_was_written_is_no_change(world):
    first = world.plan.write_order(world.plan.before)[0]
    again = ValueReceived(first, world.plan.wanted[first])
    when_written(world, 3, lambda: world.feed(again))
    assert finish(world).result is Result.COMPLETED


def test_a_written_value_that_a_station_sets_back_is_noticed_before_the_rest_is_written(world):
    first = world.plan.write_order(world.plan.before)[0]

    def set_back():
        world.autopilot.ram[first] = world.plan.before[first]
        world.feed(ValueReceived(first, world.plan.before[first]))

    when_written(world, 3, set_back)
    outcome = finish(world)
    assert (outcome.result, outcome.reason) == (Result.ROLLED_BACK, Reason.CHANGED_BY_OTHER)
    forwards = [e.name for _, e in world.journal.entries if isinstance(e, Writing) and not e.undo]
    assert len(forwards) < 6


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
