"""Of two receivers, the parameters are those of the one that is watched."""

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.gps_clock import fix_clock
from onboard.core.inputs.parameters import ParametersInForce, receiver_names
from onboard.core.inputs.samples import GpsFix, ImuSample
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.gps_lever_arm import GpsLeverArm

PLACES = {1: (0.1, 0.2, 0.3), 2: (-0.5, 0.0, -0.25)}
DELAYS = {1: 110.0, 2: 200.0}


def told(*, new, receiver):
    made = ParametersInForce(receiver=receiver)
    for k in (1, 2):
        names = receiver_names(k)
        for axis, place in zip("XYZ", PLACES[k], strict=True):
            made.set(names[axis][0 if new else 1], place)
        made.set(names["DELAY_MS"][0 if new else 1], DELAYS[k])
        made.set(names["TYPE"][0 if new else 1], 2.0)
    return made


def test_names_are_those_of_the_firmware():
    assert receiver_names(1)["DELAY_MS"] == ("GPS1_DELAY_MS", "GPS_DELAY_MS")
    assert receiver_names(2)["DELAY_MS"] == ("GPS2_DELAY_MS", "GPS_DELAY_MS2")
    assert receiver_names(2)["X"] == ("GPS2_POS_X", "GPS_POS2_X")
    assert receiver_names(2)["TYPE"] == ("GPS2_TYPE", "GPS_TYPE2")


@pytest.mark.parametrize("new", [True, False])
@pytest.mark.parametrize("receiver", [1, 2])
def test_delay_and_antenna_are_its_own(new, receiver):
    values = told(new=new, receiver=receiver)
    np.testing.assert_array_equal(values.antenna, PLACES[receiver])
    assert values.gps_delay_configured == pytest.approx(1e-3 * DELAYS[receiver])
    clock = fix_clock(values, [])
    assert clock.name == receiver_names(receiver)["DELAY_MS"][0 if new else 1]
    assert clock.configured == pytest.approx(1e-3 * DELAYS[receiver])


def test_what_is_blended_has_the_names_of_the_first():
    np.testing.assert_array_equal(told(new=True, receiver=3).antenna, PLACES[1])


@pytest.mark.parametrize("receiver", [1, 2])
def test_the_place_to_set_is_its_own(receiver):
    effect = GpsLeverArm(Origin(t0=0.0, antenna=PLACES[receiver], receiver=receiver))
    cure = effect.cured({"x": 0.1, "y": 0.0, "z": 0.0})
    assert cure.parameters[f"GPS{receiver}_POS_X"] == pytest.approx(PLACES[receiver][0] + 0.1)


def test_the_one_with_a_fix_is_watched():
    made = Calibrator()
    for k in range(1000):
        t = 10.0 + 0.1 * k
        made.feed(ImuSample(t, 1, (0.0, 0.0, -9.81), (0.0, 0.0, 0.0)))
        made.feed(GpsFix(t, 1, 1, 0.0, 0.0, 0.0, 0.0, 0.0))
        made.feed(GpsFix(t, 2, 3, 0.5, 0.5, 10.0, 3.0, 4.0, satellites=12))
    assert made.trust.receiver == made.parameters.receiver == 2
