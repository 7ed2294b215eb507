"""A plane's wind that becomes another at once."""

from __future__ import annotations

import numpy as np
import pytest

from tests.core.vehicle.flights import plane_flight
from tests.core.vehicle.planes import matched, names

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("seed", "before", "by", "gusts", "reading"),
    [
        (23, (-3.75, -1.37), (7.95, 2.9), 0.0, None),  # in the mean there is none
        (24, (3.75, 1.37), (4.7, 1.7), 0.5, 1.0),
    ],
)
def test_a_front_is_a_wind_that_becomes_another_and_no_gusts(seed, before, by, gusts, reading):
    """Gusts of metres a second had been told beside one wind, or beside straight lines."""
    match = matched(
        plane_flight(
            seed=seed, wind=before, front=(95.0, by), gusts=gusts, reading=reading, seconds=180.0
        )
    )
    assert names(match) - {"turbulence"} == {"wind"}
    assert gusts or "turbulence" not in names(match)
    assert match.wind.turbulence_rms is None or match.wind.turbulence_rms < 1.5 * gusts
    assert "the wind became another" in match.note
    # A level is known from half of the flight.
    close = 4.0 * np.sqrt(2.0) * max(match.wind.sigma_north, match.wind.sigma_east)
    assert np.asarray(match.wind.law[0]) == pytest.approx(np.array(before), abs=close)
    assert np.asarray(match.wind.law[-1]) == pytest.approx(np.add(before, by), abs=close)
