"""A flight is dated by most of its fixes, and as long as the autopilot's clock says."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from onboard.recordings.provenance import provenance
from tests.recordings.dataflash_writer import DataflashWriter
from tests.recordings.telemetry_writer import px4_log, telemetry

WEEK, WEEK_S = 2300, 604800.0
BEGAN = 315964800 + WEEK * WEEK_S + 1.0 - 18.0
"""Unix time of the first fix: GPS time less 18 leap seconds."""
N, STEP_S = 100, 0.2
SPAN = (BEGAN, BEGAN + STEP_S * (N - 1))
OF_TODAY = "TimeUS,Status,GMS,GWk"
OF_OLD = "T,Status,TimeMS,Week"
OLDEST = "Status,TimeMS,Week"


def fixes():
    """Columns time since boot (s), status, ms of the week, week."""
    t = STEP_S * np.arange(N)
    return np.column_stack([100.0 + t, np.full(N, 3), 1000 + 1e3 * t, np.full(N, WEEK)])


def span(path, rows, columns=OF_TODAY):
    """When a log of such fixes began and ended."""
    log = DataflashWriter()
    log.format(10, "IMU", "Qffffff", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    log.format(12, "GPS", {OF_TODAY: "QBIH", OF_OLD: "IBIH", OLDEST: "BIH"}[columns], columns)
    for boot, *rest in rows.tolist():
        log.add("IMU", round(1e6 * boot), 0.0, 0.0, 0.0, 0.0, 0.0, -9.8)
        clock = round(boot * (1e3 if columns == OF_OLD else 1e6))
        values = [clock, *map(round, rest)]
        log.add("GPS", *values[columns == OLDEST :])
    path.write_bytes(bytes(log))
    found = provenance(path)
    return found.began_unix_s, found.ended_unix_s


@pytest.mark.parametrize("columns", [OF_TODAY, OF_OLD, OLDEST])
@pytest.mark.parametrize("weeks", [512, -700, 1])
@pytest.mark.parametrize("at", [0, N // 2, N - 1])
def test_one_record_with_another_week_changes_nothing(tmp_path, columns, weeks, at):
    rows = fixes()
    rows[at, 3] += weeks
    began, ended = span(tmp_path / "x.BIN", rows, columns)
    inside = (at == 0) * STEP_S, (at == N - 1) * STEP_S  # what is left of the fixes
    assert began - inside[0] == pytest.approx(SPAN[0], abs=1e-6)
    assert ended + inside[1] == pytest.approx(SPAN[1], abs=1e-6)


def test_weeks_of_a_receiver_that_finds_its_date_late_are_none(tmp_path):
    """Less than half of the flight: then most say when it was."""
    rows = fixes()
    rows[: N // 3, 3] -= 1024
    began, ended = span(tmp_path / "x.BIN", rows)
    assert SPAN[0] < began < ended == pytest.approx(SPAN[1], abs=1e-6)


@pytest.mark.parametrize("late", [1e5, -90.0])
def test_a_damaged_time_since_boot_changes_nothing(tmp_path, late):
    rows = fixes()
    rows[N // 2, 0] += late
    assert span(tmp_path / "x.BIN", rows) == pytest.approx(SPAN, abs=1e-6)


def test_a_week_that_ends_in_flight_goes_on(tmp_path):
    for columns in (OF_TODAY, OF_OLD, OLDEST):
        rows = fixes()
        rows[:, 2] += 1e3 * WEEK_S - 11_000.0
        rows[N // 2 :, 2:] += -1e3 * WEEK_S, 1
        moved = np.array(SPAN) + WEEK_S - 11.0
        assert span(tmp_path / "x.BIN", rows, columns) == pytest.approx(moved, abs=1e-6)


def test_a_receiver_that_learns_of_leap_seconds_makes_the_flight_no_longer(tmp_path):
    """PX4 logs UTC as the receiver has it: two seconds of its own are no flight."""
    data, at = bytearray(px4_log(20)), 0
    times = [1_700_000_000_000_000 + 2_000_000 + 200_000 * k for k in range(100)]
    for k, time in enumerate(times):
        at = data.index(struct.pack("<Q", time), at)
        if k < 30:
            data[at : at + 8] = struct.pack("<Q", time + 2_000_000)
    path = tmp_path / "x.ulg"
    path.write_bytes(data)
    found = provenance(path)
    assert found.began_unix_s == pytest.approx(times[0] / 1e6, abs=1e-3)
    assert found.ended_unix_s == pytest.approx(times[-1] / 1e6, abs=1e-3)


def test_both_boots_of_one_telemetry_are_dated(tmp_path):
    """Each by its own clock, and not by one message of either that is wrong."""
    log = telemetry(4)
    for began, first in ((1.7e9, 300.0), (1.7e9 + 500.0, 5.0)):
        for k in range(60):
            year = 3.15e7 * (k == 20)
            unix = round(1e6 * (began + k + year))
            log.add(mav.MAVLink_system_time_message(unix, round(1e3 * (first + k))))
    path = tmp_path / "x.tlog"
    path.write_bytes(bytes(log))
    found = provenance(path)
    both = found.began_unix_s, found.ended_unix_s
    assert both == pytest.approx((1.7e9, 1.7e9 + 500.0 + 59.0), abs=1e-3)


@pytest.mark.parametrize("unix", [2**64 - 1, 0])
def test_a_date_that_is_none_is_not_told(tmp_path, unix):
    log = telemetry(4)
    log.add(mav.MAVLink_system_time_message(unix, 5000))
    path = tmp_path / "x.tlog"
    path.write_bytes(bytes(log))
    assert provenance(path).began_unix_s is None


def test_no_clock_that_is_no_number_ends_it(tmp_path):
    log = DataflashWriter()
    log.format(10, "IMU", "Qffffff", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    log.format(12, "GPS", "dBdd", OF_TODAY)
    log.add("IMU", 1, 0.0, 0.0, 0.0, 0.0, 0.0, -9.8)
    for boot in (math.inf, math.nan, -math.inf, 1e308, 5.0):
        for week in (math.inf, math.nan, 1e308, float(WEEK)):
            log.add("GPS", boot, 3, 1000.0, week)
    path = tmp_path / "x.BIN"
    path.write_bytes(bytes(log))
    assert provenance(path).began_unix_s == pytest.approx(BEGAN, abs=1e-6)
