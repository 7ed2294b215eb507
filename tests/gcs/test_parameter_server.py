"""The parameter server against ground stations: whatever the line does, they get the truth."""

import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.errors import RefusedError
from onboard.mavlink.codec import Codec
from onboard.mavlink.dialect import mavlink
from onboard.mavlink.limits import ASKED_HZ, LIST_HZ
from onboard.mavlink.parameter_messages import to_float32
from onboard.mavlink.parameter_server import ParameterServer, Writable
from tests.gcs.stations import COMPONENT, SYSTEM, Line, Station

STEP = 0.1
VALUES = {f"OBC_P_{n}": n / 7.0 for n in range(40)} | {"OBC_PUSH": 1.0, "OBC_GAIN": 0.5}


class Desk:
    """The server with a writable mode, and a gain that is sometimes refused."""

    def __init__(self, values=VALUES, **options):
        self.set = []
        self.denied = []
        self.refuse = ""
        self.server = ParameterServer(
            values,
            writable={
                "OBC_PUSH": Writable(0.0, 2.0, self._set),
                "OBC_GAIN": Writable(-1.0, 1.0, self._set, whole=False),
            },
            denied=lambda name, why: self.denied.append((name, why)),
            **options,
        )
        self.server.start(SYSTEM, 1, 0.0)

    def _set(self, value):
        if self.refuse:
            raise RefusedError(self.refuse)
        self.set.append(value)


def run(desk, stations, *, until, seed=1, limit=600.0, **line):
    """Everybody talks until ``until()``; what stations send and hear goes over their own lines."""
    up = [
        Line(seed + 2 * n, system=s.system, component=190, **line) for n, s in enumerate(stations)
    ]
    down = [
        Line(seed + 2 * n + 1, system=SYSTEM, component=COMPONENT, **line)
        for n, _ in enumerate(stations)
    ]
    now, sent = 0.0, 0
    while not until():
        now += STEP
        assert now < limit, "they never come to an end"
        out = []
        for station, line_up in zip(stations, up, strict=True):
            for message in line_up.carry(station.poll(now)):
                out += desk.server.feed(message, now)
        out += desk.server.poll(now)
        sent += len(out)
        for station, line_down in zip(stations, down, strict=True):
            for message in line_down.carry(out):
                station.hear(message)
    return now, sent


def ask(desk, message, *, source=(255, 190), now=0.0):
    """One message as the server gets it, and its answers as a station gets them."""
    frames = Codec().feed(Codec(system=source[0], component=source[1]).encode(message))
    answers = desk.server.feed(frames[0].message, now)
    sender = Codec(system=SYSTEM, component=COMPONENT)
    return [f.message for f in Codec().feed(b"".join(sender.encode(m) for m in answers))]


def set_message(name, value, kind=9, system=SYSTEM, component=COMPONENT):
    return mavlink.MAVLink_param_set_message(system, component, name.encode(), value, kind)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    "line",
    [{}, {"loss": 0.3}, {"duplication": 0.5, "reordering": 0.3}, {"loss": 0.6, "reordering": 0.2}],
    ids=["clean", "loss", "mess", "awful"],
)
def test_every_station_ends_with_every_value(seed, line):
    desk = Desk()
    stations = [Station(n) for n in range(3)]
    for station in stations:
        station.fetch()
    run(desk, stations, seed=seed, until=lambda: all(s.complete for s in stations), **line)
    for station in stations:
        assert station.values == {name: to_float32(value) for name, value in VALUES.items()}
        assert [station.by_index[i] for i in range(len(VALUES))] == list(VALUES)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_set_over_a_bad_line_is_set_and_told(seed):
    desk = Desk()
    one, other = Station(0), Station(1)
    one.wanted = {"OBC_PUSH": 2.0, "OBC_GAIN": -0.25}
    run(desk, [one, other], seed=seed, loss=0.4, duplication=0.3, until=lambda: not one.wanted)
    assert desk.server.values["OBC_PUSH"] == 2.0
    assert desk.server.values["OBC_GAIN"] == -0.25
    assert set(desk.set) == {2.0, -0.25}


