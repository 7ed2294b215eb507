"""A mistake of ours in the estimator: it is said, and nothing else goes down with it."""

from types import SimpleNamespace

import pytest

from onboard.cli.panel import panel
from onboard.core.inputs.samples import ImuSample, ParameterValue, VehicleState
from onboard.daemon.learning import limits
from onboard.daemon.learning.failures import Failures, LearnerError
from onboard.daemon.learning.handover import Handover
from onboard.daemon.learning.identity import Identity
from onboard.daemon.learning.learner import Learner
from onboard.daemon.process.service import Service
from onboard.daemon.view.notices import Notices
from tests.daemon.daemons import in_force, made, notices, push_done, pushed, ticks, until
from tests.daemon.standing_vehicle import Vehicle

pytestmark = pytest.mark.virtual_time


class BrokenError(RuntimeError):
    """What nobody has thought of."""


@pytest.fixture
def broken(monkeypatch):
    """The next ``times`` batches with a sample in them raise, whoever learns them."""
    state = SimpleNamespace(times=0, learners=[], taught=False)
    learn = Learner.learn

    def failing(self, samples, **how):
        samples = list(samples)
        if self not in state.learners:
            state.learners.append(self)
        state.taught = any(isinstance(sample, ImuSample) for sample in samples)
        if state.times and state.taught:
            state.times -= 1
            raise BrokenError("no such thing")
        return learn(self, samples, **how)

    monkeypatch.setattr(Learner, "learn", failing)
    return state


async def test_another_one_takes_its_place_and_all_else_goes_on(document, daemon, port, broken):
    async with Vehicle(port) as vehicle, daemon(document) as service:
        await until(lambda: service.handover.identified)
        old, broken.times = broken.learners[-1], 1
        await until(lambda: notices(service, "learner_failed"))
        (text,) = notices(service, "learner_failed")
        assert "BrokenError: no such thing" in text
        await until(lambda: service.handover.identified and broken.learners[-1] is not old)
        # It knows what the messages mean though nothing was read anew.
        known = broken.learners[-1]._calibrator.parameters.values
        assert known["INS_ACCOFFS_X"] == vehicle.parameters["INS_ACCOFFS_X"]
        snapshot = service.snapshot()
        assert snapshot.link.state == "present"
        assert snapshot.counters["learner_failed"] == 1
        assert not snapshot.link.warnings


async def test_what_was_judged_waits_for_a_flight_or_a_person_as_after_a_restart(
    document, daemon, port, broken
):
    async with Vehicle(port) as vehicle, daemon(document) as service:
        before = await push_done(service, vehicle)
        await until(lambda: service.snapshot().counters.get("saves"))
        await service.handover.save()
        broken.times = 1
        await until(lambda: notices(service, "learner_failed"))
        await until(lambda: service.handover.identified)
        flight = service.handover.learned.flight
        assert flight is not None
        assert not flight.current
        assert pushed(vehicle)
        assert in_force(vehicle) != before


async def test_a_push_under_way_comes_to_its_end(document, daemon, port, broken):
    async with Vehicle(port) as vehicle, daemon(document) as service:
        taken = vehicle._set

        def failing_now(message):
            taken(message)
            if len(vehicle.sets) == 3:
                broken.times = 1

        vehicle._set = failing_now
        await push_done(service, vehicle)
        await until(lambda: notices(service, "learner_failed"))
        assert len(vehicle.sets) == 6
        assert pushed(vehicle)


async def test_one_that_fails_again_and_again_rests_and_what_was_written_can_be_taken_back(
    document, daemon, port, broken, tmp_path
):
    async with Vehicle(port) as vehicle, daemon(document) as service:
        before = await push_done(service, vehicle)
        broken.times = 1000
        await until(lambda: notices(service, "learner_stopped"))
        assert len(notices(service, "learner_failed")) == limits.FAILURES_MAX - 1
        # Without flights there is nothing to fail of.
        left = broken.times
        await until(lambda: service.handover.identified)
        await ticks(service, 20)
        assert broken.times == left == 1000 - limits.FAILURES_MAX

        snapshot = service.snapshot()
        assert snapshot.next_step.severity == "error"
        assert "next flight" in snapshot.next_step.text
        assert snapshot.next_step.text in snapshot.link.warnings
        assert snapshot.next_step.text == service._portrait.sentence(service._clock())
        assert panel(snapshot) is not None
        assert len(notices(service, "learner_stopped")) == 1

        await service.rollback((1,))
        await until(lambda: in_force(vehicle) == before)

        # The next flight is another matter.
        await ticks(service, 20)
        broken.times = 0
        vehicle.armed = True
        await until(lambda: service.snapshot().next_step.severity != "error")
        assert not service.snapshot().link.warnings
        await until(lambda: broken.taught)
        recorded = tmp_path / "state" / "after-failure"
        assert list(recorded.glob("*.tlog"))
    assert sum(path.stat().st_size for path in recorded.glob("*.tlog")) > 0


