from __future__ import annotations

import pytest

from onboard.mavlink import limits
from onboard.mavlink.board import COMMANDS, Board, BoardIdentity
from onboard.mavlink.dialect import mavlink
from tests.mavlink.mavlink_peer import LossyLine, received

UID2 = bytes(range(1, 13)) + bytes(6)
OTHER = bytes(range(31, 43)) + bytes(6)
NEW, OLD = (command for command, _ in COMMANDS)
V4_6_1 = 0x040601FF


def version(uid2=UID2, uid=0, firmware=V4_6_1):
    return mavlink.MAVLink_autopilot_version_message(
        0, firmware, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, uid, list(uid2)
    )


def acknowledged(command, result, target=(1, 191)):
    return mavlink.MAVLink_command_ack_message(command, result, 0, 0, *target)


class Vehicle:
    """An autopilot at the other end of two lines; ``knows`` are the commands it has."""

    def __init__(self, *, knows=(NEW, OLD), uid2=UID2, uid=0, refuses=True, **line) -> None:
        self.board = Board()
        self.knows, self.uid2, self.uid, self.refuses = knows, uid2, uid, refuses
        self.asked: list[int] = []
        self.now = 1000.0
        self._there, self._back = LossyLine(3, **line), LossyLine(4, **line)
        self.board.start(1, 1, self.now)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.1)):
            for question in self._there.carry(self.board.poll(self.now)):
                for answer in self._back.carry(self._answers(question)):
                    assert self.board.feed(answer, self.now + 0.05) == ()
            self.now += 0.1

    def reboot(self, uid2=None) -> None:
        self.uid2 = uid2 if uid2 is not None else self.uid2
        self.board.start(1, 1, self.now)

    def _answers(self, question):
        assert question.get_type() == "COMMAND_LONG"
        self.asked.append(question.command)
        if question.command not in self.knows:
            refusal = acknowledged(question.command, mavlink.MAV_RESULT_UNSUPPORTED)
            return [received(refusal)] if self.refuses else []
        assert question.param1 == dict(COMMANDS)[question.command]
        accepted = acknowledged(question.command, mavlink.MAV_RESULT_ACCEPTED)
        return [received(version(self.uid2, self.uid)), received(accepted)]


def test_it_asks_once_where_it_is_answered():
    vehicle = Vehicle()
    vehicle.run(60.0)
    assert vehicle.asked == [NEW]
    assert vehicle.board.identity == BoardIdentity(UID2.hex(), "4.6.1")
    assert (vehicle.board.uid, vehicle.board.firmware) == (UID2.hex(), "4.6.1")
    assert vehicle.board.answered


def test_nothing_is_known_and_nothing_given_up_before_the_answer():
    board = Board()
    assert (board.uid, board.firmware, board.answered) == ("", "", False)
    assert board.poll(0.0) == ()
    board.start(1, 1, 0.0)
    assert len(board.poll(0.0)) == 1
    assert (board.uid, board.answered) == ("", False)


def test_lost_requests_are_repeated():
    vehicle = Vehicle(loss=0.4)
    vehicle.run(30.0)
    assert len(vehicle.asked) > 1
    assert vehicle.board.uid == UID2.hex()


def test_old_firmware_that_refuses_the_new_command_is_asked_with_the_old_one():
    vehicle = Vehicle(knows=(OLD,))
    vehicle.run(1.0)
    assert vehicle.asked == [NEW, OLD]
    assert vehicle.board.uid == UID2.hex()


def test_old_firmware_that_ignores_the_new_command_is_asked_with_the_old_one():
    vehicle = Vehicle(knows=(OLD,), refuses=False)
    vehicle.run(30.0)
    assert vehicle.asked == [NEW] * 4 + [OLD]
    assert vehicle.board.uid == UID2.hex()


@pytest.mark.parametrize("refuses", [True, False])
def test_an_autopilot_that_has_neither_is_given_up_until_it_starts_again(refuses):
    vehicle = Vehicle(knows=(), refuses=refuses)
    vehicle.run(8.0)
    assert vehicle.board.answered == refuses
    vehicle.run(600.0)
    assert vehicle.board.answered
    assert vehicle.board.identity is None
    assert vehicle.asked == ([NEW, OLD] if refuses else [NEW] * 4 + [OLD] * 4)
    vehicle.knows = (NEW, OLD)
    vehicle.reboot()
    assert not vehicle.board.answered
    vehicle.run(1.0)
    assert vehicle.board.uid == UID2.hex()


def test_what_another_station_asked_for_is_taken_even_after_giving_up():
    vehicle = Vehicle(knows=())
    vehicle.run(10.0)
    vehicle.board.feed(received(version()), vehicle.now)
    assert vehicle.board.uid == UID2.hex()


def test_a_short_id_stands_in_for_a_long_one_that_is_not_filled_in():
    vehicle = Vehicle(uid2=bytes(18), uid=0xAB12)
    vehicle.run(1.0)
    assert vehicle.board.uid == "000000000000ab12"


