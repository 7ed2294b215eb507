"""A plane's wind that becomes another at once."""

from __future__ import annotations

from dataclasses import replace

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


@pytest.mark.parametrize("seed", [3, 5])
def test_what_the_model_does_not_describe_at_the_start_is_no_front(seed):
    """Of what is before the only moment that it could have, a second is left in the end."""
    flight = plane_flight(seed=seed, seconds=150.0)
    since, rng = flight.t - flight.t[0], np.random.default_rng(seed)
    wrong = (since < 5.5) | ((since > 6.8) & (since < 12.3))
    f_b = flight.f_b.copy()
    f_b[wrong] += rng.normal(size=(np.count_nonzero(wrong), 3)) * np.array([2.0, 6.0, 8.0])
    match = matched(replace(flight, f_b=f_b))
    assert names(match) == set()
    assert "the wind became another" not in match.note
