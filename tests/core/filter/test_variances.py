"""Noise levels as the arrays of a filter bank."""

import numpy as np

from onboard.core.filter.limits import LEAST_VELOCITY_VAR
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
