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
        driven = [made.over(0.2, decay, stated, np.zeros(3)) for made in (one, other)]
        np.testing.assert_allclose(*driven)
        for made in (one, other):
            starts = made.at_start(0.1, 0.1, stated, down=True, height=True)
            np.testing.assert_allclose(
                starts, one.at_start(0.1, 0.1, stated, down=True, height=True)
            )


def test_what_is_shaken_walks_like_all_else_but_only_there():
    """A walk that is the same all along is the share of a shaking that is the same all along."""
    density, T, decay = np.array([0.4, 0.1, 2.0]), 0.2, np.full((1, MEASURED), 0.9)
    levels = NoiseLevels(shaken_walk=0.3, shaken_lift=0.6)
    calm, shaken = (
        Variances((levels,), attitude=True).over(T, decay, 1.0, x)
        for x in (np.zeros(3), T * density)
    )
    more = np.array([0.3, 0.3, 0.6]) ** 2 * density * T
    np.testing.assert_allclose(sum(shaken)[0, V] - sum(calm)[0, V], more)
    np.testing.assert_allclose(sum(shaken)[0, V], levels.walk_shaken(density) * T)
    np.testing.assert_array_equal(shaken[0][0, V.stop :], calm[0][0, V.stop :])