async def test_what_records_already_goes_on_as_it_does(document, daemon, port, broken, tmp_path):
    document["recording"] = {"enabled": True}
    async with Vehicle(port), daemon(document) as service:
        await until(lambda: service.handover.identified)
        broken.times = 1
        await until(lambda: notices(service, "learner_failed"))
        assert not (tmp_path / "state" / "after-failure").exists()


async def test_one_that_fails_of_nothing_ends_the_service(document, port, broken, monkeypatch):
    """Whoever rests and fails all the same is beyond repair: the service manager begins anew."""

    def failing(*_args, **_how):
        raise BrokenError("no such thing")

    monkeypatch.setattr(Learner, "learn", failing)
    monkeypatch.setattr(Service, "on_tick", lambda self, now: _nothing())
    async with Vehicle(port):
        with pytest.raises(ExceptionGroup) as caught:
            await made(document).run()
    assert caught.group_contains(LearnerError)


async def _nothing():
    return


def test_who_has_judged_a_flight_has_got_over_what_was_before():
    failures = Failures()

    def fails():
        error = LearnerError("the estimator has failed")
        error.__cause__ = BrokenError("again")
        return failures.take(error)[0]

    def judged(flight, *, current=True):
        support = SimpleNamespace(flight=flight)
        failures.judged(SimpleNamespace(flight=SimpleNamespace(current=current, support=support)))

    failures.judged(SimpleNamespace(flight=None))
    for number in range(2 * limits.FAILURES_MAX):
        assert fails() == "learner_failed"
        judged(f"flight {number}")
    judged("kept from before", current=False)
    assert [fails() for _ in range(limits.FAILURES_MAX)][-1] == "learner_stopped"
    assert failures.stopped


def test_who_rests_in_flight_rests_until_it_is_armed_again():
    failures, ours = Failures(), ParameterValue("INS_ACCOFFS_X", 0.1)
    flown = ImuSample(t=1.0, imu=1, f_b=(0.0, 0.0, -9.8))
    for _ in range(limits.FAILURES_MAX):
        error = LearnerError("the estimator has failed")
        error.__cause__ = BrokenError("again")
        failures.take(error)
    states = (True, True, None, False, False)  # armed
    for armed in states:
        state = VehicleState(1.0, armed, landed=None)
        assert failures.left_over([ours, flown, state]) == [ours, state]
    state = VehicleState(2.0, True, landed=None)
    assert failures.left_over([ours, flown, state]) == [ours, flown, state]
    assert not failures.stopped


class Pupil:
    """Fails once, and notes what it is told of who is there."""

    def __init__(self, *, fails):
        self.fails = fails
        self.told = []

    def identify(self, _there, told):
        self.told.append({sample.name for sample in told})

    def gap(self, *, rebooted=False):
        pass

    def learn(self, _samples, **_):
        if self.fails:
            raise BrokenError("no such thing")
        return SimpleNamespace(news=(), diagnosing=(), flight=None)

    def save(self, _saved_at):
        pass


async def test_a_successor_is_told_what_the_one_before_had_heard_once_and_no_other_boards():
    there = SimpleNamespace(
        identity=Identity(1),
        introduced=True,
        judging=(),
        in_flight=False,
        parameters={"INS_ACCOFFS_X": 0.1},
    )
    second = Pupil(fails=False)
    handover = Handover(
        Pupil(fails=True),
        Notices(lambda: 0.0),
        there=there,
        clock=lambda: 0.0,
        wall_clock=lambda: 0.0,
        save_every_s=1e9,
        successor=lambda: second,
    )
    with pytest.raises(LearnerError) as caught:
        await handover.step()
    handover._replace(caught.value)
    await handover.step()
    assert second.told == [{"INS_ACCOFFS_X"}]
    handover.gap()  # what is remembered from here on may be of another board
    await handover.step()
    assert second.told == [{"INS_ACCOFFS_X"}, set()]


async def test_what_cannot_be_shown_ends_nothing(document, daemon, port, monkeypatch):
    def failing(*_):
        raise BrokenError("no such thing")

    sent = []
    async with Vehicle(port) as vehicle, daemon(document) as service:
        monkeypatch.setattr(service._outlets.history, "take", failing)
        monkeypatch.setattr(service._notifier, "send", lambda **fields: sent.append(fields))
        await push_done(service, vehicle)
        await ticks(service, 5)
        assert len(notices(service, "not_shown")) == 1
        assert sent[-1]["WATCHDOG"] == "1"
        assert "cannot be shown" in sent[-1]["STATUS"]
