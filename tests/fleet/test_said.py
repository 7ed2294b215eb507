"""What a flight says is read from a record as it was written."""

import numpy as np
import pytest

from onboard.answers.fleet.record import Said
from onboard.core.estimate.merged_flights import FlightSix


@pytest.mark.parametrize("alike", [0.0, 0.05])
def test_a_flight_says_the_same_after_a_record(alike):
    rng = np.random.default_rng(1)
    N, b = rng.normal(size=(6, 6)), rng.normal(size=6)
    six = FlightSix(N @ N.T, b, N @ N.T / 2.0, b / 2.0, np.repeat([0.0, alike**2], 3))
    said = Said.of(six).six
    for name in ("information", "vector", "floored", "floored_vector", "alike"):
        np.testing.assert_array_equal(getattr(said, name), getattr(six, name))
