"""Two readers of one flight, and each stream against the others: units, signs, clocks."""

from __future__ import annotations

import functools
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample, ImuSource
from onboard.recordings.opening import open_recording

pytestmark = pytest.mark.recordings
EARTH_RADIUS = 6.371e6


@dataclass(slots=True)
class Read:
    """What a recording has: rows of time, specific force and rate by stream, fixes, attitudes."""

    inertial: dict[tuple[int, ImuSource], np.ndarray]
    fixes: list[GpsFix]
    attitudes: list[AttitudeSample]


@functools.cache
def read(path: Path) -> Read:
    """Each recording is read once, for all tests."""
    rows, fixes, attitudes = defaultdict(list), [], []
    for s in open_recording(path).samples():
        if isinstance(s, ImuSample):
            rows[s.imu, s.source].append((s.t, *s.f_b, *(s.w_b or (0.0, 0.0, 0.0))))
        elif isinstance(s, GpsFix) and s.fix_type >= 3:
            fixes.append(s)
        elif isinstance(s, AttitudeSample):
            attitudes.append(s)
    return Read({stream: np.array(table) for stream, table in rows.items()}, fixes, attitudes)


def inertial(path: Path, imu: int, source: ImuSource) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (n,), specific force (n, 3), rate (n, 3)."""
    table = read(path).inertial[imu, source]
    return table[:, 0], table[:, 1:4], table[:, 4:]


def fixes(path: Path) -> list[GpsFix]:
    return read(path).fixes


@pytest.mark.slow
@pytest.mark.parametrize("imu", [1, 2])
def test_telemetry_and_log_of_one_flight_agree(recordings, imu):
    t_log, f_log, w_log = inertial(recordings / "sitl/c01.BIN", imu, ImuSource.LOG)
    source = ImuSource.HIGHRES_IMU if imu == 1 else ImuSource.SCALED_IMU
    t_link, f_link, w_link = inertial(recordings / "sitl/c01.tlog", imu, source)
    for log, link, limit in ((f_log, f_link, 0.15), (w_log, w_link, 0.02)):
        there = np.stack([np.interp(t_log, t_link, link[:, k]) for k in range(3)], axis=1)
        assert np.sqrt(np.mean((log - there) ** 2)) < limit
        assert log.std() > 5.0 * limit


@pytest.mark.slow
def test_fixes_of_one_flight_agree(recordings):
    log, link = fixes(recordings / "sitl/c01.BIN"), fixes(recordings / "sitl/c01.tlog")
    t = np.array([f.t for f in link])
    for name, limit in (("v_n", 0.3), ("v_e", 0.3), ("altitude", 0.3)):
        values = np.interp([f.t for f in log], t, [getattr(f, name) for f in link])
        assert np.sqrt(np.mean((values - [getattr(f, name) for f in log]) ** 2)) < limit
    assert np.allclose(log[0].latitude, link[0].latitude, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["sitl/c01.BIN", "sitl/c02.BIN", "sitl/a01.tlog", "real/real-quad-08.BIN"]
)
def test_positions_move_with_the_velocities(recordings, name):
    flight = fixes(recordings / name)
    t = np.array([f.t for f in flight])
    keep = np.concatenate([[True], np.diff(t) > 0.1])
    flight, t = [f for f, k in zip(flight, keep, strict=True) if k], t[keep]
    step = np.diff(t)
    north = np.diff([f.latitude for f in flight]) * EARTH_RADIUS / step
    v_n = np.array([f.v_n for f in flight])
    slope = np.polyfit((v_n[1:] + v_n[:-1]) / 2.0, north, 1)[0]
    assert slope == pytest.approx(1.0, abs=0.02)
    if flight[0].v_d is not None:
        down = -np.diff([f.altitude for f in flight]) / step
        v_d = np.array([f.v_d for f in flight])
        assert np.polyfit((v_d[1:] + v_d[:-1]) / 2.0, down, 1)[0] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(
    "name", ["sitl/c01.BIN", "real/real-quad-08.BIN", "real/real-quad-14-crash.BIN"]
)
def test_attitude_turns_with_the_gyroscopes(recordings, name):
    path = recordings / name
    t, _, w = inertial(path, 1, ImuSource.LOG)
    attitude = read(path).attitudes
    t_a = np.array([s.t for s in attitude])
    roll, yaw = (np.unwrap([getattr(s, angle) for s in attitude]) for angle in ("roll", "yaw"))
    pitch = np.array([s.pitch for s in attitude])
    # p = d roll/dt - d yaw/dt sin(pitch)
    by_attitude = np.diff(roll) - np.diff(yaw) * np.sin((pitch[1:] + pitch[:-1]) / 2.0)
    turned = np.concatenate([[0.0], np.cumsum(w[1:, 0] * np.diff(t))])
    by_gyroscope = np.diff(np.interp(t_a, t, turned))
    assert np.corrcoef(by_attitude, by_gyroscope)[0, 1] > 0.95


@pytest.mark.slow
@pytest.mark.parametrize("name", ["b01.tlog", "c01.tlog", "c01.BIN"])
def test_at_rest_the_specific_force_points_up(recordings, name):
    path = recordings / "sitl" / name
    source = ImuSource.LOG if name.endswith("BIN") else ImuSource.RAW_IMU
    _, f_b, _ = inertial(path, 1, source)
    assert f_b[:50].mean(axis=0) == pytest.approx([0.0, 0.0, -9.8], abs=0.6)
