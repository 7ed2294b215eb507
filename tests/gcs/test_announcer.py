"""What a pilot hears: chosen, short, paced, and never out of date."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.daemon.outlets.announcer import LINES, TEXT_LENGTH, Announcer, statustext
from onboard.daemon.outlets.limits import FLAPPING_S, INTERVAL_S, WAITING_MAX
from onboard.daemon.view.snapshot import Notice
from onboard.mavlink.codec import Codec

WARNING, NOTICE, INFO, ERROR = 4, 5, 6, 3


class Cockpit:
    """An announcer with a clock of its own."""

    def __init__(self):
        self.now = 100.0
        self.announcer = Announcer(lambda: self.now)
        self.heard = []

    def post(self, kind, text="", *, after=0.0):
        self.pass_time(after)
        self.announcer.hear(Notice(at=0.0, kind=kind, text=text))

    def pass_time(self, seconds):
        end = self.now + seconds
        while self.now < end:
            self.now += 0.1
            for message in self.announcer.poll(self.now):
                (frame,) = Codec().feed(Codec().encode(message))
                self.heard.append((self.now, frame.message.severity, frame.message.text))

    @property
    def texts(self):
        return [text for _, _, text in self.heard]


def test_a_flight_as_the_pilot_hears_it():
    cockpit = Cockpit()
    cockpit.post("window_opened", "GPS is trusted: ready to learn in flight")
    cockpit.post("calibrated", "IMU 1 is calibrated", after=120.0)
    cockpit.post("window_closed", "GPS is not trusted: end of data", after=60.0)
    cockpit.post("push_begins", "IMU 1: push begins", after=10.0)
    cockpit.post("push_completed", "IMU 1: push completed: all six read back", after=5.0)
    cockpit.pass_time(10.0)
    assert cockpit.texts == [
        "OBC: GPS trusted, learns in flight",
        "OBC: IMU 1 is calibrated",
        "OBC: GPS is not trusted: end of data",
        "OBC: IMU 1 writing calibration",
        "OBC: IMU 1 calibration written",
    ]
    assert [severity for _, severity, _ in cockpit.heard] == [INFO, NOTICE, NOTICE, INFO, NOTICE]


@pytest.mark.parametrize(
    ("kind", "severity"),
    [
        ("push_rolled_back", WARNING),
        ("push_interrupted", ERROR),
        ("imu_stuck", ERROR),
        ("push_worse", WARNING),
        ("physics_missing", WARNING),
        ("worth_knowing", INFO),
        ("roll_back_completed", NOTICE),
        ("invalid", WARNING),
    ],
)
def test_news_sound_as_bad_as_they_are(kind, severity):
    cockpit = Cockpit()
    cockpit.post(kind, "IMU 2: something")
    cockpit.pass_time(1.0)
    ((_, heard, _),) = cockpit.heard
    assert heard == severity


def test_what_is_for_logs_is_not_for_pilots():
    cockpit = Cockpit()
    for kind in ("autopilot_found", "state_resumed", "mqtt_lost", "mqtt_connected", "unheard of"):
        cockpit.post(kind, "something")
    cockpit.pass_time(60.0)
    assert cockpit.heard == []


def test_the_worst_comes_first_and_the_pace_is_kept():
    cockpit = Cockpit()
    cockpit.post("push_begins", "IMU 1: push begins")
    cockpit.post("calibrated", "IMU 2 is calibrated")
    cockpit.post("push_interrupted", "IMU 3: push interrupted")
    cockpit.pass_time(30.0)
    assert [severity for _, severity, _ in cockpit.heard] == [ERROR, NOTICE, INFO]
    times = [at for at, _, _ in cockpit.heard]
    assert all(b - a >= INTERVAL_S - 1e-6 for a, b in itertools.pairwise(times))


def test_a_window_that_flaps_is_not_a_stream_of_messages():
    cockpit = Cockpit()
    for _ in range(300):
        cockpit.post("window_opened", "GPS is trusted: ready to learn in flight", after=0.5)
        cockpit.post("window_closed", "GPS is not trusted: hdop", after=0.5)
    cockpit.pass_time(60.0)
    assert len(cockpit.heard) <= 1 + 360.0 / FLAPPING_S
    assert cockpit.texts[-1] == "OBC: GPS is not trusted: hdop"


def test_the_last_word_on_the_window_is_true():
    cockpit = Cockpit()
    cockpit.post("window_opened", "GPS is trusted: ready to learn in flight")
    cockpit.post("window_closed", "GPS is not trusted: hdop", after=20.0)
    cockpit.post("window_opened", "GPS is trusted: ready to learn in flight", after=2.0)
    cockpit.pass_time(60.0)
    # Said again although it has been said shortly before: something else was said between.
    assert cockpit.texts == [
        "OBC: GPS trusted, learns in flight",
        "OBC: GPS is not trusted: hdop",
        "OBC: GPS trusted, learns in flight",
    ]


def test_what_is_over_before_it_could_be_said_is_not_said():
    cockpit = Cockpit()
    cockpit.post("window_opened", "GPS is trusted: ready to learn in flight")
    cockpit.pass_time(1.0)
    cockpit.post("window_closed", "GPS is not trusted: hdop")
    cockpit.post("window_opened", "GPS is trusted: ready to learn in flight", after=1.0)
    cockpit.pass_time(60.0)
    assert cockpit.texts == ["OBC: GPS trusted, learns in flight"]


def test_the_same_line_is_not_said_all_the_time():
    cockpit = Cockpit()
    for _ in range(20):
        cockpit.post("parameter_denied", "OBC_STATE: is read-only", after=1.0)
    cockpit.pass_time(10.0)
    assert len(cockpit.heard) == 1
    cockpit.post("parameter_denied", "OBC_STATE: is read-only", after=60.0)
    cockpit.pass_time(10.0)
    assert len(cockpit.heard) == 2


def test_of_too_much_the_least_severe_is_lost():
    cockpit = Cockpit()
    cockpit.post("push_interrupted", "IMU 1")
    for number in range(30):
        cockpit.post("parameter_done", f"done {number}")
    cockpit.pass_time(200.0)
    assert len(cockpit.heard) == WAITING_MAX
    assert cockpit.heard[0][1] == ERROR
    assert cockpit.announcer.counters["texts_dropped"] == 31 - WAITING_MAX


@settings(deadline=None)
@given(st.text(max_size=200))
def test_any_sentence_fits(sentence):
    text = statustext(sentence)
    assert len(text.encode("ascii")) <= TEXT_LENGTH
    assert text.startswith("OBC: ")


def test_wordings_of_our_own_are_not_cut():
    for kind, line in LINES.items():
        text = line.text.replace("{imu}", "IMU 1")
        assert statustext(text) == f"OBC: {text}", kind
