from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
import pytest

from onboard.core.inputs.samples import (
    AirData,
    AttitudeSample,
    Battery,
    GpsFix,
    ImuSample,
    ParameterValue,
    Throttle,
    VehicleState,
)
from onboard.errors import RecordingError
from onboard.recordings.dataflash import WANTED
from onboard.recordings.dataflash_index import index_dataflash
from onboard.recordings.opening import open_recording
from tests.recordings.dataflash_writer import DataflashWriter, modern_log, old_log
from tests.recordings.oracles import pymavlink_records


def saved(tmp_path: Path, data: object) -> Path:
    path = tmp_path / "log.BIN"
    path.write_bytes(bytes(data))
    return path


def of_type(path: Path, kind: type) -> list:
    return [s for s in open_recording(path).samples() if isinstance(s, kind)]


def check_against_oracle(path: Path) -> int:
    """Every field of every record that we read is what pymavlink's recv_msg gives."""
    index = index_dataflash(path.read_bytes(), WANTED)
    oracle = pymavlink_records(path)
    compared = 0
    assert index.counts() == {name: len(m) for name, m in oracle.items() if name in WANTED}
    for slot, form in enumerate(index.formats):
        messages = oracle.get(form.name, [])
        places = index.offsets[index.slots == slot]
        records = index.gather(slot, places)
        for column, letter in zip(form.columns, form.letters, strict=True):
            expected = [getattr(m, column) for m in messages]
            if letter in "nNZ":
                assert [bytes(x).decode() for x in records[column]] == expected
            elif letter != "M":
                np.testing.assert_array_equal(form.numbers(records, column), expected)
            compared += len(expected)
    return compared


@pytest.mark.parametrize("log", [modern_log, old_log])
def test_records_equal_those_of_recv_msg(tmp_path, log):
    assert check_against_oracle(saved(tmp_path, log())) > 1000


@pytest.mark.slow
@pytest.mark.recordings
@pytest.mark.parametrize(
    "name", ["sitl/c01.BIN", "real/real-quad-08.BIN", "real/real-quad-14-crash.BIN"]
)
def test_real_records_equal_those_of_recv_msg(recordings, name):
    assert check_against_oracle(recordings / name) > 10_000


def test_modern_log_in_si_units(tmp_path):
    path = saved(tmp_path, modern_log())
    recording = open_recording(path)
    assert (recording.kind, recording.autopilot, recording.damage) == ("dataflash", "ardupilot", ())
    assert recording.duration_s == pytest.approx(3.96)
    imu = of_type(path, ImuSample)
    assert [s.imu for s in imu[:4]] == [1, 2, 1, 2]
    assert imu[1].f_b == pytest.approx((0.1, -0.2, -8.8), abs=1e-6)
    assert imu[1].w_b == pytest.approx((0.01, -0.02, 0.03))
    assert (imu[0].t, imu[2].t, imu[0].temperature) == (5.0, 5.04, 31.5)
    attitude = of_type(path, AttitudeSample)[0]
    assert math.degrees(attitude.yaw) == pytest.approx(350.0)
    assert math.degrees(attitude.pitch) == pytest.approx(-2.5)
    fix = of_type(path, GpsFix)[1]
    assert (fix.v_n, fix.v_e, fix.v_d) == pytest.approx((0.0, 10.0, -1.25), abs=1e-6)
    assert fix.t == pytest.approx(5.2001)
    assert fix.t_receiver == pytest.approx(2300 * 604800 + 1.2)
    assert (fix.hdop, fix.speed_accuracy, fix.satellites) == (0.71, 0.25, 12)
    assert (fix.latitude, fix.altitude) == (math.radians(-35.3632621), 584.05)
    named = {p.name: p.value for p in of_type(path, ParameterValue)}
    assert named["INS_ACCSCAL_X"] == pytest.approx(0.15)
    assert of_type(path, VehicleState)[0].armed is True


def test_old_log_takes_the_boot_clock_of_gps_from_t(tmp_path):
    path = saved(tmp_path, old_log())
    fix = of_type(path, GpsFix)[0]
    assert fix.t == pytest.approx(300.003)
    assert fix.t_receiver == pytest.approx(1800 * 604800 + 400_000.0)
    assert (fix.v_n, fix.v_d) == pytest.approx((-5.0, 0.5))
    assert fix.altitude == 297.88
    assert {s.imu for s in of_type(path, ImuSample)} == {1, 2}
    assert of_type(path, Battery)[0].voltage == pytest.approx(16.4)
    assert of_type(path, Throttle)[0].throttle == pytest.approx(0.55)
    armed, disarmed = of_type(path, VehicleState)
    assert (armed.t, armed.armed, disarmed.armed) == (300.0, True, False)
    assert disarmed.t == pytest.approx(303.96, abs=0.2)


