"""What a hover calibrates: the force at its one load, and no more."""

import numpy as np
import pytest

from onboard.core.estimate.determined import determine, force_moments
from onboard.core.estimate.limits import LEAST_CHANGE, SURE
from onboard.core.estimate.result import Status
from onboard.core.maths.accelerometer import parameter_names
from tests.core.estimate.test_simulated_flights import TRUE, calibrated, flown

SIX = np.array(TRUE.scale + TRUE.offset)


@pytest.mark.slow
def test_a_hover_is_calibrated_as_far_as_it_shows():
    """It shows the force at its one load: that becomes right, and no scale moves for it."""
    got = calibrated(flown("copter", 75.0, dull=True)[0])
    assert got.status is Status.CALIBRATED
    assert got.note.startswith("hovering")
    now, truth = (np.array(x) for x in (got.in_force_scale + got.in_force_offset, SIX))
    found = determine(got, now)
    assert not any(found.known[:2])
    then = np.array(found.six.scale + found.six.offset)
    assert np.array_equal(then[:2], now[:2])
    M = force_moments(got.load_mean, got.load_square, truth)
    before, after = (np.sqrt(e @ M @ e) for e in (now - truth, then - truth))
    assert after < min(before, 3.0 * found.error_after)


@pytest.mark.slow
def test_a_hover_whose_values_are_right_has_nothing_to_set():
    """Right within what a hover shows: then it says nothing that is surely better."""
    names = parameter_names(1).six
    in_force = dict(zip(names, SIX, strict=True))
    got = calibrated(flown("copter", 75.0, dull=True, parameters=in_force)[0])
    found = determine(got, np.array(SIX))
    assert found.probability < SURE or found.change < LEAST_CHANGE
