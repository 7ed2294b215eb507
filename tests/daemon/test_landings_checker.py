"""The soak's checker finds what it is there to find."""

from types import SimpleNamespace

import msgspec
import pytest

from benchmarks.landings.boards import Board, names
from benchmarks.landings.checker import Checker
from benchmarks.landings.history import Approval, Flight, History
from sitl.builtin.truth import ImuTruth

IMU = ImuTruth(scale=(1.02, 0.99, 1.01), offset=(0.2, -0.1, 0.15))
BOARD = Board("A", "a" * 36, (IMU,))
OTHER = Board("B", "b" * 36, (ImuTruth(),))
BEFORE = dict.fromkeys(names(1)[:3], 1.0) | dict.fromkeys(names(1)[3:], 0.001)
X = names(1)[0]


class Scene:
    """A flight from 100 to 200, a diagnosis at 210, and a push when the test says so."""

    def __init__(self, tmp_path):
        self.now = 220.0
        self.room = SimpleNamespace(
            autopilot=SimpleNamespace(armed=False), unix=lambda: self.now, failed=False
        )
        self.history = History(BOARD, daemon_started=10.0, powered=5.0)
        self.history.flights.append(Flight(1, BOARD, 100.0, dict(BEFORE), landed=200.0))
        self.journal = tmp_path / "journal.jsonl"
        self.checker = Checker(self.room, self.history, self.journal)
        self.support = {"flight": "f1", "landed_at": 200.0, "board": BOARD.uid, "approved": False}
        self.wanted = BOARD.truth()

    def note(self, **entry):
        line = {"schema": 1, "at": self.now, "check": 0, "entry": entry}
        with self.journal.open("ab") as file:
            file.write(msgspec.json.encode(line) + b"\n")

    def push(self, *, diagnosed=True, writes=True, board=BOARD.uid):
        if diagnosed:
            self.note(type="found", imu=1)
        changes = [
            {"name": n, "before": BEFORE[n], "wanted": w, "sigma": 0.002, "kept": False}
            for n, w in self.wanted.items()
        ]
        plan = {"imu": 1, "vehicle": {"board": board}, "changes": changes}
        self.note(type="planned", transaction="t", plan=plan, support=self.support)
        self.note(type="writing", transaction="t", undo=False)
        self.checker.look()
        if writes:
            self.checker.parameter_set(X, self.wanted[X])

    @property
    def broken(self):
        return sorted({fault[1] for fault in self.checker.faults})


@pytest.fixture
def scene(tmp_path):
    return Scene(tmp_path)


def test_a_push_that_a_flight_supports_is_right(scene):
    scene.push()
    assert scene.checker.faults == []
    assert scene.checker.checked[1] > 6


def test_numbers_of_another_board_are_found(scene):
    scene.history.board = OTHER
    scene.history.flights[-1].board = OTHER
    scene.support["board"] = OTHER.uid
    scene.push(board=OTHER.uid)
    assert scene.broken == ["1"]


def test_a_board_that_is_changed_in_the_middle_of_a_push_is_found(scene):
    scene.push(writes=False)
    scene.history.board = OTHER
    scene.checker.parameter_set(X, 1.0)
    assert "1" in scene.broken


@pytest.mark.parametrize("what", ["daemon_started", "powered"])
def test_a_flight_before_the_last_start_supports_nothing(scene, what):
    setattr(scene.history, what, 205.0)
    scene.push()
    assert scene.broken == ["2"]


def test_a_flight_with_other_values_in_force_supports_nothing(scene):
    scene.history.flights[-1].in_force[X] = 1.01
    scene.push()
    assert scene.broken == ["2"]


def test_a_push_that_names_no_flight_is_found(scene):
    scene.support = None
    scene.push()
    assert scene.broken == ["2"]


def test_an_approval_that_nobody_gave_is_found(scene):
    scene.support["approved"] = True
    scene.push()
    assert scene.broken == ["2"]


def test_a_person_may_approve_what_no_flight_supports(scene):
    scene.history.daemon_started = 205.0
    scene.support["approved"] = True
    shown = {name: (BEFORE[name], scene.wanted[name]) for name in BEFORE}
    scene.history.approvals.append(Approval(215.0, BOARD, 1, shown))
    scene.push()
    assert scene.checker.faults == []


def test_an_approval_is_of_the_values_in_force_that_were_shown(scene):
    scene.history.daemon_started = 205.0
    scene.support["approved"] = True
    shown = {name: (BEFORE[name] + 0.01, scene.wanted[name]) for name in BEFORE}
    scene.history.approvals.append(Approval(215.0, BOARD, 1, shown))
    scene.push()
    assert scene.broken == ["2"]


def test_a_write_while_armed_is_found(scene):
    scene.push(writes=False)
    scene.room.autopilot.armed = True
    scene.checker.look()
    scene.now += 5.0
    scene.checker.parameter_set(X, 1.02)
    assert scene.broken == ["3"]


def test_what_a_vehicle_had_when_it_was_armed_may_be_given_back(scene):
    scene.push()
    scene.room.autopilot.armed = True
    scene.note(type="writing", transaction="t", undo=True)
    scene.checker.look()
    scene.now += 5.0
    scene.checker.parameter_set(X, 1.0)
    assert scene.checker.faults == []


def test_overwriting_what_somebody_else_set_is_found(scene):
    scene.history.set_by_other(215.0, [X])
    scene.push()
    assert scene.broken == ["4"]


def test_a_flight_since_allows_to_overwrite_it(scene):
    scene.history.set_by_other(50.0, [X])
    scene.push()
    assert scene.checker.faults == []


def test_a_push_before_the_diagnosis_is_found(scene):
    scene.push(diagnosed=False)
    assert scene.broken == ["5"]


def test_a_write_outside_of_any_push_is_found(scene):
    scene.checker.parameter_set(X, 1.02)
    assert scene.broken == ["2"]