@pytest.mark.parametrize(
    ("text", "kinds"),
    [
        ("ArduCopter V4.5.7 (2a3dc4b7)", ["copter"]),
        ("ArduPlane V4.5.7 (0358a9c2)", ["plane"]),
        ("Rover: ArduRover", []),
        ("EKF3 IMU0 is using GPS", []),
    ],
)
def test_the_firmware_says_what_kind_of_vehicle_it_is(tmp_path, text, kinds):
    log = modern_log()
    log.format(20, "MSG", "QZ", "TimeUS,Message")
    log.add("MSG", 5_000_000, text)
    states = of_type(saved(tmp_path, log), VehicleState)
    assert [state.kind for state in states if state.kind] == kinds
    assert [state.armed for state in states if not state.kind] == [True]


def test_samples_keep_the_order_of_the_file(tmp_path):
    t = [s.t for s in open_recording(saved(tmp_path, modern_log())).samples()]
    assert t == sorted(t)


def test_no_vertical_speed_where_the_receiver_has_none(tmp_path):
    log = modern_log()
    without = bytes(log).replace(
        b"\x00\x00\xa0\xbf",
        b"\x00\x00\x00\x00",  # VZ of -1.25
    )
    assert {f.v_d for f in of_type(saved(tmp_path, without), GpsFix)} == {None}


def test_what_is_not_a_measurement_does_not_become_one(tmp_path):
    log = modern_log(1)
    log.add("IMU", 9_000_000, 0, *[0.0] * 6, 0, 0, 0.0, 1, 1, 1000, 1000)
    log.add("IMU", 9_040_000, 0, *[0.5] * 6, 0, 0, 0.0, 1, 1, 1000, 1000)
    log.add("GPS", 9_040_000, 0, 3, 500, 0, 12, 99.99, 0.0, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0, 1)
    *_, last = of_type(path := saved(tmp_path, log), ImuSample)
    assert [s.t for s in of_type(path, ImuSample)].count(9.0) == 0
    assert (last.t, last.temperature) == (9.04, None)
    fix = of_type(path, GpsFix)[-1]
    assert (fix.t_receiver, fix.hdop) == (None, None)


def test_throttle_from_the_motors_where_there_is_no_better(tmp_path):
    log = modern_log(1)
    log.format(30, "RCOU", "QHHHH", "TimeUS,C1,C2,C3,C4")
    for name, value in {"SERVO2_FUNCTION": 33, "SERVO3_FUNCTION": 34, "SERVO4_FUNCTION": 7}.items():
        log.add("PARM", 9_000_000, name, float(value), 0.0)
    log.add("RCOU", 9_000_000, 1900, 1200, 1600, 1900)
    assert [s.throttle for s in of_type(saved(tmp_path, log), Throttle)] == [pytest.approx(0.4)]
    log.format(31, "CTUN", "Qf", "TimeUS,ThO")
    log.add("CTUN", 9_000_000, 0.45)
    assert [s.throttle for s in of_type(saved(tmp_path, log), Throttle)] == [pytest.approx(0.45)]


def test_speed_accuracy_is_that_of_the_same_receiver(tmp_path):
    log = modern_log(1)
    for t, i, accuracy in ((9_000_000, 0, 0.5), (9_000_050, 1, 0.9)):
        log.add("GPS", t, i, 3, 500, 2300, 12, 0.8, 1.0, 1.0, 1.0, 1.0, 0.0, 0.5, 0.0, 1)
        log.add("GPA", t, i, 1.1, 0.5, 0.7, accuracy, 0.0, 1 - i, 9000, 200, 0.0, 0, 0)
    first, second = of_type(saved(tmp_path, log), GpsFix)[-2:]
    assert (first.receiver, first.speed_accuracy, first.v_d) == (1, 0.5, 0.5)
    assert (second.receiver, second.speed_accuracy, second.v_d) == (2, 0.9, None)


def test_format_with_unknown_letter_is_stepped_over(tmp_path):
    log = DataflashWriter()
    log.format(60, "NEW", "Q?", "TimeUS,Odd", length=12)
    log.data += b"\xa3\x95\x3c" + bytes(9)
    whole = bytes(log) + bytes(modern_log())
    recording = open_recording(saved(tmp_path, whole))
    assert recording.damage == ()
    assert recording.counts["IMU"] == 200


def test_torn_record_costs_itself_only(tmp_path):
    clean = bytes(modern_log())
    index = index_dataflash(clean, WANTED)
    imu = [k for k, f in enumerate(index.formats) if f.name == "IMU"]
    place = int(index.offsets[np.isin(index.slots, imu)][50])
    torn = clean[: place + 20] + clean[place + 40 :]
    recording = open_recording(saved(tmp_path, torn))
    assert recording.counts["IMU"] == 199
    assert "damaged" in recording.damage[0]
    assert all(abs(s.f_b[1] + 0.2) < 1e-6 for s in recording.samples() if isinstance(s, ImuSample))


