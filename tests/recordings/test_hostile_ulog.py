"""Whatever a .ulg holds, it is read or refused in time and memory of the order of its length."""

from __future__ import annotations

import io
import random
import struct
import tracemalloc
from contextlib import redirect_stdout

import numpy as np
import pytest
from pyulog.core import ULog

from onboard.errors import RecordingError
from onboard.recordings.opening import open_recording
from onboard.recordings.ulog import CONVERTERS
from onboard.recordings.ulog_index import (
    HEADER_LENGTH,
    MOST_PARAMETERS,
    columns_of,
    index_ulog,
)
from onboard.recordings.ulog_messages import SYNC
from tests.recordings.telemetry_writer import px4_log

HEADER = px4_log(1)[:HEADER_LENGTH]
WANTED = frozenset(CONVERTERS)


def message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def subscription(name: str, number: int = 0, instance: int = 0) -> bytes:
    return message("A", struct.pack("<BH", instance, number) + name.encode())


def nested(depth: int, count: int = 99) -> bytes:
    """Types of arrays of types, which unfolded would have ``count**depth`` fields."""
    out = message("F", f"a0:uint8_t[{count}] x;".encode())
    for level in range(1, depth):
        out += message("F", f"a{level}:a{level - 1}[{count}] x;".encode())
    last = f"sensor_combined:uint64_t timestamp;a{depth - 1}[{count}] x;"
    return out + message("F", last.encode())


def recursive() -> bytes:
    out = message("F", b"a:b[9] x;") + message("F", b"b:a[9] x;")
    return out + message("F", b"sensor_combined:uint64_t timestamp;a[9] x;")


