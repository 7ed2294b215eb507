"""Damaged logs: what is read in strides is what is read step by step, and every byte is counted."""

from __future__ import annotations

import random

import numpy as np
import pytest

from onboard.mavlink.dialect import MESSAGE_IDS
from onboard.mavlink.framing import is_valid, message_id, packet_length
from onboard.recordings.arrays import read_arrays
from onboard.recordings.dataflash import WANTED
from onboard.recordings.dataflash_index import index_dataflash
from onboard.recordings.pace import Pace
from onboard.recordings.packet_columns import are_valid, candidates, headers, lengths
from onboard.recordings.tlog import WANTED as WANTED_PACKETS
from onboard.recordings.tlog_index import index_tlog
from onboard.recordings.ulog import CONVERTERS
from onboard.recordings.ulog_index import index_ulog
from tests.recordings.dataflash_writer import modern_log, old_log
from tests.recordings.telemetry_writer import px4_log
from tests.recordings.test_arrays import signed_and_several

DATAFLASH = bytes(modern_log(20)) + bytes(old_log(10))
TLOG = bytes(signed_and_several()) * 4
HEADER_OF_ULOG = px4_log(1)[:59]
ULOG = px4_log(40)
TOPICS = frozenset(CONVERTERS)
EVERY_RECORD = frozenset(
    ("IMU", "ATT", "GPS", "GPA", "PARM", "EV", "ODD", "IMU2", "CURR", "CTUN", "STRT")
)


def damaged(data: bytes, seed: int) -> bytes:
    """Bits flipped, pieces lost, garbage and copies of pieces put in, the end cut off."""
    r = random.Random(seed)
    out = bytearray(data)
    for _ in range(r.choice((0, 1, 3, 10))):
        at, n = r.randrange(len(out)), r.choice((1, 2, 30, 300, 9000))
        match r.randrange(5):
            case 0:
                out[at] ^= 1 << r.randrange(8)
            case 1:
                del out[at : at + n]
            case 2:
                out[at:at] = r.randbytes(n)
            case 3:
                start = r.randrange(len(out))
                out[at:at] = out[start : start + n]
            case 4:
                out[at:at] = r.choice((b"\xa3\x95\x80", b"\xa3\x95\x0a", b"\xfd\xfe")) * (n // 9)
    return bytes(out[: r.randrange(len(out))] if r.random() < 0.2 else out)


def in_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Pace, "strides", lambda _pace, _at: False)


@pytest.mark.parametrize("seed", range(40))
def test_strides_over_dataflash_change_nothing(monkeypatch, seed):
    data = damaged(DATAFLASH, seed)
    fast = index_dataflash(data, WANTED)
    in_steps(monkeypatch)
    slow = index_dataflash(data, WANTED)
    assert fast.offsets.tolist() == slow.offsets.tolist()
    assert fast.slots.tolist() == slow.slots.tolist()
    for count in ("formats", "records", "damaged_places", "skipped_bytes", "cut_off_bytes"):
        assert getattr(fast, count) == getattr(slow, count)


@pytest.mark.parametrize("seed", range(40))
def test_strides_over_telemetry_change_nothing(monkeypatch, seed):
    data = damaged(TLOG, seed)
    fast = index_tlog(data, WANTED_PACKETS)
    in_steps(monkeypatch)
    slow = index_tlog(data, WANTED_PACKETS)
    assert fast.offsets.tolist() == slow.offsets.tolist()
    for count in ("packets", "damaged_places", "skipped_bytes", "cut_off_bytes"):
        assert getattr(fast, count) == getattr(slow, count)


def test_logs_shorter_than_a_stride(monkeypatch):
    cuts = [data[:length] for data in (TLOG, TLOG[::-1]) for length in range(9, 700, 3)]
    fast = [index_tlog(cut, WANTED_PACKETS).offsets.tolist() for cut in cuts]
    in_steps(monkeypatch)
    assert fast == [index_tlog(cut, WANTED_PACKETS).offsets.tolist() for cut in cuts]


