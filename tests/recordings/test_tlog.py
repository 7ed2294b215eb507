from __future__ import annotations

import math
import struct
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.core.inputs.samples import GpsFix, ImuSample, ParameterValue, VehicleState
from onboard.errors import RecordingError
from onboard.recordings.opening import open_recording
from tests.recordings.telemetry_writer import TelemetryWriter, heartbeat, raw_imu, telemetry


def saved(tmp_path: Path, data: object) -> Path:
    path = tmp_path / "log.tlog"
    path.write_bytes(bytes(data))
    return path


def of_type(path: Path, kind: type) -> list:
    return [s for s in open_recording(path).samples() if isinstance(s, kind)]


@pytest.mark.parametrize("version", [1, 2])
def test_both_versions_of_mavlink(tmp_path, version):
    path = saved(tmp_path, telemetry(version=version))
    recording = open_recording(path)
    assert (recording.kind, recording.autopilot) == ("tlog", "ardupilot")
    assert (recording.damage, recording.notes) == ((), ())
    assert recording.duration_s == pytest.approx(3.96)
    assert recording.counts["RAW_IMU"] == 100
    imu = of_type(path, ImuSample)
    assert len(imu) == 100
    assert imu[0].t == 10.0
    assert imu[0].f_b[2] == pytest.approx(-9.80665)
    fixes = of_type(path, GpsFix)
    assert len(fixes) == 20
    assert fixes[0].v_e == pytest.approx(10.0)
    assert fixes[0].latitude == pytest.approx(math.radians(-35.3632621))
    assert fixes[0].speed_accuracy == (0.3 if version == 2 else None)
    assert [p.name for p in of_type(path, ParameterValue)] == ["INS_ACCSCAL_X"]
    states = of_type(path, VehicleState)
    assert {(state.armed, state.kind) for state in states} == {(False, "copter")}


def test_each_reading_starts_anew(tmp_path):
    recording = open_recording(saved(tmp_path, telemetry()))
    assert list(recording.samples()) == list(recording.samples())


def parameter(log, name, value, index=0, kind=9):
    log.add(mavlink.MAVLink_param_value_message(name, value, kind, 1, index))


def test_a_list_read_late_counts_from_the_beginning_unless_it_was_changed(tmp_path):
    """A ground station that connects in flight reads what was in force all along."""
    log = telemetry(seconds=70)
    parameter(log, b"INS_ACCOFFS_X", 0.25)
    parameter(log, b"INS_ACCOFFS_Y", 0.1)
    parameter(log, b"INS_ACCOFFS_Y", 0.2)
    parameter(log, b"INS_ACCSCAL_X", 1.02)  # told in time with another value
    samples = list(open_recording(saved(tmp_path, log)).samples())
    first = samples.index(next(s for s in samples if isinstance(s, ImuSample)))
    told = {s.name: s.value for s in samples[:first] if isinstance(s, ParameterValue)}
    assert told == {"INS_ACCOFFS_X": 0.25}
    late = [(s.name, s.value) for s in samples[first:] if isinstance(s, ParameterValue)]
    assert late[1:] == [
        ("INS_ACCOFFS_X", 0.25),
        ("INS_ACCOFFS_Y", pytest.approx(0.1)),
        ("INS_ACCOFFS_Y", pytest.approx(0.2)),
        ("INS_ACCSCAL_X", pytest.approx(1.02)),
    ]


def test_what_was_set_late_was_not_in_force_before(tmp_path):
    """An autopilot echoes a PARAM_SET with no index; a list afterwards says the same value."""
    log = telemetry(seconds=70)
    parameter(log, b"INS_ACCOFFS_X", 0.25, index=65535)
    parameter(log, b"INS_ACCOFFS_X", 0.25, index=17)
    parameter(log, b"INS_ACCOFFS_Y", 0.5, index=18)
    samples = list(open_recording(saved(tmp_path, log)).samples())
    first = samples.index(next(s for s in samples if isinstance(s, ImuSample)))
    told = {s.name: s.value for s in samples[:first] if isinstance(s, ParameterValue)}
    assert told == {"INS_ACCOFFS_Y": 0.5}


@pytest.mark.parametrize("meant", [1000, -3, 1310988, 0])
def test_a_whole_number_may_come_as_its_bytes_or_as_its_value(tmp_path, meant):
    """PX4 sends bytes, ArduPilot values."""
    log = telemetry()
    (octets,) = struct.unpack("<f", struct.pack("<i", meant))
    parameter(log, b"PWM_MIN", octets, kind=6)
    parameter(log, b"MOT_PWM_MIN", float(meant), kind=6)
    told = {s.name: s.value for s in of_type(saved(tmp_path, log), ParameterValue)}
    assert told["PWM_MIN"] == told["MOT_PWM_MIN"] == meant


def test_a_damaged_packet_costs_itself_only(tmp_path):
    log = telemetry()
    data = bytearray(bytes(log))
    data[log.places[120] + 20] ^= 0x40
    recording = open_recording(saved(tmp_path, data))
    clean = open_recording(saved(tmp_path, log))
    lost = sum(clean.counts.values()) - sum(recording.counts.values())
    assert lost <= 1