HOSTILE = {
    "types within types": HEADER
    + nested(5)
    + subscription("sensor_combined")
    + message("D", struct.pack("<HQ", 0, 1)),
    "empty types within types": HEADER
    + message("F", b"a0:")
    + nested(6)[3 + len(b"a0:uint8_t[99] x;") :]
    + subscription("sensor_combined"),
    "a type within itself": HEADER + recursive() + subscription("sensor_combined"),
    "a chain of types": HEADER
    + b"".join(message("F", f"t{k}:t{k + 1} x;".encode()) for k in range(3000))
    + message("F", b"sensor_combined:uint64_t timestamp;t0 x;")
    + subscription("sensor_combined"),
    "no message at all": HEADER + b"\xff" * 100_000,
    "zeros": HEADER + bytes(100_000),
    "one kind and no length": HEADER + b"\x00\x00D" * 30_000,
    "sync marks alone": HEADER + (SYNC[:-1] + b"\xff") * 10_000,
    "many subscriptions": HEADER
    + message("F", b"airspeed:uint64_t timestamp;float true_airspeed_m_s;")
    + b"".join(subscription("airspeed", k % 65536, k % 256) for k in range(20_000)),
    "many parameters": HEADER
    + b"".join(
        message("P", bytes((len(key),)) + key + bytes(4))
        for key in (f"float P{k}".encode() for k in range(MOST_PARAMETERS + 1000))
    ),
    "a huge array": HEADER
    + message("F", b"sensor_combined:uint64_t timestamp;uint8_t[99999] x;")
    + subscription("sensor_combined"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_log_is_refused_in_bounded_memory(tmp_path, capsys, name):
    path = tmp_path / "x.ulg"
    path.write_bytes(HOSTILE[name])
    tracemalloc.start()
    try:
        with pytest.raises(RecordingError) as caught:
            open_recording(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 2_000_000 + 20 * len(HOSTILE[name])
    assert str(path) in str(caught.value)
    assert capsys.readouterr() == ("", "")


def test_fields_of_any_type_are_read_or_left(tmp_path):
    """The names that are wanted, but other types: nothing but samples or an error comes of it."""
    for kind in ("float", "double", "uint64_t", "char", "bool", "int8_t[3]", "float[40]"):
        names = "armed arming_state vehicle_type landed fix_type satellites_used hdop lat lon alt"
        fields = "".join(f"{kind} {name};" for name in f"{names} time_utc_usec".split())
        out = bytearray(px4_log(1))
        for number, topic in enumerate(("vehicle_gps_position", "vehicle_land_detected"), 90):
            out += message("F", f"{topic}:uint64_t timestamp;{fields}".encode())
            out += subscription(topic, number)
            layout = index_ulog(bytes(out), WANTED).topics[topic, 0].layout
            body = struct.pack("<HQ", number, 3_000_000) + b"\xff" * (layout.dtype.itemsize - 8)
            out += message("D", body)
        path = tmp_path / "x.ulg"
        path.write_bytes(out)
        assert sum(1 for _ in open_recording(path).samples()) >= 100


def test_another_reader_agrees():
    """The columns are those of the library that PX4's own tools use."""
    extra = HEADER + message("B", bytes(40))
    inner = "int16_t a;uint8_t[3] b;"
    outer = "uint64_t timestamp;inner[2] parts;float true_airspeed_m_s;double[2] two;"
    outer += "uint8_t[5] _padding0;"  # which is not logged
    extra += message("F", f"inner:{inner}".encode()) + message("F", f"airspeed:{outer}".encode())
    extra += subscription("airspeed", 7, 1)
    rng = np.random.default_rng(1)
    for k in range(50):
        extra += message("D", struct.pack("<HQ", 7, 10 + k) + rng.bytes(10 + 4 + 16))
    for data in (px4_log(2), extra):
        with redirect_stdout(io.StringIO()):
            other = ULog(io.BytesIO(data), [*WANTED])
        index = index_ulog(data, WANTED)
        theirs = {(d.name, d.multi_id): d.data for d in other.data_list}
        assert index.initial == other.initial_parameters
        assert theirs.keys() == index.topics.keys()
        for key, topic in index.topics.items():
            for name, values in columns_of(topic.records(data)).items():
                np.testing.assert_array_equal(values, theirs[key][name])


def test_a_log_goes_on_after_the_next_sync_mark():
    whole = px4_log(2)
    index = index_ulog(whole, WANTED)
    half = index.topics["sensor_combined", 0].offsets[50] - 5
    rubbish = b"\xff" * 500 + message("S", SYNC)
    damaged = index_ulog(whole[:half] + rubbish + whole[half:], WANTED)
    assert damaged.damaged_places == 1
    assert len(damaged.topics["sensor_combined", 0].offsets) == 100


@pytest.mark.parametrize("seed", range(20))
def test_noise_takes_nothing_of_what_stands_behind_it(seed):
    """Any of its bytes may be a letter of a kind, and say a length that reaches far behind it."""
    whole, noise = px4_log(200), random.Random(seed).randbytes(3000)
    index = index_ulog(whole, WANTED)
    at = index.topics["sensor_combined", 0].offsets[2000] - 5
    damaged = index_ulog(whole[:at] + noise + whole[at:], WANTED)
    assert damaged.damaged_places == 1
    assert damaged.skipped_bytes == len(noise)
    for key, topic in index.topics.items():
        assert len(damaged.topics[key].offsets) == len(topic.offsets)


@pytest.mark.parametrize("row", [1, 4])
def test_messages_of_a_kind_that_is_not_known_yet_are_no_damage(row):
    whole = px4_log(2)
    at = index_ulog(whole, WANTED).topics["sensor_combined", 0].offsets[50] - 5
    new = message("Z", b"something to come") * row
    index = index_ulog(whole[:at] + new + whole[at:], WANTED)
    assert (index.damaged_places, index.skipped_bytes) == (0, 0)
    assert len(index.topics["sensor_combined", 0].offsets) == 100


@pytest.mark.parametrize(
    "us", [12_000_000, 1_790_000_000_000_000], ids=["since boot", "since 1970"]
)
def test_a_text_is_no_damage_whatever_its_clock_begins_with(us):
    whole = px4_log(2)
    at = index_ulog(whole, WANTED).topics["sensor_combined", 0].offsets[50] - 5
    said = message("L", b"6" + struct.pack("<Q", us) + b"Armed by RC")
    index = index_ulog(whole[:at] + said + whole[at:], WANTED)
    assert (index.damaged_places, index.skipped_bytes) == (0, 0)
    assert len(index.topics["sensor_combined", 0].offsets) == 100
