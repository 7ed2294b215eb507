"""Arrays of the messages asked for, against the libraries that everybody reads logs with."""

from __future__ import annotations

import io
import struct
import tracemalloc
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import pytest
from pymavlink import mavutil
from pyulog.core import ULog

from onboard.errors import RecordingError
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import MESSAGE_IDS, mavlink
from onboard.recordings.arrays import read_arrays
from onboard.recordings.dataflash import WANTED
from onboard.recordings.packet_columns import layout
from onboard.recordings.ulog import CONVERTERS
from onboard.recordings.ulog_index import columns_of
from tests.recordings.dataflash_writer import DataflashWriter, modern_log, old_log
from tests.recordings.oracles import pymavlink_records
from tests.recordings.telemetry_writer import TelemetryWriter, px4_log, telemetry


def saved(tmp_path: Path, data: object) -> Path:
    path = tmp_path / "log"
    path.write_bytes(bytes(data))
    return path


def listed(values: np.ndarray) -> list:
    """Values as pymavlink has them: text decoded, arrays as lists."""
    return [x.decode(errors="replace") if isinstance(x, bytes) else x for x in values.tolist()]


def compared_with_pymavlink(path: Path, names: tuple[str, ...]) -> int:
    """Every field of a DataFlash log; how many values were compared."""
    oracle = pymavlink_records(path)
    tables = read_arrays(path, names).tables
    assert tables.keys() == oracle.keys() & set(names)
    compared = 0
    for name, table in tables.items():
        assert len(table) == len(oracle[name])
        for column in table.dtype.names:
            theirs = [getattr(m, column) for m in oracle[name]]
            np.testing.assert_array_equal(listed(table[column]), theirs, f"{name}.{column}")
            compared += len(theirs)
    return compared


def compared_with_mavutil(path: Path, names: tuple[str, ...]) -> int:
    """Every field of a .tlog; how many values were compared."""
    oracle: dict[str, list] = {}
    reader = mavutil.mavlink_connection(str(path))
    try:
        while (message := reader.recv_match(type=list(names))) is not None:
            oracle.setdefault(message.get_type(), []).append(message)
    finally:
        reader.close()
    tables = read_arrays(path, names).tables
    assert tables.keys() == oracle.keys()
    compared = 0
    for name, table in tables.items():
        theirs = oracle[name]
        np.testing.assert_array_equal(
            table["sender_system"], [m.get_srcSystem() for m in theirs], name
        )
        np.testing.assert_array_equal(
            table["sender_component"], [m.get_srcComponent() for m in theirs], name
        )
        np.testing.assert_allclose(
            table["arrived_us"] / 1e6, [m._timestamp for m in theirs], rtol=0.0, atol=1e-6
        )
        for column in table.dtype.names[3:]:
            values = [getattr(m, column) for m in theirs]
            np.testing.assert_array_equal(listed(table[column]), values, f"{name}.{column}")
            compared += len(values)
    return compared


def every_letter() -> DataflashWriter:
    """A log with formats of every letter but that of flight modes, which pymavlink names."""
    log = DataflashWriter()
    letters = "bBhHiIfdcCeELqQ"
    log.format(40, "LET", letters, ",".join(f"F{k}" for k in range(len(letters))))
    log.format(41, "TXT", "nNZ", "Short,Middle,Long")
    for k in range(50):
        whole = -k, k, -9 * k, 9 * k, -99_999 * k, 99_999 * k
        parts = k / 3, k / 7, -k / 100, k / 100, -k * 1.25, k * 1.25, k * 3.5
        log.add("LET", *whole, *parts, -(k * 10**12), k * 10**12)
        log.add("TXT", f"a{k}", f"bc{k}", "d" * k)
    log.format(42, "ARR", "Qag", "TimeUS,Many,Half", length=77)
    log.data += b"\xa3\x95\x2a" + struct.pack("<Q32he", 7, *range(-16, 16), 0.625)
    return log


@pytest.mark.parametrize("log", [modern_log, old_log, every_letter])
def test_dataflash_equals_pymavlink(tmp_path, log):
    made = log()
    assert compared_with_pymavlink(saved(tmp_path, made), tuple({*made.kinds} - {"FMT"})) >= 900


@pytest.mark.slow
@pytest.mark.recordings
@pytest.mark.parametrize(
    "name",
    ["sitl/c01.BIN", "real/real-quad-08.BIN", "real/real-fixedwing-03.BIN", "frames/e01.BIN"],
)
def test_real_dataflash_equals_pymavlink(recordings, name):
    assert compared_with_pymavlink(recordings / name, tuple(WANTED)) > 10_000


def signed_and_several() -> TelemetryWriter:
    """Four senders: MAVLink 2, 1, one that signs, and a ground station."""
    log = telemetry(4)
    telemetry(3, system=7, version=1, writer=log)
    packer = log.packers[9, 1] = mavlink.MAVLink(None, 9, 1)
    packer.signing.secret_key, packer.signing.sign_outgoing = bytes(32), True
    packer.signing.timestamp = 1
    telemetry(2, system=9, writer=log)
    return log


@pytest.mark.parametrize("log", [telemetry, lambda: telemetry(version=1), signed_and_several])
def test_tlog_equals_pymavlink(tmp_path, log):
    path = tmp_path / "x.tlog"
    path.write_bytes(bytes(log()))
    assert compared_with_mavutil(path, Decoder.names) > 2000


@pytest.mark.slow
@pytest.mark.recordings
def test_real_tlog_equals_pymavlink(recordings):
    assert compared_with_mavutil(recordings / "sitl" / "a01.tlog", Decoder.names) > 100_000


