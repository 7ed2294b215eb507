"""Recordings: what was put in is what comes out."""

import dataclasses
import struct

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl import recording
from sitl.builtin import rotation
from sitl.builtin.effects import ALL
from sitl.builtin.gps import total_latency
from sitl.builtin.sensors import low_pass
from sitl.builtin.truth import GpsTruth, ImuTruth
from sitl.recording import FlightSpec

TRUE = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.25, -0.2, 0.3))
CALM = dataclasses.replace(
    TRUE,
    accel_noise=0.0,
    bias_walk=0.0,
    broadband=0.0,
    vibration=(0.0, 0.0, 0.0),
)
RIGHT = {f"INS_ACCSCAL_{a}": s for a, s in zip("XYZ", TRUE.scale, strict=True)} | {
    f"INS_ACCOFFS_{a}": o for a, o in zip("XYZ", TRUE.offset, strict=True)
}


FLIGHT_S = 50.0


@pytest.fixture(scope="module", params=["plane", "copter"])
def flight(request):
    return recording.run(FlightSpec(vehicle=request.param, duration=FLIGHT_S, imus=(TRUE, CALM)))


def of(flight, name):
    return [m for _, m in flight.messages if m.get_type() == name]


def test_declared_rates(flight):
    for name, rate in {"RAW_IMU": 50, "SCALED_IMU2": 50, "ATTITUDE": 50, "HEARTBEAT": 1}.items():
        assert len(of(flight, name)) == pytest.approx(FLIGHT_S * rate, rel=0.02)


def test_times_never_go_back(flight):
    assert np.all(np.diff([t for t, _ in flight.messages]) >= 0)
    assert np.all(np.diff([m.time_usec for m in of(flight, "RAW_IMU")]) > 0)


def test_every_parameter_is_listed(flight):
    values = of(flight, "PARAM_VALUE")
    assert {m.param_index for m in values} == set(range(values[0].param_count))


@pytest.mark.slow
def test_right_parameters_leave_no_error():
    spec = FlightSpec(duration=FLIGHT_S, imus=(CALM,), parameters=RIGHT, rates={"HIGHRES_IMU": 50})
    flight = recording.run(spec)
    piece = flight.pieces[-1]
    true = piece.imus[0].filtered  # raw, sensor axes
    recovered = (true - np.array(CALM.offset)) * np.array(CALM.scale)
    expected = low_pass(piece.trajectory.f_b, 20.0)
    assert np.abs(recovered - expected).max() < 4e-3  # the sensor's own resolution
    for m in (m for _, m in flight.messages if m.get_type() == "HIGHRES_IMU"):
        t = m.time_usec * 1e-6
        if piece.start < t < piece.end - 0.1:
            f = np.array([m.xacc, m.yacc, m.zacc])
            assert np.abs(f - expected[piece.index(t)]).max() < 0.03


def test_uncalibrated_error_is_the_declared_one():
    spec = FlightSpec(duration=FLIGHT_S, imus=(CALM,))
    piece = recording.run(spec).pieces[-1]
    expected = piece.trajectory.f_b / np.array(CALM.scale) + np.array(CALM.offset)
    assert np.abs(piece.imus[0].raw - expected).max() < 4e-3


def delay_of_gps(flight):
    """Shift that fits GPS speed over ground best to the true velocity, s."""
    piece = flight.pieces[-1]
    grid = piece.start + np.arange(piece.trajectory.n) * 1e-3
    fixes = {m.time_usec: m for m in of(flight, "GPS_RAW_INT") if m.fix_type >= 3}
    stamps = np.array(sorted(fixes)) * 1e-6
    v = np.array(
        [
            [fixes[t].vel * np.cos(np.radians(fixes[t].cog / 100)),
             fixes[t].vel * np.sin(np.radians(fixes[t].cog / 100))]
            for t in sorted(fixes)
        ]
    ) * 0.01  # fmt: skip
    inside = (stamps > piece.start + 1) & (stamps < piece.end - 1)

    def misfit(delay):
        model = [np.interp(stamps - delay, grid, piece.trajectory.v_n[:, i]) for i in (0, 1)]
        return np.mean((v - np.column_stack(model))[inside] ** 2)

    candidates = np.arange(-0.1, 0.4, 0.002)
    return candidates[np.argmin([misfit(d) for d in candidates])]


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.06, 0.14, 0.26])
def test_gps_is_as_late_as_declared(delay):
    spec = FlightSpec(duration=FLIGHT_S, gps=GpsTruth(delay=delay))
    flight = recording.run(spec)
    record = recording.truth_record(spec)
    assert record["net_gps_delay_s"] == pytest.approx(total_latency(spec.truth) - 0.02)
    assert delay_of_gps(flight) == pytest.approx(record["net_gps_delay_s"], abs=0.006)


def test_fixes_repeat_with_the_same_stamp_and_in_whole_milliseconds():
    flight = recording.run(FlightSpec(duration=40.0, rates={"GPS_RAW_INT": 20}))
    stamps = [m.time_usec for m in of(flight, "GPS_RAW_INT") if m.fix_type >= 3]
    assert len(set(stamps)) < 0.4 * len(stamps)
    assert all(t % 1000 == 0 for t in stamps)


