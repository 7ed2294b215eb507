"""A flight is frozen when it ends, and none of its accelerometers is judged before all are."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from onboard.answers.answer import Answer, diagnosed
from onboard.core.diagnosis.cleared import since_reboot
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.determined import force_moments
from onboard.core.estimate.result import Status
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.samples import ImuSample, ParameterValue, VehicleState
from onboard.daemon.learning import examiner as examiner_module
from onboard.daemon.learning.identity import Identity
from onboard.daemon.learning.learner import Learner
from onboard.daemon.learning.store import Store
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, fly_messages

BOARD = Identity(1, board="0a0b0c")
TWO = (ImuTruth(scale=(1.02, 0.985, 1.015)), ImuTruth(offset=(0.2, -0.15, 0.3)))
SETTINGS = CalibratorSettings(refine=False, buffer_s=65.0)
"""A flight, and the last batch, which may be longer than ten seconds, of one before."""


@pytest.fixture(scope="module")
def flight():
    decoder, out = Decoder(1, 1), []
    for _, message in fly_messages(FlightSpec(vehicle="copter", duration=85.0, imus=TWO)):
        out += decoder.decode(message)
    told = [s for s in out if isinstance(s, ParameterValue)]
    return told + [s for s in out if not isinstance(s, ParameterValue)]


def learner(directory, there=BOARD):
    made = Learner(Store(directory), SETTINGS, clock=lambda: 0.0, wall_clock=lambda: 1e9)
    made.identify(there)
    return made


def until_disarmed(samples):
    armed = [i for i, s in enumerate(samples) if isinstance(s, VehicleState) and s.armed]
    return samples[: armed[-1] + 60], samples[armed[-1] + 60 :]


@pytest.fixture
def seen(monkeypatch):
    """What each diagnosis was given, instead of making it."""
    given = []

    def looked_at(flight, imu, *, latest):
        assert latest
        batches = flight.engine(imu).batches
        given.append((imu, batches[0].fixes.t[0], batches[-1].fixes.t[-1], flight.flown_s))
        raise ArithmeticError("only looking")

    monkeypatch.setattr(examiner_module, "answer", looked_at)
    return given


@pytest.mark.slow
def test_all_accelerometers_are_judged_on_the_same_flight_however_late(flight, tmp_path, seen):
    one = learner(tmp_path)
    one.learn(flight, judging=())
    assert one.examine().diagnosing == (1, 2), "none is judged before all are"
    later = [replace(s, t=s.t + 150.0) for s in flight if s.t is not None]
    ahead = [s for s in later if not isinstance(s, VehicleState)]
    one.learn([VehicleState(151.0, True, False), *ahead], judging=())  # it flies on meanwhile
    last = one.examine()
    assert last.diagnosing == ()
    assert [imu for imu, *_ in seen] == [1, 2]
    assert seen[0][1:] == seen[1][1:]
    # That nothing could be made of it is said, and why; not that it was too short.
    told = [(news.kind, news.text) for news in last.news]
    assert [kind for kind, _ in told] == ["diagnosis_failed", "diagnosis_failed"]
    assert all("ArithmeticError: only looking" in text for _, text in told)


@pytest.mark.slow
def test_being_armed_on_the_ground_is_no_flight_to_be_judged(flight, tmp_path, seen):
    one = learner(tmp_path)
    one.learn(flight, judging=())
    while one.examine().diagnosing:
        pass
    judged = len(seen)
    end = max(s.t for s in flight if s.t is not None)
    last = [s for s in flight if s.t is not None and s.t > end - 10.0]
    for k in (1, 2, 3):
        shifted = [replace(s, t=s.t + 10.0 * k) for s in last]
        armed = [
            replace(s, armed=k == 2) if isinstance(s, VehicleState) and s.armed is not None else s
            for s in shifted
        ]
        learned = one.learn(armed, judging=())
        assert learned.diagnosing == ()
    assert len(seen) == judged == 2


@pytest.mark.slow
def test_a_flight_is_over_when_that_was_heard_also_by_who_came_late(flight, tmp_path, seen):
    """What has landed waits for its diagnosis, but not for one that never comes."""
    one = learner(tmp_path / "one")
    aloft, rest = until_disarmed(flight)
    assert one.learn(aloft, judging=()).flying
    ended = one.learn(rest, judging=())
    assert (ended.flying, ended.diagnosing) == (False, (1, 2))
    other = learner(tmp_path / "other")
    other.learn(aloft, judging=())
    other.reset()
    assert other.learn([s for s in aloft[-9000:] if not isinstance(s, VehicleState)], judging=())
    other._in_air = True  # a batch of flight was made in that last second
    assert not other.learn(rest, judging=()).flying


def calibrated(flight, imu):
    return replace(flight.calibration(imu), status=Status.CALIBRATED)


@pytest.fixture
def believed(monkeypatch):
    """Diagnoses that find nothing, quickly."""

    class Quick:
        def __init__(self, flight, imu):
            self.imu, self.calibration = imu, calibrated(flight, imu)
            self.verdict = type("V", (), {"value": "clean"})
            self.effects = ()

    monkeypatch.setattr(
        examiner_module, "answer", lambda flight, imu, *, latest: Answer(Quick(flight, imu))
    )
    monkeypatch.setattr(examiner_module, "diagnosed", lambda given, _: diagnosed(given, {}))
    monkeypatch.setattr(examiner_module.Examiner, "_document", lambda *_: {})


def judge(one):
    learned = one.examine()
    while learned.diagnosing:
        learned = one.examine()
    return learned


@pytest.mark.slow
def test_each_is_judged_with_what_the_others_felt(flight, tmp_path, believed, monkeypatch):
    one = learner(tmp_path / "one")
    one.learn(flight, judging=())
    judged = {imu: j.diagnosed.calibration for imu, j in judge(one).flight.imus.items()}
    assert {imu: c.together.imus for imu, c in judged.items()} == {1: (1, 2), 2: (1, 2)}
    for c in judged.values():
        load = force_moments(c.load_mean, c.load_square, c.in_force_scale + c.in_force_offset)
        assert np.sum(load * c.best[1]) <= np.sum(load * c.with_its_gyroscope)
    # One whose six were another's for a part of the flight has no say.
    lacking = {2: "it jumps"}
    monkeypatch.setattr(
        examiner_module,
        "diagnosed",
        lambda given, _: replace(diagnosed(given, {}), missing=lacking.get(given.imu, "")),
    )
    other = learner(tmp_path / "other")
    other.learn(flight, judging=())
    for j in judge(other).flight.imus.values():
        assert j.diagnosed.calibration.together is None


@pytest.mark.slow
def test_ten_seconds_of_arming_after_a_restart_lose_no_proposal(flight, tmp_path, believed):
    one = learner(tmp_path)
    one.learn(flight, judging=())
    before = judge(one).flight
    assert before.current
    assert set(before.imus) == {1, 2}
    one.save(1e9)
    two = learner(tmp_path)
    told = [s for s in flight if isinstance(s, ParameterValue)]
    two.learn(told, judging=())
    armed = [VehicleState(5.0, armed=True), VehicleState(15.0, armed=False)]
    after = two.learn(armed, judging=()).flight
    assert after.support == before.support
    assert not after.current
    assert {imu: j.diagnosed.calibration for imu, j in after.imus.items()} == {
        imu: j.diagnosed.calibration for imu, j in before.imus.items()
    }


@pytest.mark.slow
def test_a_flight_that_the_power_went_before_is_said_to_be_lost(flight, tmp_path, believed):
    """Saved in the air, after the landing, and when it has been judged."""
    lost = []
    one = learner(tmp_path)
    aloft, rest = until_disarmed(flight)

    def after_a_start():
        one.save(1e9)
        told = learner(tmp_path).learn((), judging=()).news
        return [news.text for news in told if news.kind == "flight_lost"]

    assert after_a_start() == []
    one.learn(aloft, judging=())
    lost += after_a_start()
    one.learn(rest, judging=())
    lost += after_a_start()
    one.examine()
    assert after_a_start(), "one of two is not yet all of it"
    flown = one.examine().trust.trusted_s
    assert after_a_start() == []
    told = [float(text.split(" s of flight")[0]) for text in lost]
    assert told[0] <= told[1] == round(flown)
    assert told[0] > 30.0


@pytest.mark.slow
def test_other_values_in_force_on_the_same_board_lay_the_sums_aside(flight, tmp_path, believed):
    one = learner(tmp_path)
    one.learn(flight, judging=())
    judge(one)
    one.gap()
    told = [s for s in flight if isinstance(s, ParameterValue)]
    one.identify(BOARD, told)
    assert one.learn((), judging=()).flight.current, "the same board, the same values"
    one.gap()
    changed = [replace(s, value=0.5) if s.name == "INS_ACCOFFS_X" else s for s in told]
    one.identify(BOARD, changed)
    learned = one.learn(changed, judging=())
    assert not learned.flight.current
    assert learned.trust.trusted_s == 0.0


@pytest.mark.slow
def test_another_board_begins_with_what_was_learned_of_it(flight, tmp_path, believed):
    other = Identity(1, board="0d0e0f")
    one = learner(tmp_path)
    one.learn(flight, judging=())
    first = judge(one).flight
    one.gap()
    one.identify(other)
    assert one.learn((), judging=()).flight is None
    one.gap()
    one.identify(BOARD)
    back = one.learn((), judging=()).flight
    assert back.support == first.support
    assert not back.current


@pytest.mark.slow
def test_the_stand_is_not_in_the_frozen_flight(flight, tmp_path, seen):
    one = learner(tmp_path)
    one.learn(flight, judging=())
    one.examine()
    one.examine()
    flown = [s.t for s in flight if isinstance(s, ImuSample)]
    assert seen[0][2] < max(flown) - 10.0, "the recording goes on after the landing"


class Jumped:
    """A diagnosis in which the offset has jumped at a moment of its flight."""

    def __init__(self, flight, imu, at):
        self.imu, self.calibration = imu, calibrated(flight, imu)
        self.verdict = Verdict.CLEAN if at is None else Verdict.EXPLAINED
        unknowns = {"time": SimpleNamespace(value=at)} | dict.fromkeys(
            "xyz", SimpleNamespace(value=0.5)
        )
        self.effects = () if at is None else (SimpleNamespace(name="bias_step", unknowns=unknowns),)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("into_second", "jumps_again", "between"),
    [(-30.0, False, True), (0.2, False, True), (0.2, True, False), (30.0, False, False)],
)
def test_what_has_changed_on_the_ground_has_not_jumped_in_flight(
    flight, tmp_path, monkeypatch, into_second, jumps_again, between
):
    """The last flight is then diagnosed by itself, and what was learned before is forgotten."""
    asked = []

    def found(its, imu, *, latest, since=-math.inf):
        batches = since_reboot(its.engine(imu).batches, since)
        asked.append((imu, since, batches[0].fixes.t[0]))
        second = [b for b in since_reboot(its.engine(imu).batches) if b.fixes.t[0] > 150.0]
        if imu == 2 or not second:
            return Answer(Jumped(its, imu, None))
        if since > 0.0:
            return Answer(
                Jumped(its, imu, 20.0 if jumps_again else None), "jump" if jumps_again else ""
            )
        at = second[0].fixes.t[0] + into_second - batches[0].segment.t[0]
        return Answer(Jumped(its, imu, at), "jump")

    monkeypatch.setattr(examiner_module, "answer", found)
    monkeypatch.setattr(examiner_module, "diagnosed", lambda given, _: diagnosed(given, {}))
    monkeypatch.setattr(examiner_module.Examiner, "_document", lambda *_: {})
    one = learner(tmp_path)
    one.learn(flight, judging=())
    judge(one)
    assert {its.imu for its in one._kept} == {1, 2}
    asked.clear()
    later = [replace(s, t=s.t + 150.0) if s.t is not None else s for s in flight]
    one.learn(later, judging=())
    learned = judge(one)
    first = learned.flight.diagnosed[1]
    assert bool(first.missing) is not between
    assert {its.imu for its in one._kept} == {2}, "sums of two sensors are not kept"
    assert one._calibrator.imus == (2,), "nor gone on with"
    told = [news.text for news in learned.news if news.kind == "begun_anew"]
    assert ["between two flights" in text for text in told] == [between]
    if between:
        (again,) = [(since, start) for imu, since, start in asked if since > 0.0]
        assert again[0] == again[1] > 150.0
        assert "changed on the ground" in first.calibration.note
