"""A number over flights: what is said where there is nothing, and what is found where there is."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.fleet.course import Series, follow, places
from onboard.core.fleet.limits import FALSE_ALARM


def flights(rng, n, *, drift=0.0, step=0.0, after=0, scale=1.0, warm=None):
    """Values about nothing, with sigmas of about one, over a hundred days."""
    sigma, day = rng.uniform(0.7, 1.4, n), np.sort(rng.uniform(0.0, 100.0, n))
    value = scale * sigma * rng.standard_normal(n) + drift * day + step * (np.arange(n) > after)
    return Series(value, sigma, day, warm)


def said(course):
    return bool(course.steps or course.odd or course.drifts)


@pytest.mark.parametrize("n", [2, 3, 4, 8, 25])
def test_nothing_is_said_where_there_is_nothing(n):
    rng = np.random.default_rng(n)
    alarms = sum(said(follow(flights(rng, n))) for _ in range(300))
    assert alarms <= 9  # 0.2 % of experiments at 1 % have more


@pytest.mark.parametrize(("n", "scale"), [(4, 1.5), (12, 1.5)])
def test_flights_that_scatter_more_than_they_claim_are_no_alarm(n, scale):
    rng = np.random.default_rng(n)
    alarms = sum(said(follow(flights(rng, n, scale=scale))) for _ in range(300))
    assert alarms <= 9


def test_false_alarms_hold_where_the_claims_scatter_as_they_are_taken_to():
    """Variance factors that scatter as scaled inverse chi-square: where the t is nominal."""
    rng = np.random.default_rng(5)
    alarms = 0
    for _ in range(600):
        factor = 4.0 / rng.chisquare(4.0)
        alarms += said(follow(flights(rng, 8, scale=np.sqrt(factor))))
    assert alarms <= 600 * FALSE_ALARM * 2.2


def test_more_numbers_looked_at_say_less():
    rng = np.random.default_rng(1)
    for _ in range(40):
        series = flights(rng, 10, step=4.0, after=4)
        if not said(follow(series)):
            assert not said(follow(series, looked_at=50 * places(series)))


@pytest.mark.parametrize(("n", "power"), [(8, 0.75), (12, 0.87), (30, 0.97)])
def test_a_step_of_five_sigma_is_found_where_it_is(n, power):
    rng = np.random.default_rng(n)
    found = right = 0
    for _ in range(150):
        after = int(rng.integers(1, n - 2))
        course = follow(flights(rng, n, step=5.0, after=after))
        if len(course.steps) == 1:
            found += 1
            step = course.steps[0]
            right += step.first <= after <= step.last and abs(step.sized.size - 5.0) < (
                4.0 * step.sized.sigma
            )
    assert found >= power * 150
    assert right >= 0.95 * found


@pytest.mark.parametrize("drift", [0.0, 0.02, 0.05, 0.2])
def test_the_drift_is_within_its_sigma_as_often_as_it_says(drift):
    rng = np.random.default_rng(7)
    inside = 0
    for _ in range(200):
        trend = follow(flights(rng, 14, drift=drift)).trend
        inside += abs(trend.size - drift) < 2.0 * trend.sigma
    assert inside >= 0.92 * 200  # 95.5 % are due; 2.4 sigma of 200 are 3.5 %


def test_a_large_drift_is_a_drift_and_no_staircase():
    rng = np.random.default_rng(3)
    courses = [follow(flights(rng, 20, drift=0.2)) for _ in range(60)]
    assert sum(c.drifts for c in courses) >= 58
    assert sum(bool(c.steps) for c in courses) <= 2


def test_one_flight_that_is_wrong_is_named_and_no_step():
    rng = np.random.default_rng(4)
    right = 0
    for _ in range(60):
        series = flights(rng, 12)
        k = int(rng.integers(12))
        series.value[k] += 12.0 * series.sigma[k]
        course = follow(series)
        right += [o.flight for o in course.odd] == [k] and not course.steps
    assert right >= 57


def test_of_two_flights_that_contradict_each_other_both_are_named():
    course = follow(Series(np.array([0.0, 12.0]), np.ones(2), np.array([0.0, 1.0])))
    assert [o.flight for o in course.odd] == [0, 1]
    assert course.odd[0].sized.size == pytest.approx(-12.0)


def test_a_last_flight_that_differs_is_odd_and_a_second_one_makes_it_a_step():
    rng = np.random.default_rng(6)
    series = flights(rng, 11, step=15.0, after=9)
    assert [o.flight for o in follow(series).odd] == [10]
    series = flights(rng, 12, step=15.0, after=9)
    course = follow(series)
    assert [s.after for s in course.steps] == [9]
    assert course.latest[0] == pytest.approx(15.0, abs=4.0 * course.latest[1])
    assert course.parts == (0,) * 10 + (1,) * 2


def test_two_steps_are_two_steps():
    rng = np.random.default_rng(8)
    series = flights(rng, 24, step=9.0, after=7)
    series.value[16:] += 9.0
    assert [s.after for s in follow(series).steps] == [7, 15]


def test_what_the_temperature_does_is_no_step():
    """Summer and winter: without the temperature it would be two steps."""
    rng = np.random.default_rng(9)
    warm = np.where(np.arange(18) < 9, 5.0, 35.0) + rng.uniform(-4.0, 4.0, 18)
    series = flights(rng, 18, warm=warm)
    series.value[:] += 0.4 * warm
    blind = follow(Series(series.value, series.sigma, series.day))
    seen = follow(series)
    assert blind.steps
    assert not said(seen)
    assert seen.warmth.size == pytest.approx(0.4, abs=4.0 * seen.warmth.sigma)


def test_units_do_not_matter():
    rng = np.random.default_rng(10)
    series = flights(rng, 12, step=6.0, after=5)
    one = follow(series)
    other = follow(Series(1e-6 * series.value + 3.0, 1e-6 * series.sigma, series.day))
    assert one.parts == other.parts
    assert one.steps[0].sized.p_value == pytest.approx(other.steps[0].sized.p_value, rel=1e-3)


def test_a_single_flight_says_its_value():
    course = follow(Series(np.array([2.0]), np.array([0.5]), np.array([0.0])))
    assert course.latest == (2.0, 0.5)
    assert course.trend is None
    assert not said(course)
