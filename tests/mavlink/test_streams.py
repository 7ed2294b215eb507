from __future__ import annotations

import pytest

from onboard.mavlink.dialect import MESSAGE_IDS, mavlink
from onboard.mavlink.streams import DEFAULT_STREAMS, StreamRequest, Streams, StreamState
from tests.mavlink.autopilot_peer import StreamingAutopilot
from tests.mavlink.mavlink_peer import LossyLine, received

STEP = 0.004


def blank(name):
    """A message of that name, all zeros, as received from the autopilot."""
    kind = mavlink.mavlink_map[MESSAGE_IDS[name]]
    sender = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    message = mavlink.MAVLink_message(kind.id, kind.msgname)
    return sender.decode(
        bytearray(message._pack(sender, kind.crc_extra, bytes(kind.unpacker.size)))
    )


class World:
    """Streams and autopilot joined by two lines that may lose, double and reorder."""

    def __init__(self, streams: Streams, autopilot: StreamingAutopilot, **line) -> None:
        self.streams, self.autopilot = streams, autopilot
        self.there, self.back = LossyLine(1, **line), LossyLine(2, **line)
        self.now = 100.0
        self._blank = {name: blank(name) for name in (*streams.names, "HEARTBEAT")}
        streams.start(1, 1, self.now)

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        next_poll = self.now
        while self.now < end:
            if self.now >= next_poll:
                self.exchange(self.streams.poll(self.now))
                next_poll += 0.1
            for name in self.autopilot.stream(self.now):
                self.exchange(self.streams.feed(self._blank[name], self.now))
            self.now += STEP

    def exchange(self, messages) -> None:
        messages = list(messages)
        while messages:
            acks = [a for m in self.there.carry(messages) for a in self.autopilot.take(m)]
            messages = [
                m for ack in self.back.carry(acks) for m in self.streams.feed(ack, self.now)
            ]

    def states(self) -> dict[str, StreamState]:
        return {status.name: status.state for status in self.streams.report()}


def world(requests, autopilot=None, **line) -> World:
    autopilot = autopilot or StreamingAutopilot()
    return World(Streams(StreamRequest(*r) for r in requests), autopilot, **line)


def test_everything_asked_for_is_granted_measured_and_left_alone():
    w = world([("RAW_IMU", 125.0), ("ATTITUDE", 50.0), ("GPS_RAW_INT", 10.0)])
    w.run(20.0)
    assert w.autopilot.asked == [("RAW_IMU", 8.0), ("ATTITUDE", 20.0), ("GPS_RAW_INT", 100.0)]
    for status, rate in zip(w.streams.report(), (125.0, 50.0, 10.0), strict=True):
        assert status.state is StreamState.FLOWING
        assert status.granted == rate
        assert status.measured == pytest.approx(rate, rel=0.1)


@pytest.mark.parametrize(
    ("loop_ms", "granted_ms"), [(4, 4), (6, 8), (25, 25), (26, 40), (300, 500), (1000, 1000)]
)
def test_denied_rates_are_stepped_down_to_the_fastest_granted(loop_ms, granted_ms):
    w = world([("RAW_IMU", 250.0)], StreamingAutopilot(fastest_ms=loop_ms))
    w.run(30.0)
    assert w.autopilot.intervals == {"RAW_IMU": granted_ms}
    assert w.states() == {"RAW_IMU": StreamState.FLOWING}


def test_the_limit_learned_on_one_message_spares_denials_on_the_next():
    w = world([("RAW_IMU", 250.0), ("SCALED_IMU2", 250.0)], StreamingAutopilot(fastest_ms=25))
    w.run(1.0)
    first = w.autopilot.denials
    w.run(10.0)
    assert w.autopilot.intervals == {"RAW_IMU": 25.0, "SCALED_IMU2": 25.0}
    assert w.autopilot.asked[-1] == ("SCALED_IMU2", 25.0)
    assert w.autopilot.denials == first


def test_a_message_that_the_autopilot_lacks_costs_two_questions_twice():
    w = world(
        [("HIGHRES_IMU", 200.0), ("ATTITUDE", 50.0)], StreamingAutopilot(unknown=["HIGHRES_IMU"])
    )
    w.run(300.0)
    two = ["HIGHRES_IMU"] * 2
    assert [name for name, _ in w.autopilot.asked] == [*two, "ATTITUDE", *two]
    assert w.states() == {
        "HIGHRES_IMU": StreamState.UNSUPPORTED,
        "ATTITUDE": StreamState.FLOWING,
    }