def attitude_error(flight):
    piece = flight.pieces[-1]
    messages = [m for m in of(flight, "ATTITUDE") if m.time_boot_ms * 1e-3 > piece.start]
    rows = [piece.index(m.time_boot_ms * 1e-3) for m in messages]
    euler = np.array([[m.roll, m.pitch, m.yaw] for m in messages])
    R = rotation.from_euler(*euler.T)
    error = np.einsum("nij,nkj->nik", R, piece.trajectory.R_nb[rows])
    return np.stack([error[:, 2, 1], error[:, 0, 2], error[:, 1, 0]], axis=1), np.array(rows)


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", ["plane", "copter"])
def test_attitude_errs_as_a_filter_does(vehicle):
    error, _ = attitude_error(recording.run(FlightSpec(vehicle=vehicle, duration=200.0, seed=5)))
    rms = np.degrees(np.sqrt(np.mean(error[2000:-1000] ** 2, axis=0)))
    assert rms.max() < 1.0
    assert rms.min() > 0.03
    slow = error[2050:-1000] - error[2000:-1050]  # one second apart
    assert np.mean(slow**2) < 0.5 * np.mean(error[2000:-1000] ** 2)


def test_attitude_can_be_true():
    spec = FlightSpec(duration=FLIGHT_S, attitude_errors=False)
    error, _ = attitude_error(recording.run(spec))
    assert np.abs(error).max() < 6e-3  # a millisecond of turning


@pytest.mark.slow
def test_trim_is_taken_off_the_attitude():
    common = {"duration": 40.0, "attitude_errors": False, "dull": True}
    plain = recording.run(FlightSpec(**common))
    trimmed = recording.run(FlightSpec(**common, parameters={"AHRS_TRIM_X": 0.02}))
    a, b = of(plain, "ATTITUDE")[0], of(trimmed, "ATTITUDE")[0]
    assert b.roll - a.roll == pytest.approx(-0.02, abs=1e-6)
    assert of(plain, "RAW_IMU")[0].xacc == of(trimmed, "RAW_IMU")[0].xacc


def test_raw_imu_is_truncated_toward_zero(flight):
    piece = flight.pieces[-1]
    errors = []
    for m in of(flight, "SCALED_IMU2"):
        t = m.time_boot_ms * 1e-3
        if piece.start + 1.0 < t < piece.start + 3.0:  # at rest, and IMU 2 is without noise
            f = piece.imus[1].filtered[piece.index(t)]
            exact = (f - 0.001) * 1000.0 / 9.80665
            errors.append(np.array([m.xacc, m.yacc, m.zacc]) - exact)
    errors = np.array(errors) * np.sign([TRUE.offset[0], TRUE.offset[1], -1.0])
    assert errors.max() <= 1e-3
    assert errors.min() > -1.001


@pytest.mark.slow
def test_frames_are_the_messages(tmp_path):
    spec = FlightSpec(vehicle="plane", duration=30.0)
    path = tmp_path / "flight.tlog"
    record = recording.write_tlog(spec, path)
    data = path.read_bytes()
    parser = mav.MAVLink(None)
    read, i = [], 0
    while i < len(data):
        (unix_us,) = struct.unpack_from(">Q", data, i)
        length = data[i + 9] + 12
        read += [(unix_us, m) for m in parser.parse_buffer(data[i + 8 : i + 8 + length])]
        i += 8 + length
    direct = list(recording.fly_messages(spec))
    assert [t for t, _ in read] == [t for t, _ in direct]
    for (_, a), (_, b) in zip(read, direct, strict=True):
        for name in a.fieldnames:
            x, y = getattr(a, name), getattr(b, name)
            if isinstance(y, bytes):
                y = y.decode()
            assert np.array_equal(x, y, equal_nan=isinstance(x, float)), (a, b)
    assert record["vehicle"] == "plane"


@pytest.mark.slow
def test_same_spec_same_recording():
    spec = FlightSpec(duration=30.0, seed=9)
    once = recording.fly(spec)
    assert recording.fly(spec) == once
    assert once != recording.fly(dataclasses.replace(spec, seed=10))


def test_every_concealed_effect_is_found_once_and_has_a_name():
    assert len(set(ALL)) == len(ALL)
    assert all(kind.name for kind in ALL)
    challenged = [kind.name for kind in ALL if kind.units]
    assert len(set(challenged)) == len(challenged), "one unit of a name, one way to conceal it"


def test_frames_are_counted_and_signed_with_the_sender():
    frames = recording.fly(FlightSpec(duration=20.0))
    parser = mav.MAVLink(None)
    messages = [m for _, frame in frames for m in parser.parse_buffer(frame)]
    assert [m.get_seq() for m in messages] == [i % 256 for i in range(len(messages))]
    assert {(m.get_srcSystem(), m.get_srcComponent()) for m in messages} == {(1, 1)}
