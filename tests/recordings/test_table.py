"""Tables by a column map: units, frames, rates of their own, and what is wrong with them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from onboard.core.inputs.samples import (
    AirData,
    AttitudeSample,
    Battery,
    GpsFix,
    ImuSample,
    Outputs,
    ParameterValue,
    VehicleState,
)
from onboard.core.maths.frames import rotation_from_euler
from onboard.errors import ConfigurationError, RecordingError
from onboard.recordings.table import open_table
from onboard.recordings.table_map import UNITS, WIDTHS, load_map
from tests.recordings.table_writer import MAP, MOTORS, cells, moving, write_table

ANGLES = (0.1, -0.2, 0.7)
FORCE = (0.3, -0.4, -9.5)
RATES = (0.01, 0.02, -0.03)
VELOCITY = (3.0, -2.0, -0.5)
"""NED."""
N = 60


@pytest.fixture
def table(tmp_path):
    rows = []
    for k in range(N):
        t = 0.02 * k
        rows += [
            (t, cells(AttitudeSample(t, *ANGLES))),
            (t + 0.001, cells(ImuSample(t, 1, FORCE, RATES))),
            (t + 0.002, moving(t, VELOCITY, tuple(t * v for v in VELOCITY))[1]),
            (t + 0.003, cells(Outputs(t, (1150.0, 1550.0, 1950.0, 2000.0)))),
            (t + 0.004, cells(Battery(t, 15.5))),
        ]
    path = tmp_path / "flight.csv"
    write_table(rows, path)
    return path


@pytest.fixture
def columns(tmp_path):
    def written(text=MAP + MOTORS):
        path = tmp_path / "map.toml"
        path.write_text(text)
        return path

    return written


def samples(table, columns, kind):
    return [s for s in open_table(table, columns).samples() if isinstance(s, kind)]


def test_frames_and_units_become_those_of_the_core(table, columns):
    its = columns()
    attitude = samples(table, its, AttitudeSample)[7]
    assert (attitude.roll, attitude.pitch, attitude.yaw) == pytest.approx(ANGLES, abs=1e-7)
    imu = samples(table, its, ImuSample)[7]
    assert imu.f_b == pytest.approx(FORCE, rel=1e-6)
    assert imu.w_b == pytest.approx(RATES, rel=1e-6)
    fix = samples(table, its, GpsFix)[3]
    assert (fix.v_n, fix.v_e, fix.v_d) == pytest.approx(VELOCITY, rel=1e-6)
    assert samples(table, its, Battery)[0].voltage == pytest.approx(15.5)
    out = samples(table, its, Outputs)[0]
    assert out.normalised
    assert out.values == pytest.approx((0.0, 0.5, 1.0, 1.0))
    assert samples(table, its, VehicleState)[0].kind == "copter"


def test_samples_come_in_order_of_time_and_can_be_read_twice(table, columns):
    recording = open_table(table, columns())
    times = [s.t for s in recording.samples()]
    assert times == sorted(times)
    assert times == [s.t for s in recording.samples()]
    assert recording.counts["force"] == N


def test_a_wind_that_was_measured_is_turned_to_north_and_east(table, columns):
    """East-north-up in centimetres, and empty cells are none."""
    wind = '\n[wind]\ncolumns = ["ve", "vn"]\nunit = "cm/s"\nsigma = 25\n'
    found = [s for s in open_table(table, columns(MAP + wind)).samples() if isinstance(s, AirData)]
    assert len(found) == N
    for air in found:
        assert air.wind_n == pytest.approx(0.01 * VELOCITY[0])
        assert air.wind_e == pytest.approx(0.01 * VELOCITY[1])
        assert air.wind_sigma == pytest.approx(0.25)


AIRSPEED = """
[airspeed]
column = "m1"
unit = "cm/s"

