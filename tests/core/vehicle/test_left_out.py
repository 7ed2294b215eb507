"""Flight that a fit leaves out is not explained, unless air of the size that it met does that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.maths.spans import following, inside, joined
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.copter import copter_model
from onboard.core.vehicle.fit import fitted
from onboard.core.vehicle.remainder import not_used, remainder_sentence, share_of
from onboard.core.vehicle.signals import Stream
from onboard.core.vehicle.touches import touched_spans
from tests.core.vehicle.flights import copter_flight

FRAME = CopterAirframe.of({})


@pytest.fixture(scope="module")
def fit():
    return fitted(copter_model(copter_flight(seed=3, seconds=120.0), FRAME, np.full(3, 0.01)))


def lost(fit, newtons_by_kg):
    """The model of the flight with thrust lost for six seconds, and the steps of the rest."""
    flight = fit.model.flight
    gone = (flight.since_start >= 60.0) & (flight.since_start < 66.0)
    f_b = flight.f_b.copy()
    f_b[gone, 2] += newtons_by_kg
    return replace(fit.model, flight=replace(flight, f_b=f_b)), ~gone


def test_thrust_that_is_lost_in_a_part_of_the_flight_is_a_share_that_is_not_explained(fit):
    model, kept = lost(fit, 1.0)
    (found,) = not_used(model, fit, kept, 0.0)
    assert (found.axis, round(found.start_s), round(found.end_s)) == ("z", 60, 66)
    assert found.force == pytest.approx(1.0, abs=0.05)
    share = share_of([found], model.flight)
    assert share == pytest.approx(6.0 / 120.0, abs=0.002)
    assert "5 % of the flight is not explained" in remainder_sentence((found,), share)


def test_what_gusts_of_that_size_do_is_the_airs(fit):
    model, kept = lost(fit, 1.0)
    assert not not_used(model, fit, kept, 2.0)


def test_what_an_error_of_the_velocity_makes_is_none(fit):
    model, kept = lost(fit, 0.02)
    assert not not_used(model, fit, kept, 0.0)


def bounce(*, lowest=0.3, spike=4.0, noise=0.1):
    """Fixes and forces of a descent that turns into a climb at 20 s, with a shock there."""
    t, times = np.arange(0.0, 40.0, 0.2), np.arange(0.0, 40.0, 0.04)
    height = 100.0 + lowest + np.abs(t - 20.0)
    v_n = np.stack([0.0 * t, 0.0 * t, np.where(t < 20.0, 1.0, -1.0)], axis=1)
    f_b = noise * np.random.default_rng(4).normal(size=(len(times), 3))
    f_b[:, 2] -= 9.8
    f_b[500, 0] += spike
    return t, v_n, height, 100.0, times, f_b


def test_a_bounce_is_left_out():
    ((start, end),) = touched_spans(*bounce())
    assert start < 20.0 < end


@pytest.mark.parametrize("but", [{"lowest": 8.0}, {"spike": 0.0}, {"noise": 2.0}])
def test_what_is_high_or_smooth_or_shakes_all_the_time_is_no_bounce(but):
    assert touched_spans(*bounce(**but)) == []


def test_a_straight_line_over_an_outage_is_no_measurement():
    t = np.arange(0.0, 60.0, 0.1)
    there = (t < 20.0) | (t > 30.0)
    stream = Stream(t[there], np.ones((np.count_nonzero(there), 1)))
    at = np.array([5.0, 19.5, 21.0, 29.0, 31.0, 59.0])
    assert stream.known(at).tolist() == [True, True, False, False, True, True]
    # A stream that is slow all the time has none.
    assert Stream(t[::50], np.ones((len(t[::50]), 1))).known(at).all()


def test_spans_that_go_on_from_each_other_are_one():
    spans = [(5.0, 6.0), (0.0, 2.0), (1.0, 1.5), (2.0, 3.0), (9.0, 9.5)]
    assert joined(spans) == [(0.0, 3.0), (5.0, 6.0), (9.0, 9.5)]
    assert joined(spans, 2.0) == [(0.0, 6.0), (9.0, 9.5)]
    assert following(spans, 2.0) == [[1, 2, 3, 0], [4]]
    assert joined([]) == []
    # Whatever is in a span is in one of them, and nothing else.
    t = np.arange(-1.0, 11.0, 0.01)
    np.testing.assert_array_equal(inside(t, joined(spans)), inside(t, spans))