def test_the_first_rate_that_is_measured_counts_what_came():
    """Nobody granted it: it was asked for by somebody else, and comes all the same."""
    streams = Streams([StreamRequest("RAW_IMU", 50.0)])
    streams.start(1, 1, 100.0)
    for k in range(1, 1000):
        streams.feed(blank("RAW_IMU"), 100.0 + 0.02 * k)
        streams.poll(100.0 + 0.02 * k)
        (status,) = streams.report()
        if status.measured is not None:
            break
    assert status.measured == pytest.approx(k / (0.02 * k))


def test_a_reboot_starts_the_negotiation_again():
    w = world([("RAW_IMU", 50.0), ("HIGHRES_IMU", 50.0)])
    w.run(10.0)
    w.autopilot.reboot()
    w.autopilot.fastest_ms = 40
    w.streams.start(1, 1, w.now)
    w.run(10.0)
    assert w.autopilot.intervals == {"RAW_IMU": 40.0, "HIGHRES_IMU": 40.0}
    assert set(w.states().values()) == {StreamState.FLOWING}


def test_a_stream_that_dries_up_is_asked_for_again():
    """Another station has changed the rate, or the autopilot rebooted unnoticed."""
    w = world([("RAW_IMU", 50.0), ("ATTITUDE", 50.0)])
    w.run(10.0)
    del w.autopilot.intervals["RAW_IMU"]
    w.autopilot.intervals["ATTITUDE"] = 500.0
    w.run(15.0)
    assert w.autopilot.intervals == {"RAW_IMU": 20.0, "ATTITUDE": 20.0}
    assert set(w.states().values()) == {StreamState.FLOWING}


def test_granted_but_never_sent_is_asked_for_ever_more_rarely():
    """GPS2_RAW where there is no second receiver."""
    w = world([("GPS2_RAW", 10.0)], StreamingAutopilot(silent=["GPS2_RAW"]))
    w.run(400.0)
    assert w.states() == {"GPS2_RAW": StreamState.SILENT}
    assert 6 <= len(w.autopilot.asked) <= 14
    w.autopilot.silent.clear()
    w.run(10.0)
    assert w.states() == {"GPS2_RAW": StreamState.FLOWING}


@pytest.mark.parametrize(
    "seed_line", [{"loss": 0.3}, {"loss": 0.2, "duplication": 0.3, "reordering": 0.2}]
)
def test_a_bad_line_delays_the_agreement_and_no_more(seed_line):
    requests = [(r.name, r.rate) for r in DEFAULT_STREAMS]
    w = world(requests, StreamingAutopilot(unknown=["HIGHRES_IMU"]), **seed_line)
    w.run(180.0)
    assert not w.streams.legacy
    assert set(w.autopilot.intervals) == {name for name, _ in requests} - {"HIGHRES_IMU"}
    for request in DEFAULT_STREAMS:
        if request.name != "HIGHRES_IMU":
            assert w.autopilot.intervals[request.name] == request.interval_ms


@pytest.mark.parametrize(
    "firmware", [StreamingAutopilot(answers=False), StreamingAutopilot(unsupported=True)]
)
def test_firmware_without_the_command_is_asked_for_groups(firmware):
    w = world([("RAW_IMU", 50.0), ("SCALED_IMU2", 25.0), ("ATTITUDE", 50.0)], firmware)
    w.run(15.0)
    assert w.streams.legacy
    assert firmware.groups == {
        mavlink.MAV_DATA_STREAM_RAW_SENSORS: 50,
        mavlink.MAV_DATA_STREAM_EXTRA1: 50,
    }


def test_acknowledgements_to_others_are_not_taken_for_ours():
    streams = Streams([StreamRequest("RAW_IMU", 50.0)])
    streams.start(1, 1, 0.0)
    assert len(streams.poll(0.0)) == 1
    command = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
    for ack, source in (
        (mavlink.MAVLink_command_ack_message(command, 0, 0, 0, 255, 190), (1, 1)),
        (mavlink.MAVLink_command_ack_message(command, 0), (2, 1)),
        (mavlink.MAVLink_command_ack_message(400, 0), (1, 1)),
    ):
        streams.feed(received(ack, *source), 0.1)
        assert streams.report()[0].granted is None
    streams.feed(received(mavlink.MAVLink_command_ack_message(command, 0)), 0.1)
    assert streams.report()[0].granted == 50.0