def test_garbage_between_packets_is_skipped_and_counted(tmp_path):
    log = telemetry()
    place = log.places[200]
    garbage = bytes((0xFD, 0xFE, 3, 0xFD)) * 100
    data = bytes(log)[:place] + garbage + bytes(log)[place:]
    recording = open_recording(saved(tmp_path, data))
    assert sum(recording.counts.values()) >= sum(
        open_recording(saved(tmp_path, log)).counts.values()
    )
    assert recording.damage == ("1 damaged place, 400 bytes skipped",)


def test_a_cut_log_is_read_to_its_end(tmp_path):
    log = telemetry()
    recording = open_recording(saved(tmp_path, bytes(log)[:-5]))
    assert recording.damage
    assert "cut off" in recording.damage[-1]
    assert recording.counts["RAW_IMU"] >= 99


def test_leading_garbage_does_not_hide_the_log(tmp_path):
    recording = open_recording(saved(tmp_path, b"\x00\xfd\x55" * 30 + bytes(telemetry())))
    assert recording.counts["RAW_IMU"] == 100


def test_of_several_vehicles_the_one_with_most_inertial_data(tmp_path):
    log = telemetry(seconds=1, system=7)
    telemetry(seconds=3, system=9, writer=log)
    recording = open_recording(saved(tmp_path, log))
    assert recording.counts["RAW_IMU"] == 75
    assert "system 9" in recording.notes[0]
    assert "7 (25)" in recording.notes[0]


def test_a_camera_that_sends_imu_is_not_the_autopilot(tmp_path):
    log = telemetry(seconds=1)
    for k in range(200):
        log.add(raw_imu(5_000_000 + k * 1000, z=500), component=100)
    path = saved(tmp_path, log)
    assert [s.f_b[2] for s in of_type(path, ImuSample)] == pytest.approx([-9.80665] * 25)


def test_px4_is_recognised(tmp_path):
    log = TelemetryWriter()
    log.add(heartbeat(mavlink.MAV_AUTOPILOT_PX4))
    for k in range(20):
        log.add(raw_imu(1_000_000 + k * 20_000))
    assert open_recording(saved(tmp_path, log)).autopilot == "px4"


def test_without_heartbeat_the_sender_is_taken_for_the_autopilot(tmp_path):
    log = TelemetryWriter()
    for k in range(20):
        log.add(raw_imu(1_000_000 + k * 20_000))
    path = saved(tmp_path, log)
    recording = open_recording(path)
    assert recording.autopilot == "unknown"
    assert "heartbeat" in recording.notes[0]
    assert len(of_type(path, ImuSample)) == 20


def test_signed_packets(tmp_path):
    log = TelemetryWriter()
    packer = log.packers[1, 1] = mavlink.MAVLink(None, 1, 1)
    packer.signing.secret_key = bytes(32)
    packer.signing.sign_outgoing = True
    packer.signing.timestamp = 1
    telemetry(writer=log)
    recording = open_recording(saved(tmp_path, log))
    assert recording.damage == ()
    assert recording.counts["RAW_IMU"] == 100


def test_without_inertial_messages_it_is_refused(tmp_path):
    log = TelemetryWriter()
    for _ in range(10):
        log.add(heartbeat())
    with pytest.raises(RecordingError, match="no inertial messages"):
        open_recording(saved(tmp_path, log))


def test_packets_of_an_unknown_message_are_stepped_over(tmp_path):
    log = telemetry()
    place = log.places[150]
    stamp = bytes(log)[place : place + 8]
    unknown = bytes((0xFD, 5, 0, 0, 9, 1, 1, 0x77, 0x77, 0x77)) + bytes(7)
    data = bytes(log)[:place] + stamp + unknown + bytes(log)[place:]
    recording = open_recording(saved(tmp_path, data))
    assert recording.damage == ()
    assert recording.counts["RAW_IMU"] == 100


@pytest.mark.slow
@pytest.mark.recordings
def test_flight_at_rest_feels_gravity_upwards(recordings):
    for name in ("a01", "b01"):
        first = of_type(recordings / "sitl" / f"{name}.tlog", ImuSample)[:100]
        assert sum(s.f_b[2] for s in first) / 100 == pytest.approx(-9.8, abs=0.5)


def test_an_attitude_that_is_not_the_bodys_in_hover_is_said(tmp_path):
    """Of a tailsitter, whose ATTITUDE is turned by 90 degrees there, if the other is not sent."""

    def notes(*named, quaternion=False):
        log = telemetry(seconds=2)
        for name, value in named:
            parameter(log, name, value)
        if quaternion:
            log.add(mavlink.MAVLink_attitude_quaternion_message(10_000, 1, 0, 0, 0, 0, 0, 0))
        return open_recording(saved(tmp_path, log)).notes

    tailsitter = ((b"Q_ENABLE", 1.0), (b"Q_TAILSIT_ENABLE", 1.0))
    (note,) = notes(*tailsitter)
    assert "ATTITUDE_QUATERNION" in note
    assert notes(*tailsitter, quaternion=True) == ()
    assert notes(*tailsitter, (b"Q_ENABLE", 0.0)) == ()  # the last one counts
    assert notes((b"INS_ACCOFFS_X", 0.25)) == notes() == ()
    trimmed = ((b"Q_ENABLE", 1.0), (b"PTCH_TRIM_DEG", 3.0))
    # Numbers that are none say nothing, and end nothing.
    assert notes(*trimmed, (b"FLIGHT_OPTIONS", math.nan)) == notes(*trimmed) == (note,)
