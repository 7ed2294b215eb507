"""Which recordings are of one vehicle, and which of one flight."""

from __future__ import annotations

import pytest

from onboard.answers.fleet.vehicles import vehicles_of
from tests.fleet.records_by_hand import flown


def grouped(recordings, **options):
    return [[f.flown.name for f in v.flights] for v in vehicles_of(recordings, **options)]


def test_a_serial_number_is_a_vehicle_wherever_its_logs_are():
    logs = [flown("b", day=2, folder="/x"), flown("a", day=1, folder="/y"), flown("c", board="ff")]
    assert grouped(logs) == [["a", "b"], ["c"]]
    assert grouped(logs, by_folder=True) == [["a", "b"], ["c"]]


def test_equal_device_ids_prove_nothing():
    """Boards of one model have the same: what is not proven is not merged."""
    logs = [flown("a", board="", day=1), flown("b", board="", day=2)]
    assert grouped(logs) == [["a"], ["b"]]


def test_a_folder_is_a_vehicle_where_a_person_says_so_and_ids_agree():
    logs = [
        flown("a", board="", day=1),
        flown("b", board="", day=2),
        flown("c", board="", day=3, device=8),
        flown("d", board="", day=4, folder="/other"),
    ]
    assert grouped(logs, by_folder=True) == [["a", "b"], ["c"], ["d"]]
    names = [v.name for v in vehicles_of(logs, by_folder=True)]
    assert len(set(names)) == 3


def test_a_flight_that_was_recorded_twice_counts_once_as_the_fuller_one():
    logs = [flown("ground.tlog", trusted=100.0), flown("board.BIN", day=0.001), flown("c", day=1)]
    (vehicle,) = vehicles_of(logs)
    assert [f.flown.name for f in vehicle.counting] == ["board.BIN", "c"]
    assert "board.BIN" in vehicle.flights[0].why


def test_the_same_content_counts_once_even_of_vehicles_that_are_not_known():
    logs = [flown("a", sha256="s"), flown("copy of a", sha256="s", folder="/elsewhere")]
    (vehicle,) = vehicles_of(logs)
    assert [f.flown.name for f in vehicle.counting] == ["a"]
    alone = vehicles_of([flown("a", sha256="s", board=""), flown("b", sha256="s", board="")])
    assert [len(v.counting) for v in alone] == [1, 0]


def test_what_does_not_say_when_it_was_flown_is_not_put_together():
    logs = [flown("a", began=False), flown("b", day=1)]
    (vehicle,) = vehicles_of(logs)
    assert [f.flown.name for f in vehicle.counting] == ["b"]
    (alone,) = vehicles_of([flown("a", began=False)])
    assert len(alone.counting) == 1


@pytest.mark.parametrize("order", [[0, 1, 2], [2, 1, 0], [1, 2, 0]])
def test_flights_are_in_the_order_in_which_they_were_flown(order):
    logs = [flown("x", day=5), flown("y", day=1), flown("z", day=3)]
    (vehicle,) = vehicles_of([logs[i] for i in order])
    assert [f.flown.name for f in vehicle.flights] == ["y", "z", "x"]