def test_ten_stations_cost_no_more_than_one():
    sent = {}
    for count in (1, 10):
        desk = Desk()
        stations = [Station(n) for n in range(count)]
        for station in stations:
            station.fetch()
        _, sent[count] = run(desk, stations, until=lambda s=stations: all(x.complete for x in s))
    assert sent[10] == sent[1] == len(VALUES)


def test_a_station_that_comes_in_the_middle_gets_the_beginning_too():
    desk = Desk()
    early, late = Station(0), Station(1)
    early.fetch()
    run(desk, [early, late], until=lambda: len(early.values) > 20)
    late.values.clear()
    late.by_index.clear()
    late.count = None
    late.fetch()
    run(desk, [early, late], until=lambda: late.complete)


def test_a_list_keeps_its_pace():
    desk = Desk(list_hz=20.0)
    ask(desk, mavlink.MAVLink_param_request_list_message(SYSTEM, COMPONENT))
    ask(desk, mavlink.MAVLink_param_request_list_message(SYSTEM, COMPONENT))
    now, sent = 0.0, []
    for tick in range(1, 100):
        now = tick * STEP
        sent.append(len(desk.server.poll(now)))
        assert sum(sent) <= 20.0 * now + 1e-6
    assert sum(sent) == len(VALUES)
    # After a pause in which nothing could be sent there is no burst.
    ask(desk, mavlink.MAVLink_param_request_list_message(SYSTEM, COMPONENT), now=now)
    assert len(desk.server.poll(now + 100.0)) <= 4


def test_changes_wait_until_a_list_is_done():
    desk = Desk(list_hz=20.0)
    ask(desk, mavlink.MAVLink_param_request_list_message(SYSTEM, COMPONENT))
    sent = 0
    for tick in range(1, 21):  # 2 s of the 2.1 s that it takes
        desk.server.update({"OBC_P_3": float(tick % 2)})
        sent += len(desk.server.poll(tick * STEP))
        assert sent <= 20.0 * tick * STEP + 1e-6
    later = [m for tick in range(21, 40) for m in desk.server.poll(tick * STEP)]
    assert later[-1].param_id == "OBC_P_3"
    assert later[-1].param_value == 0.0


def flooded(desk, message, *, seconds, a_second=200):
    """Messages that leave while this one comes so often; a station's list is asked for, too."""
    ask(desk, mavlink.MAVLink_param_request_list_message(SYSTEM, COMPONENT))
    sent = []
    for tick in range(round(seconds / STEP)):
        now = tick * STEP
        for n in range(round(a_second * STEP)):
            sent += ask(desk, message(n), now=now)
        sent += desk.server.poll(now)
    return sent


def reads(names):
    def read(n):
        name = names[n % len(names)].encode()
        return mavlink.MAVLink_param_request_read_message(SYSTEM, COMPONENT, name, -1)

    return read


@pytest.mark.parametrize("names", [["OBC_PUSH"], list(VALUES), ["NOT_THERE"]])
def test_a_flood_of_reads_is_answered_at_a_pace_and_a_list_goes_on(names):
    desk = Desk()
    seconds = 3.0
    sent = flooded(desk, reads(names), seconds=seconds)
    at_once = ASKED_HZ * (seconds + 1.0)
    assert len(sent) <= at_once + LIST_HZ * seconds + 1
    told = {m.param_id for m in sent if m.get_type() == "PARAM_VALUE"}
    assert told == set(VALUES)
    if names == ["NOT_THERE"]:
        assert desk.server.counters["parameter_requests_left"] >= 200 * seconds - at_once


def test_a_read_beyond_the_pace_is_answered_later_and_once():
    desk = Desk()
    answered = sum(len(ask(desk, reads(["OBC_PUSH"])(0))) for _ in range(100))
    assert answered == desk.server.counters["parameter_reads"] == ASKED_HZ
    later = [m for tick in range(1, 20) for m in desk.server.poll(tick * STEP)]
    assert [m.param_id for m in later] == ["OBC_PUSH"]


