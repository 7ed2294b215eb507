"""A compass that the motors pull at once: what is taken out of the heading is of the throttle."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.inputs.steady_heading import STEADY_THROTTLE, SteadyHeading
from tests.core.inputs.test_steady_heading import LENGTH_S, TENS, cut, left

BY_THROTTLE = 0.35


def throttle(t):
    """Up and down in an instant, slowly, and on a swing."""
    steps = 0.3 * (t > 15.03) - 0.4 * (t > 31.52) + 0.35 * (t > 44.01)
    return 0.5 + steps + 0.1 * np.clip((t - 20.0) / 8.0, 0.0, 1.0) + 0.05 * np.sin(0.9 * t)


def flown(error, hz, borders=TENS):
    """A flight, batch by batch, with its throttle, as its heading is used."""
    heading, run = SteadyHeading(), []
    for batch in cut(error, borders):
        first, last = batch.segment.t[[0, -1]]
        t = np.arange(np.floor((first - 0.4) * hz), (last + 0.4) * hz) / hz
        segment = replace(batch.segment, slow={"throttle": (t, throttle(t))})
        run = heading.joined(run, replace(batch, segment=segment))
    return run


def used(batch, t):
    """The throttle that goes with the heading of a batch."""
    slow = batch.segment.slow
    return np.interp(t, *slow.get(STEADY_THROTTLE, slow["throttle"]))


@pytest.mark.parametrize("hz", [5.0, 10.0, 50.0])
@pytest.mark.parametrize("borders", [TENS, (0.0, LENGTH_S), (0.0, 15.0, 31.6, 44.0, LENGTH_S)])
def test_what_is_left_of_the_heading_goes_with_what_is_left_of_the_throttle(hz, borders):
    run = flown(lambda t: BY_THROTTLE * throttle(t), hz, borders)
    assert any(STEADY_THROTTLE in batch.segment.slow for batch in run)
    for batch in run:
        t, error = left([batch])
        # An instant of 0.1 to 0.14 rad each is in the recorded heading.
        assert np.abs(error - BY_THROTTLE * used(batch, t)).max() < 0.012


def test_of_a_heading_that_nothing_was_taken_out_of_it_is_the_throttle_itself():
    run = flown(lambda t: 0.1 * np.sin(0.2 * t), 5.0)
    assert not any(STEADY_THROTTLE in batch.segment.slow for batch in run)


def test_a_heading_that_is_set_anew_for_another_reason_takes_next_to_nothing_out():
    for batch in flown(lambda t: np.where(t < 26.0, 0.7, 0.0), 5.0):
        t, x = batch.segment.slow["throttle"]
        assert np.abs(used(batch, t) - x).max() < 0.02
