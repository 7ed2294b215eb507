from __future__ import annotations

import math
import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from onboard.core.inputs.samples import (
    AttitudeSample,
    GpsFix,
    GpsIntegrity,
    ImuSample,
    ParameterValue,
    VehicleState,
)
from onboard.errors import RecordingError
from onboard.mavlink.dialect import mavlink
from onboard.recordings.opening import kind_of, open_recording
from tests.recordings.dataflash_writer import modern_log, old_log
from tests.recordings.telemetry_writer import TelemetryWriter, px4_log, telemetry

LOGS = {
    "modern.BIN": bytes(modern_log(1)),
    "old.BIN": bytes(old_log(1)),
    "mavlink.tlog": bytes(telemetry(1)),
    "px4.ulg": px4_log(1),
}


def test_the_kind_is_found_from_the_content(tmp_path):
    kinds = {}
    for name, data in LOGS.items():
        path = tmp_path / f"{name}.dat"
        path.write_bytes(data)
        kinds[name] = open_recording(path).kind
    assert kinds == {
        "modern.BIN": "dataflash",
        "old.BIN": "dataflash",
        "mavlink.tlog": "tlog",
        "px4.ulg": "ulog",
    }


def test_telemetry_in_which_a_dataflash_header_stands_by_chance_is_telemetry(tmp_path):
    """Three bytes of 64 KiB: one log in 250 has them."""
    log = TelemetryWriter()
    log.add(mavlink.MAVLink_statustext_message(6, b"\xa3\x95\x80\x07\x20FM"))
    path = tmp_path / "flight.tlog"
    path.write_bytes(bytes(log) + LOGS["mavlink.tlog"])
    assert b"\xa3\x95\x80" in path.read_bytes()
    assert open_recording(path).kind == "tlog"


@pytest.mark.parametrize("lost", [1, 100])
def test_a_dataflash_log_that_begins_in_the_middle_is_one(tmp_path, lost):
    path = tmp_path / "flight.dat"
    path.write_bytes(LOGS["modern.BIN"][lost:])
    assert kind_of(path) == "dataflash"


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"", "is empty"), (b"hello, world\n" * 99, "not a "), (bytes(5000), "not a ")],
)
def test_bad_files_give_one_clear_line(tmp_path, content, message):
    path = tmp_path / "x.BIN"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=message) as caught:
        open_recording(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_absent_file_and_directory(tmp_path):
    with pytest.raises(RecordingError, match="no such file"):
        open_recording(tmp_path / "none.tlog")
    with pytest.raises(RecordingError, match="directory"):
        open_recording(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RecordingError, match="regular file"):
        open_recording(tmp_path / "pipe")


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read(tmp_path):
    path = tmp_path / "x.BIN"
    path.write_bytes(LOGS["modern.BIN"])
    path.chmod(0)
    with pytest.raises(RecordingError, match="cannot be read"):
        open_recording(path)


def test_px4_log(tmp_path, capsys):
    path = tmp_path / "flight.ulg"
    path.write_bytes(px4_log())
    recording = open_recording(path)
    assert (recording.autopilot, recording.damage) == ("px4", ())
    assert recording.duration_s == pytest.approx(1.98)
    samples = list(recording.samples())
    assert isinstance(samples[0], ParameterValue)
    assert (samples[0].name, samples[0].value) == ("CAL_ACC0_XOFF", 0.125)
    timed = [s.t for s in samples[1:]]
    assert timed == sorted(timed)
    first = {type(s): s for s in reversed(samples)}
    assert first[ImuSample].f_b == (1.0, 2.0, -9.5)
    assert first[AttitudeSample].yaw == pytest.approx(math.pi / 2)
    fix = first[GpsFix]
    assert (fix.v_n, fix.v_e, fix.v_d, fix.receiver) == (1.0, 2.0, -0.5, 1)
    assert fix.latitude == pytest.approx(math.radians(47.4))
    assert (first[VehicleState].armed, first[VehicleState].kind) == (True, "plane")
    assert first[GpsIntegrity].jammed is False
    assert capsys.readouterr().out == ""


def read_all(path: Path) -> int:
    """Number of samples; whatever the file holds, RecordingError is the only way to fail."""
    try:
        recording = open_recording(path)
        count = sum(1 for _ in recording.samples())
    except RecordingError:
        return 0
    assert recording.duration_s >= 0.0
    return count


@pytest.mark.parametrize("name", LOGS)
@settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damaged_files_are_read_or_refused(tmp_path, capsys, name, data):
    content = bytearray(LOGS[name])
    for _ in range(data.draw(st.integers(1, 12), label="edits")):
        at = data.draw(st.integers(0, len(content) - 1))
        match data.draw(st.sampled_from(["flip", "cut", "insert", "drop", "zero"])):
            case "flip":
                content[at] ^= data.draw(st.integers(1, 255))
            case "cut":
                del content[max(at, 1) :]
            case "insert":
                content[at:at] = data.draw(st.binary(max_size=40))
            case "drop":
                if len(content) > 100:
                    del content[at : at + 50]
            case "zero":
                content[at : at + 30] = bytes(len(content[at : at + 30]))
    path = tmp_path / name
    path.write_bytes(content)
    read_all(path)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("name", LOGS)
def test_every_truncation_is_read_or_refused(tmp_path, name):
    path = tmp_path / name
    whole = LOGS[name]
    path.write_bytes(whole)
    everything = read_all(path)
    counts = []
    for length in range(1, len(whole), 97):
        path.write_bytes(whole[:length])
        counts.append(read_all(path))
    assert counts == sorted(counts)
    assert everything >= counts[-1] > 0.8 * everything