[origin]
altitude = 2000
"""
ROOT_OF_DENSITY_2000_M = 0.9065
"""Of 1.0066 over 1.2250 kg/m^3, as tables of the standard atmosphere have them."""
DENSITY_HEIGHT_M = 9950.0
"""Over which density falls by e, there: 275.15 K / (0.0065 K/m * 4.256)."""


@pytest.mark.parametrize("kind", ["", "equivalent"])
def test_an_airspeed_is_what_a_pitot_tube_says(table, columns, kind):
    text = AIRSPEED.replace("unit", f'kind = "{kind}"\nunit') if kind else AIRSPEED
    assert {air.airspeed for air in samples(table, columns(MAP + text), AirData)} == {11.5}


@pytest.mark.parametrize("absent", ["velocity", "position", ""])
def test_a_true_airspeed_becomes_what_a_pitot_tube_says_at_its_height(table, columns, absent):
    """Whatever the height is told by; and less with height."""
    text = re.sub(rf"\[{absent}\]\n.*\n\n?", "", MAP) if absent else MAP
    text += AIRSPEED.replace("unit", 'kind = "true"\nunit')
    told = [air.airspeed for air in samples(table, columns(text), AirData)]
    assert len(told) == N
    assert told[0] == pytest.approx(11.5 * ROOT_OF_DENSITY_2000_M, rel=1e-4)
    climbed = -VELOCITY[2] * 0.02 * N
    assert told[-1] / told[0] == pytest.approx(1.0 - 0.5 * climbed / DENSITY_HEIGHT_M, abs=1e-5)


def test_an_airspeed_of_another_kind_is_named(table, columns):
    with pytest.raises(ConfigurationError, match=r"airspeed\.kind is 'indicated'"):
        open_table(table, columns(MAP + AIRSPEED.replace("unit", 'kind = "indicated"\nunit')))


@pytest.mark.parametrize(
    ("wind", "said"),
    [
        ('columns = ["ve"]', "must name 2 columns"),
        ('columns = ["ve", "vn"]\nsigma = 0', "positive"),
    ],
)
def test_a_wind_that_makes_no_sense_is_named(table, columns, wind, said):
    with pytest.raises(ConfigurationError, match=f"wind.*{said}"):
        open_table(table, columns(f"{MAP}\n[wind]\n{wind}\n"))


def test_fixes_are_no_more_than_asked_for(table, columns):
    rate = 5.0
    fixes = samples(table, columns(f"fix_rate = {rate}\n" + MAP), GpsFix)
    steps = np.diff([f.t for f in fixes])
    assert steps.min() > 1.0 / rate - 0.021


def test_a_position_alone_becomes_a_velocity(table, columns):
    text = MAP.replace('[velocity]\ncolumns = ["ve", "vn", "vu"]\n', "")
    fixes = samples(table, columns(text), GpsFix)
    for fix in fixes:
        assert (fix.v_n, fix.v_e, fix.v_d) == pytest.approx(VELOCITY, rel=1e-5)


@pytest.mark.parametrize("step", [0.02, 0.5, 2.0])
def test_a_position_of_any_rate_becomes_a_velocity_and_a_gap_does_not(tmp_path, columns, step):
    """Empty cells between, as of a receiver; and twenty steps that nobody measured."""
    fixes, gap = slow(tmp_path, columns, step, n=60)
    assert len(fixes) > 30 if step >= 0.1 else fixes
    for fix in fixes:
        assert (fix.v_n, fix.v_e, fix.v_d) == pytest.approx(VELOCITY, rel=1e-5)
        assert not gap[0] < fix.t < gap[1]


def slow(tmp_path, columns, step, n):
    """Fixes of a table with a position every ``step`` s, and when it has none, s."""
    times, gap = 0.02 * np.arange(n * round(50 * step)), (20 * step, 40 * step)
    rows = []
    for k, t in enumerate(times):
        still = cells(AttitudeSample(t, *ANGLES)) | cells(ImuSample(t, 1, FORCE, RATES))
        there = k % round(50 * step) == 0 and not gap[0] < t < gap[1]
        place = moving(t, VELOCITY, tuple(t * v for v in VELOCITY))[1] if there else {}
        rows.append((t, still | {name: place[name] for name in ("e", "n", "u") if place}))
    write_table(rows, tmp_path / "slow.csv")
    text = MAP.replace('[velocity]\ncolumns = ["ve", "vn", "vu"]\n', "")
    return samples(tmp_path / "slow.csv", columns(text), GpsFix), gap


def test_a_position_that_lasts_no_span_of_a_velocity_is_named(tmp_path, columns):
    """Twenty rows of a kilohertz: enough of them, but no flight."""
    rows = []
    for k in range(400):
        t = 0.001 * k
        still = cells(AttitudeSample(t, *ANGLES)) | cells(ImuSample(t, 1, FORCE, RATES))
        rows.append((t, still | (moving(t, VELOCITY, VELOCITY)[1] if k < 50 else {})))
    write_table(rows, tmp_path / "short.csv")
    text = MAP.replace('[velocity]\ncolumns = ["ve", "vn", "vu"]\n', "")
    with pytest.raises(RecordingError, match=r"short\.csv: e, n, u last too short"):
        open_table(tmp_path / "short.csv", columns(text))


def test_acceleration_is_given_what_an_accelerometer_feels(table, columns):
    text = MAP.replace('unit = "g"', 'unit = "g"\nkind = "acceleration"')
    f = samples(table, columns(text), ImuSample)[5].f_b
    down_b = rotation_from_euler(*ANGLES).T[:, 2]
    assert f == pytest.approx(np.array(FORCE) - 9.80665 * down_b, abs=1e-5)


def test_rates_that_are_not_measured_are_the_slope_of_the_attitude(tmp_path, columns):
    rows = []
    for k in range(200):
        t = 0.01 * k
        rows.append((t, cells(AttitudeSample(t, 0.0, 0.0, 0.8 * t)) | cells(
            ImuSample(t, 1, FORCE)) | moving(t, VELOCITY, VELOCITY)[1]))  # fmt: skip
    path = tmp_path / "turn.csv"
    write_table(rows, path)
    text = MAP.replace('[rates]\ncolumns = ["gx", "gy", "gz"]\nunit = "deg/s"\nlow_pass = 20\n', "")
    for imu in samples(path, columns(text), ImuSample)[5:-5]:
        assert imu.w_b == pytest.approx((0.0, 0.0, 0.8), abs=1e-5)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"qz"]', '"nope"]', "no column 'nope'"),
        ('"qz"]', "]", "attitude.quaternion must name 4 columns, has 3"),
        ('unit = "deg/s"', 'unit = "rpm"', "rates.unit is 'rpm'"),
        ('world = "enu"', 'world = "ecef"', "world is 'ecef'"),
        ("[time]", "[clock]", "clock is unknown"),
        ('unit = "g"', 'unit = "g"\nflavour = 1', "force.flavour is unknown"),
        ("range = [1150, 1950]", "range = [2, 1]", "motors.range must rise"),
        ('column = "t_ms"', "column = 3", "time.column must name columns"),
        ('vehicle = "copter"', "fix_rate = 0", "fix_rate must be positive"),
        ('vehicle = "copter"', "vehicle = ", "not TOML"),
        ("[voltage]", '[throttle]\ncolumn = "m1"\n[voltage]', "one of them is too many"),
    ],
)
def test_what_is_wrong_is_named(table, columns, old, new, said):
    text = MAP + MOTORS
    assert old in text
    with pytest.raises((ConfigurationError, RecordingError), match=said) as caught:
        open_table(table, columns(text.replace(old, new, 1)))
    assert "map.toml" in str(caught.value) or "flight.csv" in str(caught.value)


def test_throttle_and_rudder_of_a_plane_are_outputs_with_their_functions(table, columns):
    levers = """
