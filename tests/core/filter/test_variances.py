"""Noise levels as the arrays of a filter bank."""

from dataclasses import replace

import numpy as np

from onboard.core.filter.limits import LEAST_VELOCITY_VAR, STATED_M_S
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.state import MEASURED, V
from onboard.core.filter.variances import Variances

NOTHING = np.zeros(MEASURED)
BANK = (NoiseLevels(stated=1.0), NoiseLevels(stated=0.5), NoiseLevels())


def white(stated, bank=BANK):
    return Variances(bank, attitude=True).of_reading(NOTHING, NOTHING, stated)[:, V]


def test_noise_goes_with_a_power_of_what_is_stated():
    usual = white(1.0)
    for accuracy in (0.5, 3.0, 20.0):
        by = (white(accuracy**2) / usual)[:, 0]
        np.testing.assert_allclose(by, [accuracy**2, accuracy, 1.0])


def test_it_becomes_no_less_than_any_sensors_by_a_word():
    assert np.all(white(1e-12)[0] == LEAST_VELOCITY_VAR)
    quiet = (NoiseLevels(velocity=1e-3, stated=1.0), NoiseLevels(velocity=1e-3))
    np.testing.assert_allclose(white(1e-12, quiet), 1e-6)
    np.testing.assert_allclose(white(9.0, quiet)[0], 9e-6)


def test_levels_are_of_what_is_usually_stated():
    """Those of one accuracy are those of another one, with what the power makes of their ratio."""
    here = NoiseLevels(velocity=0.2, velocity_colour=0.3, stated=0.7, stated_colour=1.2)
    by = 1.5 / STATED_M_S
    there = replace(
        here,
        velocity=here.velocity * by**here.stated,
        velocity_colour=here.velocity_colour * by**here.stated_colour,
        usually_stated=1.5,
    )
    one, other = (Variances((levels,), attitude=True) for levels in (here, there))
    for stated in (0.01, 1.0, 30.0):
        np.testing.assert_allclose(
            one.of_reading(NOTHING, NOTHING, stated), other.of_reading(NOTHING, NOTHING, stated)
        )
        decay = np.full((1, MEASURED), 0.9)
        np.testing.assert_allclose(one.over(0.2, decay, stated), other.over(0.2, decay, stated))
        for made in (one, other):
            starts = made.at_start(0.1, 0.1, stated, down=True, height=True)
            np.testing.assert_allclose(
                starts, one.at_start(0.1, 0.1, stated, down=True, height=True)
            )
