"""Steps towards a linearisation that asks for itself: they end there, wherever they overshoot."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.approach import Approach, worth
from onboard.core.estimate.calibration_model import calibration_model, possible
from onboard.core.estimate.limits import NOT_WORTH
from onboard.core.estimate.solution import solve
from onboard.core.maths.blocks import Block
from onboard.core.maths.sums import NormalSums
from onboard.core.model.linearisation import MOVING, Linearisation

REST = Linearisation(delay=0.2, window=0.3, heading=0.1)


@pytest.fixture
def known():
    """A model and what is known of it before any flight: sigmas are those of the priors."""
    model = calibration_model(Linearisation())
    nothing = NormalSums.zeros(model.size)
    return solve([Block(0.0, 1.0, nothing)], model), model


def asks(at, slope):
    """A map with its fixed point at rest, with ``slope`` there."""
    delay, heading = (
        getattr(REST, name) + slope * (getattr(at, name) - getattr(REST, name))
        for name in ("delay", "heading")
    )
    return replace(REST, delay=delay, heading=heading)


@pytest.mark.parametrize("slope", [0.0, 0.5, -0.5, -0.9, -1.1, -2.0])
def test_it_comes_to_rest_where_whole_steps_would_go_to_and_fro_for_ever(known, slope):
    way = Approach(Linearisation(delay=0.1))
    for _ in range(30):
        way.go(asks(way.at, slope), *known)
    assert np.abs(np.subtract(way.at.moving, REST.moving)).max() < 1e-2
    assert abs(way.at.delay - REST.delay) < 1e-3


def test_the_first_step_is_a_whole_one_and_the_way_between_is_even(known):
    here = Linearisation(delay=0.1, window=0.1)
    assert Approach(here).go(REST, *known) == REST
    half = here.towards(REST, 0.5)
    assert half.moving == pytest.approx((np.add(here.moving, REST.moving) / 2.0).tolist())
    assert (here.towards(REST, 0.0).moving, here.towards(REST, 1.0)) == (here.moving, REST)


def test_a_pass_is_worth_a_share_of_what_is_known_and_never_less_than_is_told(known):
    found, model = known
    sigma = np.sqrt(np.diag(found.covariance))[[model.index[name] for name in MOVING]]
    assert worth(found, model, (0.0, 0.0)) == pytest.approx((NOT_WORTH * sigma[:2]).tolist())
    assert worth(found, model, (9.0, 8.0, 7.0)) == [9.0, 8.0, 7.0]


@pytest.mark.parametrize("wanders", [1e-4, 0.02, 0.5])
def test_the_heading_goes_to_all_that_is_seen_of_it_whatever_share_the_number_has(wanders):
    """Number and mean of what wanders, both unknown beside noisy measurements of their sum."""
    model = calibration_model(Linearisation())
    i, truth, noise = model.index["heading"], 0.26, 0.03
    prior = model.prior_sigma[i] ** 2
    both = np.linalg.inv(np.diag([1.0 / prior, 1.0 / wanders]) + np.ones((2, 2)) / noise**2)
    number, mean = both @ np.ones(2) * truth / noise**2
    theta, covariance = model.prior.copy(), np.diag(model.prior_sigma**2)
    theta[i], covariance[i, i] = number, both[0, 0]
    seen = possible(Linearisation(), model, (theta, covariance), wanders)
    assert seen[i] == pytest.approx(number + mean)
    assert np.array_equal(np.delete(seen, i), np.delete(theta, i))
