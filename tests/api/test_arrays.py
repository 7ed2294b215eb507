"""Columns: the same answer as the file, and what cannot be a flight is refused by name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import onboard
from onboard.api.array_recording import recording_of
from onboard.errors import ArraysError, UsageError
from onboard.recordings.opening import open_recording
from tests.recordings.dataflash_writer import modern_log
from tests.recordings.telemetry_writer import px4_log

pytestmark = pytest.mark.slow


def test_the_answer_is_that_of_the_file(asked):
    assert asked.by_arrays.to_json() == asked.calibration.to_json()
    assert np.array_equal(asked.by_arrays.imu(1).covariance, asked.calibration.imu(1).covariance)


@pytest.mark.parametrize("name", ["flight.tlog", "x.BIN", "x.ulg"])
def test_every_sample_comes_back_in_its_order(asked, tmp_path, name):
    path = asked.path if name == "flight.tlog" else tmp_path / name
    if name == "x.BIN":
        path.write_bytes(bytes(modern_log(6)))
    elif name == "x.ulg":
        path.write_bytes(px4_log(5))
    recording = open_recording(path)
    again = recording_of(onboard.Arrays.read(path))
    assert list(again.samples()) == list(recording.samples())
    assert list(again.samples()) == list(recording.samples())
    for same in ("path", "autopilot", "duration_s", "damage", "notes", "airborne"):
        assert getattr(again, same) == getattr(recording, same)


def test_columns_of_ones_own_give_the_flight_within_its_sigmas(asked):
    """Without order of arrival, places and states: less is known, and nothing else comes out."""
    of_file, own = asked.calibration.imu(1), asked.by_columns.imu(1)
    assert own.status == "calibrated"
    for name in ("scale", "offset"):
        apart = np.abs(getattr(own, name) - getattr(of_file, name))
        less_known = getattr(own, f"{name}_sigma")
        # What is not told is in the difference, so it is held against the wider claim of the two.
        assert np.all(apart < 2.0 * less_known)
        # Together: how much blocks contradict each other moves single sigmas by some per cent.
        assert np.prod(less_known) > np.prod(getattr(of_file, f"{name}_sigma"))
    assert own.timing["gps_delay_s"].value == pytest.approx(0.12, abs=0.02)
    assert set(own.parameters) <= set(own.names)


def test_a_changed_stream_is_read_in_order_of_time(asked):
    v = asked.arrays.velocity[0]
    early = v.t < v.t[0] + 30.0
    shorter = onboard.Velocity(t=v.t[early], v_n=v.v_n[early])
    times = [s.t for s in recording_of(replace(asked.arrays, velocity=shorter)).samples()]
    known = [t for t in times if t is not None]
    assert known == sorted(known)


def test_the_place_follows_from_the_velocity(asked):
    fixes = [
        s
        for s in recording_of(onboard.Arrays(**asked.columns)).samples()
        if type(s).__name__ == "GpsFix"
    ]
    v = asked.arrays.velocity[0]
    north = (fixes[-1].latitude - fixes[0].latitude) * 6_371_000.0
    flown = (v.latitude[-1] - v.latitude[0]) * 6_371_000.0
    assert north == pytest.approx(flown, abs=5.0)


def test_columns_are_copied_and_cannot_be_written_to():
    t = np.arange(3.0)
    made = onboard.Attitude(t=t, roll=t, pitch=[0, 0, 0], yaw=t)
    t[0] = 7.0
    assert made.t[0] == made.roll[0] == 0.0
    assert made.pitch.dtype == np.float64
    with pytest.raises(ValueError, match="read-only"):
        made.roll[0] = 1.0


ROWS = 30
T = 0.02 * np.arange(ROWS)
LEVEL = np.tile([0.0, 0.0, -9.8], (ROWS, 1))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"f_b": LEVEL.T}, r"inertial 2, f_b: has the shape \(3, 30\), expected \(30, 3\)"),
        ({"f_b": LEVEL[:-1]}, r"f_b: has the shape \(29, 3\)"),
        ({"f_b": [["x"] * 3] * ROWS}, "f_b: holds something that is no number"),
        ({"w_b": T}, r"w_b: has the shape \(30,\)"),
        ({"temperature": T[1:]}, r"temperature: has the shape \(29,\), expected \(30,\)"),
        ({"t": np.where(T > 0.3, np.nan, T)}, "t: 14 times are not finite"),
        ({"t": T[::-1]}, "t: time goes back after row 0"),
        ({"t": 5.0}, r"t: has the shape \(\), expected \(n,\)"),
        ({"arrived": T[::-1]}, "arrived: the order of arrival does not rise"),
        ({"imu": 6}, "imu is 6, expected 1 to 5"),
        ({"source": "radio"}, "source is 'radio', expected RAW_IMU"),
    ],
)
def test_a_shape_that_cannot_be_is_named(given, said):
    with pytest.raises(ArraysError, match=said):
        onboard.Inertial(**({"t": T, "f_b": LEVEL, "imu": 2} | given))


def changed(columns, stream, **new):
    """The columns with others in one stream."""
    return columns | {stream: replace(columns[stream], **new)}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda c: changed(c, "inertial", f_b=c["inertial"].f_b / 9.80665), "median length is 0.9"),
        (lambda c: changed(c, "inertial", f_b=c["inertial"].f_b * np.nan), "holds no number"),
        (
            lambda c: changed(c, "inertial", f_b=c["inertial"].f_b * [1.0, -1.0, -1.0]),
            "expected -9.8: is it forward, right, down",
        ),
        (lambda c: changed(c, "inertial", w_b=np.degrees(c["inertial"].w_b)), "w_b turns 5"),
        (lambda c: changed(c, "inertial", w_b=-c["inertial"].w_b), "w_b turns -"),
        (lambda c: changed(c, "inertial", t=1e3 * c["inertial"].t), "times have to be in seconds"),
        (lambda c: changed(c, "inertial", t=1e3 + c["inertial"].t), "no time in common"),
        (
            lambda c: changed(c, "attitude", pitch=np.degrees(c["attitude"].pitch)),
            "attitude, pitch: reaches .* in radians",
        ),
        (
            lambda c: changed(c, "velocity", v_n=1e3 * c["velocity"].v_n),
            "velocities have to be in m/s",
        ),
        (
            lambda c: changed(c, "velocity", latitude=c["velocity"].t),
            "latitude and longitude belong together",
        ),
        (
            lambda c: changed(
                c, "velocity", latitude=47.0 + 0.0 * c["velocity"].t, longitude=c["velocity"].t * 0
            ),
            "velocity, latitude: reaches 47",
        ),
        (lambda c: c | {"velocity": c["attitude"]}, "velocity is no Velocity"),
        (lambda c: c | {"attitude": None}, "attitude is a NoneType, expected Attitude"),
        (lambda c: c | {"inertial": []}, "inertial is no Inertial"),
        (
            lambda c: c | {"velocity": onboard.Velocity(t=[0.0], v_n=[[0.0, 0.0, 0.0]])},
            "velocity: 1 rows are too few for a flight",
        ),
    ],
)
def test_a_unit_or_a_frame_that_cannot_be_is_named(asked, change, said):
    with pytest.raises(ArraysError, match=said):
        onboard.Arrays(**change(asked.columns))


def test_noise_sparse_attitude_and_gaps_are_no_errors(asked):
    """What is only poor goes through: the estimator judges it."""
    rng = np.random.default_rng(1)
    i, a = asked.columns["inertial"], asked.columns["attitude"]
    f_b = i.f_b + rng.normal(0.0, 3.0, i.f_b.shape)
    f_b[5:9] = np.nan
    few = slice(None, None, 20)
    sparse = onboard.Attitude(t=a.t[few], roll=a.roll[few], pitch=a.pitch[few], yaw=a.yaw[few])
    noisy = replace(i, f_b=f_b, w_b=i.w_b + rng.normal(0.0, 0.3, i.w_b.shape))
    made = onboard.Arrays(**(asked.columns | {"inertial": noisy, "attitude": sparse}))
    assert len(made.inertial) == 1


def test_the_same_columns_twice_are_refused_and_others_told_apart(asked, tmp_path):
    with pytest.raises(UsageError, match="given twice"):
        onboard.calibrate([asked.arrays, asked.arrays])
    path = tmp_path / "x.BIN"
    path.write_bytes(bytes(modern_log(6)))
    twins = [replace(onboard.Arrays.read(path), name="arrays") for _ in range(2)]
    assert onboard.calibrate(twins).files == ("arrays", "arrays (2)")