@pytest.mark.parametrize("seed", range(40))
def test_strides_over_a_ulog_change_nothing(monkeypatch, seed):
    # Without its header it is no ULog, and is refused.
    data = HEADER_OF_ULOG + damaged(ULOG[len(HEADER_OF_ULOG) :], seed)
    fast = index_ulog(data, TOPICS)
    in_steps(monkeypatch)
    slow = index_ulog(data, TOPICS)
    assert fast == slow


@pytest.mark.parametrize("seed", range(20))
def test_every_byte_of_telemetry_is_read_or_counted(seed):
    data = damaged(TLOG, seed)
    index = index_tlog(data, frozenset(MESSAGE_IDS.values()))
    read = headers(np.frombuffer(data, np.uint8), index.offsets).length + 8
    others = index.packets - len(index.offsets)  # damage made messages of them that nobody knows
    rest = len(data) - int(read.sum()) - index.skipped_bytes - index.cut_off_bytes
    assert 16 * others <= rest <= 288 * others


@pytest.mark.parametrize("garbage", [1, 100, 5000])
def test_bytes_skipped_of_dataflash_are_those_of_the_garbage(tmp_path, garbage):
    clean = bytes(modern_log())
    place = int(index_dataflash(clean, WANTED).offsets[200])
    (tmp_path / "x").write_bytes(clean[:place] + b"\x55" * garbage + clean[place:])
    read = read_arrays(tmp_path / "x", WANTED)
    assert read.skipped_bytes == garbage
    named = "1 byte" if garbage == 1 else f"{garbage} bytes"
    assert read.damage == (f"1 damaged place, {named} skipped",)
    assert len(read.tables["IMU"]) == 200


def test_a_torn_record_is_counted_as_skipped(tmp_path):
    clean = bytes(modern_log())
    index = index_dataflash(clean, EVERY_RECORD)
    at = int(index.offsets[300])
    length = index.formats[index.slots[300]].length
    (tmp_path / "x").write_bytes(clean[: at + 10] + clean[at + 20 :])
    read = read_arrays(tmp_path / "x", EVERY_RECORD)
    assert read.skipped_bytes == length - 10
    assert sum(map(len, read.tables.values())) == len(index.offsets) - 1


@pytest.mark.parametrize("left", [1, 2, 3, 12, 50])
def test_a_cut_off_log_says_how_much_of_its_end_is_of_no_use(tmp_path, left):
    clean = bytes(modern_log())
    at = int(index_dataflash(clean, frozenset({"IMU"})).offsets[-1])
    (tmp_path / "x").write_bytes(clean[: at + left])
    read = read_arrays(tmp_path / "x", ["IMU"])
    assert (read.skipped_bytes, len(read.tables["IMU"])) == (left, 199)
    named = "1 byte" if left == 1 else f"{left} bytes"
    assert read.damage == (f"cut off: the end of the log is missing ({named} skipped)",)


def test_a_damaged_ulog_says_how_much_was_skipped(tmp_path):
    clean = px4_log(2)
    (tmp_path / "x").write_bytes(clean)
    whole = read_arrays(tmp_path / "x", ["sensor_combined"])
    (tmp_path / "x").write_bytes(clean[:-7])
    cut = read_arrays(tmp_path / "x", ["sensor_combined", "vehicle_attitude"])
    assert (whole.skipped_bytes, whole.damage) == (0, ())
    assert 0 < cut.skipped_bytes < 40
    assert "cut off" in cut.damage[0]


def test_checksums_of_many_packets_are_those_of_one_by_one():
    data = damaged(TLOG, 3)
    octets = np.frombuffer(data, np.uint8)
    at = candidates(octets, 0, len(octets) - 300)
    at = at[at + lengths(octets, at) <= len(octets)]
    valid = are_valid(octets, at, headers(octets, at))
    assert valid.sum() > 1000
    assert not valid.all()
    for place, mine in zip(at.tolist(), valid.tolist(), strict=True):
        assert packet_length(data, place) > 0
        assert is_valid(data, place, message_id(data, place)) == mine
