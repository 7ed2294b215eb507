"""Whose axes a reported attitude is of."""

import math

import pytest

from onboard.core.inputs.views import Views, tells_views

HOVERS = {"Q_ENABLE": 1.0}


@pytest.mark.parametrize(
    ("values", "in_log", "over_mavlink"),
    [
        ({}, False, False),
        ({"Q_TAILSIT_ENABLE": 1.0}, False, False),
        (HOVERS, False, False),
        (HOVERS | {"Q_TAILSIT_ENABLE": 0.0, "Q_FRAME_CLASS": 10.0}, False, False),
        (HOVERS | {"Q_TAILSIT_ENABLE": 2.0}, True, True),
        (HOVERS | {"Q_FRAME_CLASS": 10.0}, True, True),
        (HOVERS | {"Q_TRIM_PITCH": -3.0}, True, True),
        (HOVERS | {"PTCH_TRIM_DEG": 2.0}, False, True),
        (HOVERS | {"PTCH_TRIM_DEG": 2.0, "FLIGHT_OPTIONS": 256.0}, False, False),
        ({"Q_ENABLE": 0.0, "PTCH_TRIM_DEG": 2.0, "Q_TAILSIT_ENABLE": 1.0}, False, False),
    ],
)
def test_it_is_of_a_view_where_the_firmware_turns_one(values, in_log, over_mavlink):
    assert tells_views(values, over_mavlink=False) is in_log
    assert tells_views(values, over_mavlink=True) is over_mavlink


def test_a_parameter_that_is_no_number_says_nothing():
    """A damaged one is not what the vehicle has, and no bits are in it."""
    views = Views()
    for name, value in (HOVERS | {"PTCH_TRIM_DEG": 2.0, "FLIGHT_OPTIONS": 0.0}).items():
        assert views.take(name, value)
    assert views.told
    assert not views.take("FLIGHT_OPTIONS", math.nan)
    assert not views.take("SCALING_SPEED", 15.0)
    assert views.told
    views.forget()
    assert not views.told
    damaged = HOVERS | {"PTCH_TRIM_DEG": 2.0, "FLIGHT_OPTIONS": math.nan}
    assert not tells_views(damaged, over_mavlink=False)
