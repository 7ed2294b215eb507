"""What ArduPilot applies of a parameter that was changed, and when."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.samples import ImuSample, ParameterValue, VehicleState
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, fly_messages

BOARD = "AHRS_ORIENTATION"


def turned(parameters: ParametersInForce) -> float:
    """The heading of the board's x axis in the vehicle, degrees."""
    x = parameters.R_bs[:, 0]
    return float(np.degrees(np.arctan2(x[1], x[0])))


def flying(value: float = 0.0) -> ParametersInForce:
    made = ParametersInForce()
    made.set(BOARD, value)
    made.hear(armed=True)
    return made


def test_a_board_that_is_turned_in_flight_is_turned_once_disarmed():
    made = flying()
    made.set(BOARD, 2.0)
    made.hear(armed=True)
    assert turned(made) == 0.0
    made.hear(armed=False)
    assert turned(made) == pytest.approx(90.0)
    made.set(BOARD, 4.0)
    assert turned(made) == pytest.approx(180.0)


def test_what_is_set_back_in_flight_never_was():
    made = flying()
    made.set(BOARD, 2.0)
    made.set(BOARD, 0.0)
    made.hear(armed=False)
    assert turned(made) == 0.0


def test_a_boot_applies_all_and_what_it_tells_first_is_in_force():
    made = flying()
    made.set(BOARD, 2.0)
    made.boot()
    assert turned(made) == pytest.approx(90.0)
    made.hear(armed=True)  # a log that begins in flight dumps its parameters after that
    made.set(BOARD, 4.0)
    assert turned(made) == pytest.approx(180.0)
    made.set(BOARD, 0.0)
    assert turned(made) == pytest.approx(180.0)


def test_lanes_are_made_at_boot():
    made = ParametersInForce()
    made.set("EK3_IMU_MASK", 3.0)
    made.set("EK3_IMU_MASK", 2.0)
    made.hear(armed=False)
    assert made.attitude_imu == 1
    made.boot()
    assert made.attitude_imu == 2


def test_what_is_read_anew_every_time_is_in_force_at_once():
    made = flying()
    for name in ("GPS1_POS_X", "AHRS_TRIM_X", "INS_ACCEL_FILTER", "INS_ACCOFFS_X"):
        made.set(name, 1.0)
        made.set(name, 0.25)
        assert made.values[name] == 0.25


def test_a_flight_in_which_the_board_is_said_to_be_turned_is_what_it_is_without():
    spec = FlightSpec(vehicle="copter", duration=60.0, imus=(ImuTruth(),), loop_rate=100)
    decoder = Decoder(1, 1)
    samples = [s for _, m in fly_messages(spec) for s in decoder.decode(m)]
    begins = next(s.t for s in samples if isinstance(s, ImuSample))

    def calibrated(said: float | None) -> Calibrator:
        made, told = Calibrator(), said is None
        for s in samples:
            if not told and isinstance(s, ImuSample) and s.t > begins + 30.0:
                made.feed(ParameterValue(BOARD, said))
                told = True
            made.feed(s)
        made.finish()
        return made

    assert any(isinstance(s, VehicleState) and s.armed for s in samples)
    without, with_it = calibrated(None), calibrated(2.0)
    assert with_it.calibration(1).offset == without.calibration(1).offset
    assert with_it.calibration(1).scale == without.calibration(1).scale


@pytest.mark.parametrize(
    ("values", "gain"),
    [
        ({}, None),
        ({"AHRS_TRIM_X": 0.0, "AHRS_EKF_TYPE": 3.0, "AHRS_RP_P": 0.2}, None),
        ({"AHRS_TRIM_X": 0.0, "AHRS_EKF_TYPE": 0.0, "AHRS_RP_P": 0.1}, 0.1),
        ({"AHRS_TRIM_X": 0.0, "AHRS_EKF_TYPE": 0.0}, 0.2),
        ({"AHRS_TRIM_X": 0.0, "AHRS_EKF_USE": 0.0, "AHRS_RP_P": 0.4}, 0.4),
        ({"AHRS_TRIM_X": 0.0, "AHRS_EKF_USE": 1.0, "AHRS_RP_P": 0.4}, None),
        ({"AHRS_TRIM_X": 0.0, "AHRS_RP_P": 0.1}, 0.1),
    ],
)
def test_who_finds_the_attitude(values, gain):
    """Before there was a choice of EKF it was DCM, unless the first one was switched on."""
    assert ParametersInForce(dict(values)).dcm_gain == gain


def test_when_a_correction_for_temperature_was_switched_is_kept_until_the_next_boot():
    parameters = ParametersInForce()
    parameters.set("INS_TCAL2_ENABLE", 0.0, 10.0)  # what it was before nobody knows
    parameters.set("INS_TCAL2_ENABLE", 0.0, 20.0)
    assert not parameters.switched
    parameters.set("INS_TCAL2_ENABLE", 1.0, 80.0)
    assert parameters.switched_at(2, 79.5, 0.3)  # a report comes late
    assert parameters.switched_at(2, 81.0, 0.6)
    assert not parameters.switched_at(2, 82.0, 0.3)  # and not before what it reports
    assert not parameters.switched_at(2, 70.0, 0.3)
    assert not parameters.switched_at(1, 79.5, 0.3)
    parameters.boot()
    assert not parameters.switched
