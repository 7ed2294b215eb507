"""Whose axes a reported attitude is of."""

import pytest

from onboard.core.inputs.views import tells_views

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
