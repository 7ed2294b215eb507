"""A vehicle model by a gyroscope whose scale is wrong: it costs the model nothing, and is told."""

import pytest

from onboard.answers.match import Match, match
from sitl.builtin.airframe.air import Air
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, write_tlog

WRONG = (0.03, -0.02, 0.0)


def matched(folder, gyro_scale) -> Match:
    log = folder / "flight.tlog"
    aircraft = Aircraft(craft=Airframe().with_drag(mcoef=0.45), air=Air(north=3.0, east=-2.0))
    imus = (ImuTruth(scale=(1.02, 0.985, 1.015), gyro_scale=gyro_scale),)
    write_tlog(FlightSpec(seed=4, duration=150.0, aircraft=aircraft, imus=imus), log)
    return match(log)


def left(found: Match) -> float:
    """m/s^2 sideways, on flight that was not used."""
    return max(found.vehicle.mismatch[axis].after for axis in "xy")


@pytest.mark.slow
def test_it_costs_the_model_nothing_and_goes_back_to_the_simulator(tmp_path):
    """Uncorrected, its turns are taken for tilts of the copter: a tenth more is left, by noise."""
    wrong, right = matched(tmp_path, WRONG), matched(tmp_path, (0.0, 0.0, 0.0))
    assert left(wrong) < 1.05 * left(right)
    back = {s.name: s for s in wrong.settings}
    for axis, scale in zip("XY", WRONG, strict=False):
        told = back[f"SIM_GYR1_SCALE_{axis}"]
        assert told.value == pytest.approx(100.0 * scale, abs=3.0 * told.sigma)
        assert told.sigma < 0.2
    assert not any("GYR" in s.name for s in right.settings)
    assert "SIM_GYR1_SCALE_Z" not in back