def test_garbage_in_the_middle_and_a_cut_end(tmp_path):
    clean = bytes(modern_log())
    middle = len(clean) // 2
    index = index_dataflash(clean, WANTED)
    place = int(index.offsets[index.offsets > middle][0])
    dirty = clean[:place] + bytes(range(256)) * 7 + clean[place:-10]
    recording = open_recording(saved(tmp_path, dirty))
    assert recording.counts["IMU"] >= 199
    assert len(recording.damage) == 2
    assert "cut off" in recording.damage[1]


def test_a_signalling_nan_is_read_without_a_warning(tmp_path):
    clean = bytes(modern_log(1))
    damaged = clean.replace(struct.pack("<f", 0.01), b"\x01\x00\x80\x7f", 1)
    first = of_type(saved(tmp_path, damaged), ImuSample)[0]
    assert math.isnan(first.w_b[0])


def test_unused_end_of_a_flash_page_is_no_damage(tmp_path):
    assert open_recording(saved(tmp_path, bytes(modern_log()) + b"\xff" * 300)).damage == ()


def test_log_without_inertial_records_is_refused(tmp_path):
    log = DataflashWriter()
    log.format(14, "PARM", "QNff", "TimeUS,Name,Value,Default")
    log.add("PARM", 5, "INS_ACCOFFS_X", 0.0, 0.0)
    with pytest.raises(RecordingError, match="IMU"):
        open_recording(saved(tmp_path, log))


def tailsitter_log(*, with_body: bool) -> DataflashWriter:
    """Nose up, which ATT calls level; the EKF's first lane is wrong and the second one flies."""
    log = modern_log()
    log.format(20, "XKF4", "QBHB", "TimeUS,C,SS,PI")
    log.format(21, "XKF1", "QBccC", "TimeUS,C,Roll,Pitch,Yaw")
    for name in ("Q_ENABLE", "Q_TAILSIT_ENABLE"):
        log.add("PARM", 5_000_000, name, 1.0, 0.0)
    for k in range(40):
        t = 5_000_000 + 100_000 * k
        for lane, pitch in ((0, 70.0), (1, 87.5)):
            log.add("XKF4", t, lane, 831, 1)
            if with_body:
                log.add("XKF1", t, lane, 1.5, pitch, 350.0)
    return log


def test_the_attitude_is_the_body_s_where_att_is_of_a_view(tmp_path):
    path = saved(tmp_path, tailsitter_log(with_body=True))
    told = of_type(path, AttitudeSample)
    assert len(told) == 40
    for sample in told:
        angles = (sample.roll, sample.pitch, sample.yaw)
        assert np.degrees(angles) == pytest.approx((1.5, 87.5, 350.0), abs=1e-3)
    recording = open_recording(path)
    assert recording.notes == ()
    assert recording.gather is not None
    (block,) = recording.gather()
    np.testing.assert_array_equal(block.attitude.t, [s.t for s in told])
    np.testing.assert_array_equal(block.attitude.angles, [(s.roll, s.pitch, s.yaw) for s in told])


def test_the_airspeed_is_that_of_the_sensor_that_is_flown_by(tmp_path):
    """The first one fails in flight, and the autopilot goes over to the second one and back."""
    log = modern_log()
    log.format(20, "ARSP", "QBffB", "TimeUS,I,Airspeed,DiffPress,Pri")
    primary = [0, 0, 1, 1, 1, 0]
    for k, its in enumerate(primary):
        for sensor, speed in ((0, 20.0), (1, 25.0)):
            log.add("ARSP", 5_000_000 + 100_000 * k, sensor, speed + k, 9.0, its)
    path = saved(tmp_path, log)
    told = [20.0 + 5.0 * its + k for k, its in enumerate(primary)]
    assert [s.airspeed for s in of_type(path, AirData)] == told


@pytest.mark.parametrize("column", ["Pri", "Primary", ""])
def test_the_airspeed_of_old_logs_has_a_record_of_its_own_for_the_second_sensor(tmp_path, column):
    log = modern_log()
    columns = ("TimeUS,Airspeed", "QfB" if column else "Qf")
    log.add("PARM", 5_000_000, "ARSPD_PRIMARY", 1.0, 0.0)
    for kind, name, speed in ((20, "ARSP", 20.0), (21, "ASP2", 25.0)):
        log.format(kind, name, columns[1], ",".join(filter(None, (columns[0], column))))
        for k in range(3):
            log.add(name, 5_000_000 + 100_000 * k, speed, *([1] if column else []))
    assert [s.airspeed for s in of_type(saved(tmp_path, log), AirData)] == [25.0] * 3


def test_it_is_said_where_the_log_has_the_view_s_only(tmp_path):
    path = saved(tmp_path, tailsitter_log(with_body=False))
    assert len(of_type(path, AttitudeSample)) == 50
    (note,) = open_recording(path).notes
    assert "XKF1" in note