def test_a_flood_of_writes_is_mostly_left_and_who_repeats_gets_through():
    desk = Desk()
    seconds = 3.0
    flooded(desk, lambda n: set_message("OBC_PUSH", float(n % 2)), seconds=seconds)
    assert len(desk.set) <= ASKED_HZ * (seconds + 1.0)
    for tick in range(20):
        answers = ask(desk, set_message("OBC_PUSH", 2.0), now=seconds + tick * STEP)
        if any(m.get_type() == "PARAM_VALUE" for m in answers):
            break
    assert desk.server.values["OBC_PUSH"] == desk.set[-1] == 2.0


def test_values_are_floats_with_their_index():
    desk = Desk()
    for request in (
        mavlink.MAVLink_param_request_read_message(SYSTEM, COMPONENT, b"OBC_P_7", -1),
        mavlink.MAVLink_param_request_read_message(SYSTEM, COMPONENT, b"OBC_PUSH", 7),
        mavlink.MAVLink_param_request_read_message(0, 0, b"", 7),
    ):
        (value,) = ask(desk, request)
        assert (value.param_id, value.param_index, value.param_count) == ("OBC_P_7", 7, 42)
        assert value.param_type == 9
        assert value.param_value == to_float32(1.0)
        assert (value.get_srcSystem(), value.get_srcComponent()) == (SYSTEM, COMPONENT)


@pytest.mark.parametrize(
    "target", [(SYSTEM, 1), (2, COMPONENT), (2, 0), (SYSTEM, 190)], ids=lambda t: f"{t[0]}:{t[1]}"
)
def test_what_is_meant_for_others_is_left_alone(target):
    desk = Desk()
    system, component = target
    assert ask(desk, set_message("OBC_PUSH", 2.0, system=system, component=component)) == []
    read = mavlink.MAVLink_param_request_read_message(system, component, b"OBC_PUSH", -1)
    assert ask(desk, read) == []
    ask(desk, mavlink.MAVLink_param_request_list_message(system, component))
    assert list(desk.server.poll(1.0)) == []
    assert desk.set == []


def test_before_the_vehicle_is_known_there_is_no_answer():
    server = ParameterServer({"OBC_X": 1.0}, writable={})
    request = mavlink.MAVLink_param_request_list_message(0, 0)
    frames = Codec().feed(Codec().encode(request))
    assert list(server.feed(frames[0].message, 0.0)) == []
    assert list(server.poll(1.0)) == []


@pytest.mark.parametrize(
    ("name", "value", "error"),
    [
        ("OBC_P_1", 5.0, "READ_ONLY"),
        ("OBC_PUSH", 3.0, "VALUE_OUT_OF_RANGE"),
        ("OBC_PUSH", -1.0, "VALUE_OUT_OF_RANGE"),
        ("OBC_PUSH", 1.5, "VALUE_OUT_OF_RANGE"),
        ("OBC_PUSH", math.nan, "VALUE_OUT_OF_RANGE"),
        ("OBC_PUSH", math.inf, "VALUE_OUT_OF_RANGE"),
        ("OBC_GAIN", 1.01, "VALUE_OUT_OF_RANGE"),
    ],
)
def test_a_denied_write_is_answered_with_the_old_value_and_the_reason(name, value, error):
    desk = Desk()
    before = desk.server.values
    told, reason = ask(desk, set_message(name, value))
    assert (told.param_id, told.param_value) == (name, before[name])
    assert reason.get_type() == "PARAM_ERROR"
    assert (reason.target_system, reason.target_component) == (255, 190)
    assert mavlink.enums["MAV_PARAM_ERROR"][reason.error].name.endswith(error)
    assert desk.server.values == before
    assert desk.set == []
    assert [n for n, _ in desk.denied] == [name]


def test_a_write_that_the_service_refuses_is_denied_with_its_words():
    desk = Desk()
    desk.refuse = "not now"
    told, reason = ask(desk, set_message("OBC_PUSH", 2.0))
    assert told.param_value == 1.0
    assert mavlink.enums["MAV_PARAM_ERROR"][reason.error].name.endswith("PERMISSION_DENIED")
    assert desk.denied == [("OBC_PUSH", "not now")]