def test_zeros_are_no_identity():
    """Else all boards that tell none would be one and the same board."""
    vehicle = Vehicle(uid2=bytes(18))
    vehicle.run(1.0)
    assert (vehicle.board.uid, vehicle.board.answered) == ("", True)
    assert vehicle.board.firmware == "4.6.1"


def test_another_board_behind_a_reboot_is_not_taken_for_the_old_one():
    vehicle = Vehicle()
    vehicle.run(1.0)
    vehicle.reboot(OTHER)
    assert (vehicle.board.uid, vehicle.board.answered) == ("", False)
    vehicle.run(1.0)
    assert vehicle.board.uid == OTHER.hex()


def test_other_vehicles_and_components_do_not_answer_for_the_autopilot():
    board = Board()
    board.start(1, 1, 0.0)
    board.poll(0.0)
    board.feed(received(version(OTHER), system=2), 0.1)
    board.feed(received(version(OTHER), component=100), 0.1)
    board.feed(received(acknowledged(NEW, mavlink.MAV_RESULT_DENIED), system=2), 0.1)
    assert not board.answered
    assert board.poll(0.2) == (), "a stranger's refusal is none"
    board.feed(received(version()), 0.3)
    assert board.uid == UID2.hex()


def test_refusals_of_other_commands_or_to_other_stations_are_not_ours():
    board = Board()
    board.start(1, 1, 0.0)
    board.poll(0.0)
    board.feed(received(acknowledged(NEW, mavlink.MAV_RESULT_DENIED, (255, 190))), 0.1)
    board.feed(received(acknowledged(511, mavlink.MAV_RESULT_DENIED)), 0.1)
    board.feed(received(acknowledged(NEW, mavlink.MAV_RESULT_ACCEPTED)), 0.1)
    assert board.poll(0.2) == ()


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (0, ""),
        (0x04050700, "4.5.7-dev"),
        (0x04060080, "4.6.0-beta"),
        (0x040602C0, "4.6.2-rc"),
        (V4_6_1, "4.6.1"),
    ],
)
def test_the_firmware_is_told_as_people_know_it(number, text):
    board = Board()
    board.start(1, 1, 0.0)
    board.feed(received(version(firmware=number)), 0.1)
    assert board.firmware == text


class Two(Vehicle):
    """Another autopilot, with the same system id, hears every question, too, from ``since`` on."""

    def __init__(self, since=0.0, until=1e9, **more) -> None:
        super().__init__(**more)
        self._from, self._to = self.now + since, self.now + until

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds)):
            self.board.confirm(self.now)
            super().run(1.0)

    def _answers(self, question):
        answers = super()._answers(question)
        if self._from <= self.now < self._to and question.command in self.knows:
            answers = [*answers, received(version(OTHER))]
        return answers


@pytest.mark.parametrize("knows", [(NEW, OLD), (OLD,)])
@pytest.mark.parametrize("since", [0.0, 45.0])
@pytest.mark.parametrize("line", [{}, {"duplication": 1.0}], ids=["clean", "every packet twice"])
def test_two_boards_under_one_system_id_are_found_and_forgotten_when_one_has_gone(
    knows, since, line
):
    vehicle = Two(since=since, until=since + 90.0, knows=knows, **line)
    vehicle.run(max(since - 1.0, 0.0))
    assert not vehicle.board.are_two(vehicle.now)
    vehicle.run(2.0 * limits.BOARD_ASKED_S)
    assert vehicle.board.are_two(vehicle.now)
    vehicle.run(90.0 + limits.TWO_BOARDS_S + limits.BOARD_ASKED_S)
    assert not vehicle.board.are_two(vehicle.now)


def test_one_that_is_asked_now_and_then_is_one():
    vehicle = Two(since=1e9, until=2e9)
    vehicle.run(300.0)
    assert vehicle.asked == [NEW] * len(vehicle.asked)
    assert 5 <= len(vehicle.asked) <= 300.0 / limits.BOARD_ASKED_S + 1
    assert not vehicle.board.are_two(vehicle.now)
    assert vehicle.board.uid == UID2.hex()


def test_a_late_answer_of_before_a_reboot_is_of_no_second_board():
    vehicle = Two(since=1e9, until=2e9)
    vehicle.run(5.0)
    vehicle.reboot(uid2=OTHER)
    assert vehicle.board.feed(received(version(UID2)), vehicle.now) == ()
    vehicle.run(200.0)
    assert vehicle.board.uid == OTHER.hex()
    assert not vehicle.board.are_two(vehicle.now)


def test_any_number_of_ids_takes_few_questions():
    board = Board()
    board.start(1, 1, 0.0)
    asked = 0
    for n in range(10_000):
        board.feed(received(version(uid2=bytes(18), uid=n + 1)), 0.01 * n)
        asked += len(board.poll(0.01 * n))
    assert asked <= 101
