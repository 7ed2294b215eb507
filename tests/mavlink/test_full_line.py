"""A line that is full of samples makes room while parameters are written."""

import pytest

from onboard.mavlink.streams import StreamState
from tests.mavlink.autopilot_peer import StreamingAutopilot
from tests.mavlink.test_streams import world

REQUESTS = [
    ("RAW_IMU", 50.0), ("ATTITUDE", 50.0), ("GPS_RAW_INT", 10.0), ("SYSTEM_TIME", 1.0)
]  # fmt: skip
OFTEN = {"HEARTBEAT": 200.0}
"""While parameters are written it says oftener whether it is armed."""
GRANTED = {"RAW_IMU": 20.0, "ATTITUDE": 20.0, "GPS_RAW_INT": 100.0, "SYSTEM_TIME": 1000.0}


class Narrow(StreamingAutopilot):
    """Drops what the line has no room for: so many messages a second fit."""

    def __init__(self, fits):
        super().__init__()
        self._fits, self._room, self._at = fits, 0.0, 0.0

    def stream(self, now):
        self._room = min(2.0, self._room + self._fits * (now - self._at))
        self._at = now
        sent = []
        for name in super().stream(now):
            if self._room >= 1.0:
                self._room -= 1.0
                sent.append(name)
        return sent


def writing(w, seconds):
    w.streams.writing = lambda: True
    w.run(seconds)
    fewer = dict(w.autopilot.intervals)
    w.streams.writing = lambda: False
    return fewer


@pytest.mark.parametrize("fits", [30.0, 60.0])
def test_samples_make_room_for_parameters_and_come_back(fits):
    w = world(REQUESTS, Narrow(fits))
    w.run(20.0)
    assert w.autopilot.intervals == GRANTED
    few = dict.fromkeys(("RAW_IMU", "ATTITUDE", "GPS_RAW_INT"), 250.0)
    assert writing(w, 5.0) == GRANTED | few | OFTEN
    w.run(10.0)
    assert w.autopilot.intervals == GRANTED


def test_a_line_with_room_is_left_alone():
    w = world(REQUESTS)
    w.run(20.0)
    asked = len(w.autopilot.asked)
    assert writing(w, 5.0) == GRANTED | OFTEN
    w.run(5.0)
    assert {name for name, _ in w.autopilot.asked[asked:]} == set(OFTEN)
    assert w.autopilot.intervals == GRANTED


def test_who_reboots_meanwhile_is_asked_for_everything_when_it_is_written():
    w = world(REQUESTS, Narrow(60.0))
    w.run(20.0)
    writing(w, 1.0)
    w.autopilot.reboot()
    w.streams.start(1, 1, w.now)
    w.run(20.0)
    assert w.autopilot.intervals == GRANTED
    assert StreamState.WAITING not in w.states().values()


def test_who_takes_leave_is_told_what_is_owed_and_gives_it_back():
    w = world(REQUESTS, Narrow(60.0))
    w.run(20.0)
    assert not w.streams.owes
    writing(w, 2.0)
    assert w.streams.owes
    w.exchange(w.streams.parting())  # nobody waits for answers
    assert w.autopilot.intervals == GRANTED
    w.run(5.0)
    assert not w.streams.owes
    assert w.streams.parting() == []


def test_what_is_owed_is_so_until_it_was_granted():
    w = world(REQUESTS, Narrow(60.0))
    w.run(20.0)
    writing(w, 2.0)
    w.streams.start(1, 1, w.now)  # it was silent for a while, and has not rebooted
    assert w.streams.owes
    w.run(20.0)
    assert not w.streams.owes
    assert w.autopilot.intervals == GRANTED


def test_a_lost_question_leaves_nobody_with_the_wrong_number_of_heartbeats():
    w = world(REQUESTS)
    w.run(20.0)
    for often in (True, False):
        taken, heard = w.autopilot.take, []

        def lose_the_first(message, taken=taken, heard=heard):
            heard.append(message)
            return taken(message) if len(heard) > 1 else []

        w.autopilot.take = lose_the_first
        w.streams.writing = lambda often=often: often
        w.run(3.0)
        w.autopilot.take = taken
        assert w.autopilot.intervals == (GRANTED | OFTEN if often else GRANTED)


def test_who_takes_leave_in_the_middle_has_heartbeats_come_as_by_themselves():
    w = world(REQUESTS)
    w.run(20.0)
    w.streams.writing = lambda: True
    w.run(3.0)
    w.exchange(w.streams.parting())
    assert w.autopilot.intervals == GRANTED
