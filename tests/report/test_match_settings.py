"""Which of what was found the simulator can be told."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from onboard.answers.match_settings import settings_of
from onboard.answers.sensor_level import calibration_settings
from onboard.core.estimate.result import Estimate, Status
from onboard.core.maths.board_orientation import board_rotation
from onboard.core.vehicle.records import Compared, Difference
from tests.report.matches_by_hand import by_hand

RECORDING = SimpleNamespace(derived=True)
"""It has no accelerometer whose settings there could be."""


@pytest.mark.parametrize(("change", "handed_back"), [(0.0, True), (0.2, True), (1.5, False)])
def test_a_wind_that_becomes_another_is_no_constant_one(change, handed_back):
    vehicle = by_hand().vehicle
    vehicle = replace(vehicle, wind=replace(vehicle.wind, change=change))
    names = {s.name for s in settings_of(vehicle, (), vehicle.effects, RECORDING)}
    assert ("SIM_WIND_SPD" in names) == handed_back
    assert ("SIM_WIND_DIR" in names) == handed_back


def test_a_wind_errs_along_itself_in_speed_and_across_in_direction():
    """Against draws of its components: the sigma is the speed's and the direction's, not both's."""
    wind = replace(
        by_hand().vehicle.wind, north=-4.0, east=3.0, sigma_north=0.02, sigma_east=0.08, change=0.0
    )
    drawn = np.random.default_rng(2).normal((wind.north, wind.east), (0.02, 0.08), (40_000, 2))
    speeds = np.hypot(*drawn.T)
    turns = np.degrees(np.arctan2(*(-drawn.T)))
    for exponent, kind, gain in ((None, 1.0, 1.0), (0.5, 0.0, np.sqrt(60.0 / wind.height))):
        of_air = replace(by_hand().vehicle, wind=replace(wind, profile_exponent=exponent))
        told = {s.name: s for s in settings_of(of_air, (), of_air.effects, RECORDING)}
        assert told["SIM_WIND_T"].value == kind
        assert told["SIM_WIND_SPD"].value == pytest.approx(gain * wind.speed)
        assert told["SIM_WIND_SPD"].sigma == pytest.approx(gain * speeds.std(), rel=0.02)
        # A direction is no surer for a wind that is stronger higher up.
        assert told["SIM_WIND_DIR"].sigma == pytest.approx(turns.std(), rel=0.02)


@pytest.mark.parametrize(("speed", "has_direction"), [(0.001, False), (0.06, True)])
def test_a_calm_comes_from_nowhere(speed, has_direction):
    """Of several flights one may be in still air: off by 1000 degrees is no direction."""
    wind = replace(
        by_hand().vehicle.wind, north=speed, east=0.0, sigma_north=0.02, sigma_east=0.02, change=0.0
    )
    vehicle = replace(by_hand().vehicle, wind=wind)
    told = {s.name: s for s in settings_of(vehicle, (), vehicle.effects, RECORDING)}
    assert told["SIM_WIND_SPD"].value == pytest.approx(speed)
    assert ("SIM_WIND_DIR" in told) == has_direction


@pytest.mark.parametrize("primary", [0.0, 1.0])
def test_the_ratio_is_that_of_the_airspeed_sensor_by_which_the_autopilot_flies(primary):
    parameters = {"ARSPD_PRIMARY": primary, "ARSPD_RATIO": 1.8, "ARSPD2_RATIO": 2.2}
    recording = SimpleNamespace(derived=True, signals=SimpleNamespace(parameters=parameters))
    reads = Difference(
        "airspeed_scale", "vehicle", {"over_equivalent": Compared(1.0, 1.1, 0.01, "1")}
    )
    (setting,) = settings_of(replace(by_hand().vehicle, wind=None), (), (reads,), recording)
    assert setting.name == ("SIM_ARSPD2_RATIO" if primary else "SIM_ARSPD_RATIO")
    assert setting.value == pytest.approx((2.2 if primary else 1.8) / 1.1**2)


@pytest.mark.parametrize("orientation", [0, 2, 6, 8, 10, 12, 16, 20, 25, 26])
def test_the_simulators_accelerometer_errs_as_that_of_a_board_that_is_mounted_turned(orientation):
    """SITL errs in the body's axes and then turns; ArduPilot corrects in the sensor's."""
    scale, offset = np.array([1.02, 0.98, 1.015]), np.array([0.2, -0.15, 0.25])
    calibration = SimpleNamespace(
        status=Status.CALIBRATED,
        parameters_known=True,
        scale=tuple(scale),
        offset=tuple(offset),
        in_force_scale=(1.0, 1.0, 1.0),
        in_force_offset=(0.0, 0.0, 0.0),
        sigma_with_its_gyroscope=np.full(6, 0.001),
        gyro_scale=(Estimate(0.0, 0.001),) * 3,
    )
    told = {"AHRS_ORIENTATION": float(orientation)}
    settings = calibration_settings(SimpleNamespace(calibration=calibration), told)
    R_bs = board_rotation(float(orientation))
    err_scale, bias = ([settings[f"SIM_ACC1_{n}_{a}"][0] for a in "XYZ"] for n in ("SCAL", "BIAS"))
    for f_b in np.random.default_rng(1).uniform(-20.0, 20.0, (5, 3)):
        raw_s = R_bs.T @ (f_b / err_scale + bias)
        assert R_bs @ ((raw_s - offset) * scale) == pytest.approx(f_b, abs=1e-9)


def test_air_that_sinks_turns_the_simulators_wind_down():
    vehicle = by_hand().vehicle
    wind = replace(vehicle.wind, north=-3.0, east=4.0, change=0.0, profile_exponent=None)
    rising = Compared(0.0, -2.5, 0.1, "m/s", 0.3)
    numbers = {**vehicle.numbers, "rising": rising}
    of_air = replace(vehicle, wind=wind, numbers=numbers)
    told = {s.name: s for s in settings_of(of_air, (), of_air.effects, RECORDING)}
    speed, up = told["SIM_WIND_SPD"].value, np.radians(told["SIM_WIND_DIR_Z"].value)
    assert speed * np.sin(up) == pytest.approx(-2.5)
    assert speed * np.cos(up) == pytest.approx(5.0)
    # Nothing that is not surely more than matters.
    calm = replace(of_air, numbers=numbers | {"rising": replace(rising, real=-0.5)})
    names = {s.name for s in settings_of(calm, (), calm.effects, RECORDING)}
    assert "SIM_WIND_DIR_Z" not in names
