"""What a recording of a vehicle with an airframe holds, and how it is flown again."""

import numpy as np
import pytest

from sitl import recording
from sitl.again import fly_again
from sitl.builtin.airframe import motors
from sitl.builtin.airframe.air import Air
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.airframe.wing import Wing
from sitl.errors import SitlError
from sitl.recorded_motion import recorded_motion
from sitl.recording import FlightSpec

CRAFTS = {"copter": Airframe(battCapacityAh=5.0, refBatRes=0.02), "plane": Wing(airspeed_ratio=2.4)}
WIND = Air(north=3.0, east=-2.0)


def spec_of(vehicle, duration=60.0, **more):
    aircraft = Aircraft(craft=CRAFTS[vehicle], air=WIND)
    return FlightSpec(vehicle=vehicle, duration=duration, seed=6, aircraft=aircraft, **more)


@pytest.fixture(scope="module", params=["copter", "plane"])
def flight(request):
    return recording.run(spec_of(request.param, rates={"WIND": 5.0}))


def of(flight, name):
    return [m for _, m in flight.messages if m.get_type() == name]


def rows_of(flight, times):
    piece = flight.pieces[-1]
    inside = [i for i, t in enumerate(times) if piece.start < t < piece.end]
    return inside, [piece.index(times[i]) for i in inside]


def test_outputs_are_sent_as_they_are(flight):
    messages = of(flight, "SERVO_OUTPUT_RAW")
    inside, rows = rows_of(flight, [m.time_usec * 1e-6 for m in messages])
    sent = np.array([[getattr(messages[i], f"servo{k}_raw") for k in (1, 2, 3, 4)] for i in inside])
    true = flight.pieces[-1].trajectory.outputs.pwm[rows]
    assert len(inside) > 1600
    assert np.abs(sent - true).max() < 3.0  # half a microsecond, and a millisecond of change
    assert sent.max() > 1500


def test_battery_and_charge_are_sent(flight):
    outputs = flight.pieces[-1].trajectory.outputs
    status = of(flight, "BATTERY_STATUS")
    assert len(status) > 250
    volts = np.array([m.voltages[0] * 1e-3 for m in status])
    assert volts.min() == pytest.approx(outputs.voltage.min(), abs=0.1)
    used = [m.current_consumed for m in status]
    assert np.all(np.diff(used) >= 0)
    assert used[-1] == pytest.approx(outputs.consumed[-1], rel=0.02)
    assert {m.battery_remaining for m in status} <= set(range(101))


def test_velocity_and_throttle_are_there(flight):
    assert len(of(flight, "LOCAL_POSITION_NED")) > 500
    throttle = [m.throttle for m in of(flight, "VFR_HUD")]
    assert 15 < max(throttle) <= 100


def test_airspeed_is_what_the_autopilot_would_say(flight):
    told = of(flight, "VFR_HUD")[400:500]
    speeds = np.array([m.airspeed for m in told])
    ground = np.array([m.groundspeed for m in told])
    if flight.spec.vehicle == "copter":  # no sensor and no wind estimate
        assert np.abs(speeds - ground).max() < 4.0
        assert all(m.speed == 0.0 for m in of(flight, "WIND"))
    else:
        outputs = flight.pieces[-1].trajectory.outputs
        true = flight.pieces[-1].trajectory.airspeed[outputs.indicated > 10.0]
        scale = np.median(outputs.indicated[outputs.indicated > 10.0] / true)
        assert scale == pytest.approx(np.sqrt(2.0 / 2.4) * np.sqrt(0.945), rel=0.01)
        assert max(m.speed for m in of(flight, "WIND")) < 6.0


def test_the_parameters_of_an_integrators_log_are_listed(flight):
    values = {m.param_id: m.param_value for m in of(flight, "PARAM_VALUE")}
    if flight.spec.vehicle == "copter":
        assert values["MOT_SPIN_MIN"] == pytest.approx(0.15)
        assert values["MOT_THST_EXPO"] == pytest.approx(0.65)
        assert values["FRAME_CLASS"] == 1
        assert [values[f"SERVO{i}_FUNCTION"] for i in (1, 2, 3, 4)] == [33, 34, 35, 36]
    else:
        assert values["ARSPD_RATIO"] == 2.0
        assert values["SERVO3_FUNCTION"] == 70
    assert not [name for name in values if name.startswith("SIM_WIND")]


def test_a_truth_record_says_what_is_not_nominal():
    record = recording.truth_record(spec_of("copter"))
    assert set(record["vehicle_level"]) == {"wind", "voltage_sag"}
    assert set(recording.truth_record(spec_of("plane"))["vehicle_level"]) == {
        "wind",
        "airspeed_scale",
    }
    assert "vehicle_level" not in recording.truth_record(FlightSpec())


def test_without_an_airframe_nothing_is_told_of_one():
    flight = recording.run(FlightSpec(duration=20.0))
    assert "MOT_SPIN_MIN" not in {m.param_id for m in of(flight, "PARAM_VALUE")}
    assert all(piece.trajectory.outputs is None for piece in flight.pieces)


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", ["copter", "plane"])
def test_a_recording_flown_again_is_the_same_motion(vehicle, tmp_path):
    first, second = tmp_path / "first.tlog", tmp_path / "second.tlog"
    recording.write_tlog(spec_of(vehicle, 70.0), first)
    record = fly_again(first, CRAFTS[vehicle], Air(north=-1.0), second)
    assert record["vehicle_level"]["wind"]["north"] == -1.0
    one, two = (recorded_motion(path).motion for path in (first, second))
    assert abs(one.n - two.n) < 500
    inside = slice(8_000, min(one.n, two.n) - 12_000)
    lags = range(-400, 401, 40)
    misfit = [np.mean((one.v_n - np.roll(two.v_n, k, 0)[: one.n])[inside] ** 2)
              for k in lags if len(two.v_n) >= one.n] or [
        np.mean((one.v_n[: two.n] - np.roll(two.v_n, k, 0))[inside] ** 2) for k in lags
    ]  # fmt: skip
    assert np.sqrt(min(misfit)) < 0.2


@pytest.mark.slow
def test_more_drag_flown_again_takes_more_tilt_and_thrust(tmp_path):
    first = tmp_path / "first.tlog"
    recording.write_tlog(spec_of("copter", 110.0), first)
    motion = recorded_motion(first).motion
    light, heavy = (
        Aircraft(craft=craft, motion=motion).fly(
            recording.Environment(), motion.start, seed=0, duration=0.0
        )
        for craft in (Airframe(), Airframe().with_drag(mcoef=0.6))
    )
    fast = np.hypot(*light.v_n[:, :2].T) > 5.0
    tilt = [np.arccos(f.R_nb[fast, 2, 2]).mean() for f in (light, heavy)]
    assert tilt[1] > 1.2 * tilt[0]
    command = [
        motors.command_of_pulse(Airframe(), f.outputs.pwm[fast]).mean() for f in (light, heavy)
    ]
    assert command[1] > command[0]


def test_what_cannot_be_flown_again_is_said(tmp_path):
    path = tmp_path / "empty.tlog"
    path.write_bytes(b"")
    with pytest.raises(SitlError, match="no velocity"):
        recorded_motion(path)