def test_an_unknown_name_is_an_error_only_when_it_was_meant_for_us():
    desk = Desk()
    (error,) = ask(desk, set_message("INS_ACCSCAL_X", 1.0))
    assert mavlink.enums["MAV_PARAM_ERROR"][error.error].name.endswith("DOES_NOT_EXIST")
    assert ask(desk, set_message("INS_ACCSCAL_X", 1.0, component=0)) == []
    for index, name in ((-1, b"OBC_NOTHING"), (len(VALUES), b"")):
        read = mavlink.MAVLink_param_request_read_message(SYSTEM, COMPONENT, name, index)
        (error,) = ask(desk, read)
        assert error.get_type() == "PARAM_ERROR"


@pytest.mark.parametrize("layout", ["<B", "<b", "<H", "<h", "<I", "<i"])
@pytest.mark.parametrize("cast", [True, False], ids=["cast", "bytes"])
@pytest.mark.parametrize("number", [0, 1, 2])
def test_whole_numbers_come_either_way(layout, cast, number):
    kind = {"<B": 1, "<b": 2, "<H": 3, "<h": 4, "<I": 5, "<i": 6}[layout]
    raw = struct.pack(layout, number).ljust(4, b"\0")
    value = float(number) if cast else struct.unpack("<f", raw)[0]
    desk = Desk()
    (told,) = ask(desk, set_message("OBC_PUSH", value, kind=kind))
    assert told.param_value == number
    assert desk.set == [number]


@pytest.mark.parametrize("layout", ["<b", "<h", "<i"])
def test_a_negative_number_as_bytes_is_no_other_number(layout):
    kind = {"<b": 2, "<h": 4, "<i": 6}[layout]
    value = struct.unpack("<f", struct.pack(layout, -1).ljust(4, b"\0"))[0]
    desk = Desk()
    told, _ = ask(desk, set_message("OBC_PUSH", value, kind=kind))
    assert told.param_value == 1.0
    assert desk.set == []


@settings(deadline=None)
@given(
    name=st.sampled_from([*VALUES, "OBC_NO", ""]),
    value=st.floats(width=32),
    kind=st.integers(0, 12),
    component=st.sampled_from([0, COMPONENT]),
)
def test_nothing_but_an_allowed_value_is_ever_set(name, value, kind, component):
    desk = Desk()
    ask(desk, set_message(name, value, kind=kind, component=component))
    values = desk.server.values
    changed = {n for n in VALUES if values[n] != to_float32(VALUES[n])}
    assert changed <= {"OBC_PUSH", "OBC_GAIN"}
    assert values["OBC_PUSH"] in {0.0, 1.0, 2.0}
    assert -1.0 <= values["OBC_GAIN"] <= 1.0


def test_changes_are_announced_once_paced_and_the_writable_ones_first():
    desk = Desk(announce_hz=5.0)
    desk.server.update({name: value + 1.0 for name, value in VALUES.items()})
    told, now = [], 0.0
    while len(told) < len(VALUES):
        now += STEP
        told += [m.param_id for m in desk.server.poll(now)]
        assert len(told) <= 5.0 * now + 1.0
    assert sorted(told) == sorted(VALUES)
    assert set(told[:2]) == {"OBC_PUSH", "OBC_GAIN"}
    assert all(not desk.server.poll(now + n) for n in range(1, 10))
    desk.server.update(VALUES | {"OBC_P_3": 9.0})
    # What differs from what stations know, and the latest of it.
    desk.server.update({"OBC_P_3": 10.0})
    first = [m for n in range(20, 100) for m in desk.server.poll(now + n)]
    (third,) = [m for m in first if m.param_id == "OBC_P_3"]
    assert third.param_value == 10.0


@pytest.mark.parametrize("name", ["", "A_NAME_THAT_IS_TOO_LONG", "OBC_\u00e4"])
def test_a_name_that_the_protocol_cannot_carry_is_our_mistake(name):
    with pytest.raises(ValueError, match="name"):
        ParameterServer({name: 0.0}, writable={})


def test_a_value_that_is_no_number_is_our_mistake():
    desk = Desk()
    with pytest.raises(ValueError, match="nan"):
        desk.server.update({"OBC_PUSH": math.nan})
    with pytest.raises(ValueError, match="not there"):
        ParameterServer({"A": 1.0}, writable={"B": Writable(0.0, 1.0, print)})
