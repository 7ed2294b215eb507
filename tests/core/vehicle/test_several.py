from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.copter import Variant, copter_model
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.instruments import whitened_regressors
from onboard.core.vehicle.limits import BLOCK_S
from onboard.core.vehicle.matching import described, likelier
from onboard.core.vehicle.noise import AxisNoise
from onboard.core.vehicle.several import joined, wind_sigmas
from onboard.core.vehicle.signals import Signals
from tests.core.vehicle.flights import assert_derivatives, copter_flight

SIGMA = np.array([0.003, 0.003, 0.01])
WINDS = ((3.0, -2.0), (-4.0, 1.0), (0.0, 0.0))


def flights(**changes):
    return [
        copter_flight(seed=20 + k, seconds=70.0, wind=wind, c_m=0.45, noise=0.05, **changes)
        for k, wind in enumerate(WINDS)
    ]


def matched(every):
    sigmas = np.tile(SIGMA, (len(every), 1))
    return match_copter(joined(every), Signals(kind="copter"), CopterAirframe(), sigmas)


def measured(flight, north, east, sigma):
    return replace(flight, measured_wind=np.tile([north, east, sigma], (len(flight), 1)))


def test_no_block_and_no_piece_has_steps_of_two_flights():
    flight = joined(flights())
    for number in (np.floor((flight.t - flight.t[0]) / BLOCK_S), flight.piece):
        for its in np.unique(number):
            assert len(np.unique(flight.part[number == its])) == 1
    np.testing.assert_allclose(flight.since_start[flight.part == 1][0], 0.0)
    above = [f.height - f.ground for f in flights()]
    np.testing.assert_allclose(flight.height - flight.ground, np.concatenate(above))
    assert joined(flights()[:1]).parts == 1


def test_derivatives_of_what_is_each_flights_own_are_those_of_the_whole_prediction():
    model = copter_model(joined(flights()), CopterAirframe(), np.tile(SIGMA, (3, 1)))
    assert_derivatives(model)


def test_what_a_gust_had_no_part_in_is_told_of_each_flight_by_itself():
    """Whatever flew beside it: who flew it, and how, is another matter in another flight."""
    first, second, third = flights()
    rows, others = told([first, second]), told([first, third])
    for axis, other in zip(rows, others, strict=True):
        np.testing.assert_allclose(axis.at(axis.part == 0).by, other.at(other.part == 0).by)
        assert not np.allclose(axis.at(axis.part == 1).by, other.at(other.part == 1).by)


def told(every):
    """Regressors of several flights, as far as they are told from before a gust."""
    sigmas = np.tile(SIGMA, (len(every), 1))
    model = copter_model(joined(every), CopterAirframe(), sigmas, Variant(gusts=0.8))
    assert model.instrumented
    even, theta = np.ones((len(model.flight), len(model.axes))), model.nominal
    noise = [AxisNoise(0.1, 0.0, 2.0, 0.3)] * len(model.axes)
    return whitened_regressors(model, model.steps(theta), noise, even, model.levelled.steps(theta))


@pytest.mark.slow
def test_flights_of_one_vehicle_share_its_drag_and_have_winds_of_their_own():
    every = flights()
    match = matched(every)
    assert {"wind", "rotor_drag"} <= {d.name for d in match.effects}
    drag = match.numbers["rotor_drag.mcoef"]
    assert abs(drag.real - 0.45) < 4.0 * drag.sigma
    for found, (north, east) in zip((match.wind, *match.other_winds), WINDS, strict=True):
        assert found.north == pytest.approx(north, abs=4.0 * found.sigma_north)
        assert found.east == pytest.approx(east, abs=4.0 * found.sigma_east)
    # What is drawn over time is the first flight.
    assert match.series is not None
    assert len(match.series.t) <= len(every[0])


@pytest.mark.slow
def test_a_hover_tells_its_wind_by_the_drag_of_another_flight():
    """Alone, its force is as much drag in less wind; the other flight knows the drag."""
    hover = copter_flight(seed=31, seconds=70.0, wind=(4.0, -2.0), c_m=0.45, still=True)
    alone, match = matched([hover]), matched([hover, flights()[0]])
    assert alone.wind is not None
    assert match.wind is not None
    assert alone.wind.sigma_north > 5.0 * match.wind.sigma_north
    assert match.wind.north == pytest.approx(4.0, abs=4.0 * match.wind.sigma_north)
    assert match.wind.east == pytest.approx(-2.0, abs=4.0 * match.wind.sigma_east)


@pytest.mark.slow
def test_a_wind_that_was_measured_is_known_as_well_as_it_was():
    """It is no effect, and its error is what is found."""
    blown = measured(flights()[0], 3.0, -2.0, 0.1)
    assert wind_sigmas(joined([blown, flights()[1]])) == [pytest.approx(0.1), 10.0]
    match = matched([blown])
    assert "wind" not in {d.name for d in match.effects}
    assert match.wind is not None
    assert match.wind.north == pytest.approx(3.0, abs=0.3)
    assert match.wind.east == pytest.approx(-2.0, abs=0.3)
    assert match.wind.sigma_north < 0.15


@pytest.mark.slow
def test_each_flight_began_with_a_battery_of_its_own_where_no_voltage_tells():
    """One thrust by command for all of them is off by a tenth, and its sigma has to say so."""
    ratios = (0.9, 1.0, 1.1)
    every = [replace(f, battery=np.zeros((len(f), 0))) for f in flights()]
    for flight, ratio in zip(every, ratios, strict=True):
        # The pull of the rotors, which the command does not tell: 90 to 110 % of it.
        flight.f_b[:, 2] *= ratio
    match = matched(every)
    assert match.mismatch["z"].after < 0.2
    scale = match.numbers["thrust_scale.log_ratio"]
    assert scale.sigma > 0.03
    assert abs(scale.real) < 3.0 * scale.sigma
    alone = matched(every[:1]).numbers["thrust_scale.log_ratio"]
    assert alone.real == pytest.approx(np.log(0.9), abs=0.03)


@pytest.mark.slow
def test_what_is_far_from_the_model_is_far_in_its_own_flight():
    """Noise that is 2.6 times as large in one flight as in the others is nothing to leave out."""
    rough = copter_flight(seed=20, seconds=70.0, wind=WINDS[0], c_m=0.45, noise=0.13)
    flight = joined([rough, *flights()[1:]])
    model = copter_model(flight, CopterAirframe(), np.tile(SIGMA, (3, 1)))
    assert described(likelier(model))[1].mean() > 0.999


@pytest.mark.slow
def test_flights_that_do_not_agree_on_a_number_tell_it_no_better_than_they_agree():
    """A drag of the rotors that differs from flight to flight by 7 %: another load."""
    rng = np.random.default_rng(5)
    own, winds = 0.45 + 0.03 * rng.standard_normal(7), 3.0 * rng.standard_normal((7, 2))
    every = [
        copter_flight(seed=k, seconds=70.0, wind=wind, c_m=c_m, noise=0.05)
        for k, (c_m, wind) in enumerate(zip(own, winds, strict=True))
    ]
    found = matched(every).numbers["rotor_drag.mcoef"]
    assert 0.5 < found.sigma / (0.03 / np.sqrt(7.0)) < 2.0
    # Of right sigmas one trial in 125 is further off.
    assert abs(found.real - 0.45) < 2.65 * found.sigma