[throttle]
column = "m1"
unit = "%"

[rudder]
column = "m2"
unit = "%"
"""
    text = MAP.replace("copter", "plane") + levers
    told = samples(table, columns(text), ParameterValue)
    assert {p.name: p.value for p in told}["SERVO1_FUNCTION"] == 70
    assert {p.name: p.value for p in told}["SERVO2_FUNCTION"] == 21
    # 1150 and 1550 % in the table: pulses of 1 ms and a half more for all of them.
    assert samples(table, columns(text), Outputs)[0].values == (12_500.0, 9_250.0)


@pytest.mark.parametrize("unit", UNITS["motors"])
def test_idle_and_full_of_the_motors_are_in_the_unit_of_the_columns(table, columns, unit):
    """The fraction of the way from idle to full knows no unit."""
    text = MAP + MOTORS.replace("range", f'unit = "{unit}"\nrange')
    out = samples(table, columns(text), Outputs)[0]
    assert out.normalised
    assert out.values == pytest.approx((0.0, 0.5, 1.0, 1.0))


def test_a_rudder_without_throttle_is_refused(table, columns):
    with pytest.raises(ConfigurationError, match="of no use without"):
        load_map(columns(MAP + '[rudder]\ncolumn = "m2"\n'))


def test_a_table_that_is_none_is_named(tmp_path, columns):
    path = tmp_path / "x.csv"
    with pytest.raises(RecordingError, match="no such file"):
        open_table(path, columns())
    path.write_bytes(b"\xff\xfe\x00\x00")
    with pytest.raises(RecordingError, match="no table of text"):
        open_table(path, columns())
    path.write_text("a,b\n1,2\n")
    with pytest.raises(RecordingError, match="no column 't_ms'"):
        open_table(path, columns())


def test_a_column_of_words_is_no_flight(table, columns):
    table.write_text(table.read_text().replace(".", "x"))
    with pytest.raises(RecordingError, match="which is no number"):
        open_table(table, columns())


def test_an_absent_map_is_named(tmp_path):
    with pytest.raises(ConfigurationError, match=r"absent\.toml: No such file"):
        load_map(tmp_path / "absent.toml")


def test_places_follow_velocities(table, columns):
    first, *_, last = samples(table, columns(), GpsFix)
    earth = 6.371e6
    flown = last.t - first.t
    north, east = VELOCITY[0] * flown, VELOCITY[1] * flown
    assert (last.latitude - first.latitude) * earth == pytest.approx(north, rel=0.02)
    along = earth * np.cos(first.latitude)
    assert (last.longitude - first.longitude) * along == pytest.approx(east, rel=0.02)
    assert last.altitude - first.altitude == pytest.approx(-VELOCITY[2] * flown, rel=0.02)


def test_the_map_of_the_manual_is_one(columns):
    manual = Path(__file__).parents[2] / "docs" / "matching.md"
    (text,) = re.findall(r"```text\n(vehicle.*?)```", manual.read_text(encoding="utf-8"), re.DOTALL)
    chosen = load_map(columns(text))
    assert set(chosen.quantities) == {*WIDTHS, "attitude", "motors"} - {"throttle", "rudder"}
    assert chosen.quaternion
    assert chosen.airborne
    assert chosen.true_airspeed


def twice(table, later):
    """The rows of a table, and again from ``later`` s on; the line of the first of these."""
    head, *rows = table.read_text().splitlines()
    parted = [row.split(",", 1) for row in rows]
    shifted = [f"{float(t) + 1e3 * later},{rest}" for t, rest in parted]
    table.write_text("\n".join([head, *rows, *shifted]) + "\n")
    return len(rows) + 2


def test_a_clock_that_begins_anew_is_refused_with_its_line(table, columns):
    """Between the times of the first run and at the same ones: neither is one flight."""
    whole = table.read_text()
    for later in (0.0, 0.0005):
        table.write_text(whole)
        line = twice(table, later)
        with pytest.raises(RecordingError, match=f"flight.csv: line {line}: t_ms goes back"):
            open_table(table, columns())


def test_a_clock_that_goes_on_is_one_flight(table, columns):
    twice(table, 0.02 * N)
    assert open_table(table, columns()).duration_s == pytest.approx(0.02 * (2 * N - 1))


def test_quantities_may_stand_one_below_the_other(table, columns):
    """As tables are that were joined: each has an order of its own, and blank lines are none."""
    text = columns()
    before = list(open_table(table, text).samples())
    head, *rows = table.read_text().splitlines()
    which = {row: tuple(cell != "" for cell in row.split(",")[1:]) for row in rows}
    table.write_text("\n".join([head, *sorted(rows, key=lambda row: which[row])]) + "\n\n")
    assert list(open_table(table, text).samples()) == before


def test_a_clock_of_dates_and_decimals_with_a_comma_are_said_to_be_no_numbers(table, columns):
    its, text = columns(), table.read_text()
    head, *rows = text.splitlines()
    dates = [f"2026-01-01T00:00:{k:02d}Z,{row.split(',', 1)[1]}" for k, row in enumerate(rows)]
    table.write_text("\n".join([head, *dates]))
    with pytest.raises(RecordingError, match="t_ms holds '2026-01-01T00:00:00Z', which is no num"):
        open_table(table, its)
    table.write_text(text.replace(",", ";").replace(".", ","))
    with pytest.raises(RecordingError, match=r"holds '[-0-9]+,[0-9]+', which is no number"):
        open_table(table, its)


def test_a_column_of_words_is_named_though_its_clock_has_numbers(table, columns):
    head, *rows = table.read_text().splitlines()
    place = head.split(",").index("ay")
    worded = []
    for row in rows:
        its = row.split(",")
        its[place] = "n. a." if its[place] else ""
        worded.append(",".join(its))
    table.write_text("\n".join([head, *worded]))
    with pytest.raises(RecordingError, match=r"ay holds 'n\. a\.', which is no number"):
        open_table(table, columns())