def test_a_message_that_the_dialect_lacks_is_the_programmers_error():
    with pytest.raises(ValueError, match="NO_SUCH"):
        Streams([StreamRequest("NO_SUCH", 1.0)])


def test_at_most_ten_different_intervals_by_default():
    """ArduPilot has ten buckets; an eleventh interval is put into the nearest."""
    assert len({request.interval_ms for request in DEFAULT_STREAMS}) <= 10


def parameter(name, value):
    kind = mavlink.MAV_PARAM_TYPE_REAL32
    message = mavlink.MAVLink_param_value_message(name.encode(), value, kind, 1, 0)
    return received(message)


def test_the_body_s_attitude_is_asked_for_where_another_one_is_told():
    w = world([("ATTITUDE", 50.0), ("RAW_IMU", 50.0)])
    w.run(5.0)
    assert "ATTITUDE_QUATERNION" not in w.autopilot.intervals
    for name in ("Q_ENABLE", "Q_TAILSIT_ENABLE"):
        w.exchange(w.streams.feed(parameter(name, 1.0), w.now))
    w.run(15.0)
    assert w.autopilot.intervals["ATTITUDE_QUATERNION"] == w.autopilot.intervals["ATTITUDE"]
    assert w.states()["ATTITUDE_QUATERNION"] is StreamState.FLOWING
    w.exchange(w.streams.feed(parameter("Q_ENABLE", 0.0), w.now))
    assert "ATTITUDE_QUATERNION" not in w.states()


def test_a_parameter_that_is_no_number_changes_no_request():
    w = world([("ATTITUDE", 50.0)])
    told = {"Q_ENABLE": 1.0, "PTCH_TRIM_DEG": 2.0, "FLIGHT_OPTIONS": float("nan")}
    for name, value in told.items():
        w.exchange(w.streams.feed(parameter(name, value), w.now))
    w.run(5.0)
    assert "ATTITUDE_QUATERNION" in w.states()


def test_another_vehicle_is_not_asked_for_it():
    w = world([("ATTITUDE", 50.0)])
    for name in ("Q_ENABLE", "Q_TAILSIT_ENABLE"):
        w.exchange(w.streams.feed(parameter(name, 1.0), w.now))
    assert "ATTITUDE_QUATERNION" in w.states()
    w.streams.start(1, 1, w.now)  # a reboot
    assert "ATTITUDE_QUATERNION" in w.states()
    w.streams.start(2, 1, w.now)
    assert "ATTITUDE_QUATERNION" not in w.states()


def told(name, value):
    return received(mavlink.MAVLink_param_value_message(name.encode(), value, 6, 900, 65535))


@pytest.mark.parametrize("after_s", [0.0, 0.05, 0.3, 10.0])
@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_of_an_accelerometer_that_is_not_there_nothing_is_asked_any_more(after_s, loss):
    """Also where that is told while the question is on its way; and again when there is one."""
    w = world([("RAW_IMU", 50.0), ("SCALED_IMU2", 50.0), ("SCALED_IMU3", 50.0)], loss=loss)
    w.run(after_s)
    w.exchange(w.streams.feed(told("INS_ACC3_ID", 0.0), w.now))
    w.exchange(w.streams.feed(told("INS_ACC2_ID", 2753028.0), w.now))
    w.run(60.0)
    assert w.autopilot.intervals.get("SCALED_IMU3", 0.0) == 0.0
    asked = len(w.autopilot.asked)
    w.run(120.0)
    assert len(w.autopilot.asked) == asked
    assert w.states() == {
        "RAW_IMU": StreamState.FLOWING,
        "SCALED_IMU2": StreamState.FLOWING,
        "SCALED_IMU3": StreamState.UNSUPPORTED,
    }
    w.autopilot.reboot()
    w.streams.start(1, 1, w.now)
    w.run(30.0)
    assert w.autopilot.intervals == {"RAW_IMU": 20.0, "SCALED_IMU2": 20.0}
    w.exchange(w.streams.feed(told("INS_ACC3_ID", 2753036.0), w.now))
    w.run(60.0)
    assert w.states()["SCALED_IMU3"] is StreamState.FLOWING