def test_senders_can_be_told_apart(tmp_path):
    table = read_arrays(saved(tmp_path, signed_and_several()), ["RAW_IMU"]).tables["RAW_IMU"]
    systems, counts = np.unique(table["sender_system"], return_counts=True)
    assert dict(zip(systems.tolist(), counts.tolist(), strict=True)) == {1: 100, 7: 75, 9: 50}


def test_every_message_of_the_dialect_has_a_layout():
    for message in mavlink.mavlink_map.values():
        form = layout(message)
        assert form.itemsize == message.unpacker.size
        assert list(form.names) == list(message.ordered_fieldnames)
        assert not {"arrived_us", "sender_system", "sender_component"} & set(form.names)


def compared_with_pyulog(path: Path, names: tuple[str, ...]) -> int:
    with redirect_stdout(io.StringIO()):
        other = ULog(str(path), list(names))
    theirs = {f"{d.name}[{d.multi_id}]" if d.multi_id else d.name: d.data for d in other.data_list}
    tables = read_arrays(path, names).tables
    assert tables.keys() == theirs.keys()
    compared = 0
    for name, table in tables.items():
        for column, values in columns_of(table).items():
            np.testing.assert_array_equal(values, theirs[name][column], f"{name}.{column}")
            compared += len(values)
    return compared


def test_ulog_equals_pyulog(tmp_path):
    assert compared_with_pyulog(saved(tmp_path, px4_log(4)), tuple(CONVERTERS)) > 1000


@pytest.mark.slow
@pytest.mark.recordings
def test_real_ulog_equals_pyulog(recordings):
    path = recordings / "real" / "real-px4-hex-23.ulg"
    assert compared_with_pyulog(path, tuple(CONVERTERS)) > 10_000


def test_a_name_that_is_laid_out_anew_has_the_fields_of_all_its_layouts(tmp_path):
    log = DataflashWriter()
    log.format(20, "BAT", "QBff", "TimeUS,Inst,Volt,Curr")
    log.add("BAT", 1, 0, 12.5, 3.0)
    log.format(21, "ODD", "QB", "TimeUS,Id")
    log.add("ODD", 2, 1)
    log.format(20, "BAT", "QBcd", "TimeUS,Inst,Volt,Temp")  # as in logs that were joined
    log.add("BAT", 3, 1, 11.25, 30.0)
    table = read_arrays(saved(tmp_path, log), ["BAT"]).tables["BAT"]
    assert table.dtype.names == ("TimeUS", "Inst", "Volt")
    assert table.tolist() == [(1, 0, 12.5), (3, 1, 11.25)]


def test_only_what_is_asked_for_and_there_is_read(tmp_path):
    tables = read_arrays(saved(tmp_path, modern_log()), ["ATT", "NONE"]).tables
    assert list(tables) == ["ATT"]
    tables = read_arrays(saved(tmp_path, telemetry()), ["ATTITUDE", "WIND", "NONE"]).tables
    assert list(tables) == ["ATTITUDE"]


def test_what_is_not_asked_for_may_be_damaged(tmp_path):
    """Nobody looks at the checksum of a message that nobody wants."""
    log = telemetry()
    data = bytearray(bytes(log))
    pressure = next(k for k in log.places if data[k + 8 + 7] == MESSAGE_IDS["SCALED_PRESSURE"])
    data[pressure + 8 + 11] ^= 1
    assert read_arrays(saved(tmp_path, data), ["ATTITUDE"]).damage == ()
    found = read_arrays(saved(tmp_path, data), ["ATTITUDE", "SCALED_PRESSURE"])
    assert len(found.tables["SCALED_PRESSURE"]) == 99
    assert len(found.tables["ATTITUDE"]) == 100


def big_dataflash() -> bytes:
    log = modern_log(1)
    head = bytes(log)
    for k in range(50):
        log.add("IMU", 9_000_000 + k, 0, *[0.5] * 6, 0, 0, 0.0, 1, 1, 1000, 1000)
        log.add("ATT", 9_000_000 + k, *[1.0] * 6, 3)
    return head + bytes(log)[len(head) :] * 600


@pytest.mark.slow
@pytest.mark.parametrize(
    ("data", "names"),
    [
        (big_dataflash, ("IMU", "ATT")),
        (big_dataflash, ("ATT",)),
        (lambda: bytes(telemetry(4)) * 150, ("RAW_IMU", "ATTITUDE")),
        (lambda: bytes(telemetry(4)) * 150, ("ATTITUDE",)),
    ],
    ids=["dataflash", "dataflash, one", "tlog", "tlog, one"],
)
def test_twice_the_arrays_is_all_the_memory(tmp_path, data, names):
    path = saved(tmp_path, data())
    read_arrays(path, names)  # tables of checksums are made once
    tracemalloc.start()
    try:
        tables = read_arrays(path, names).tables
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    size = sum(table.nbytes for table in tables.values())
    assert size > 400_000
    assert peak < 2.0 * size


def test_bad_files_give_one_clear_line(tmp_path):
    with pytest.raises(RecordingError, match="no such file"):
        read_arrays(tmp_path / "absent", ["IMU"])
    with pytest.raises(RecordingError, match="not a "):
        read_arrays(saved(tmp_path, b"hello, world\n" * 99), ["IMU"])
    with pytest.raises(RecordingError, match="header"):
        read_arrays(saved(tmp_path, b"ULog" + struct.pack("<Q", 0) * 9), ["IMU"])
