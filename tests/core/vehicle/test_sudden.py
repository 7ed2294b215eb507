"""A mass or a thrust that becomes another in flight, and what must not be taken for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.copter import Variant, copter_model
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.effects.mass_change import Change
from onboard.core.vehicle.fit import fitted, summed
from onboard.core.vehicle.noise import AxisNoise, onsets, whitened
from onboard.core.vehicle.several import joined
from onboard.core.vehicle.signals import Signals
from onboard.core.vehicle.sudden import CHANGES, change_of, scores
from tests.core.vehicle.flights import assert_derivatives, copter_flight

SIGMA = np.array([0.003, 0.003, 0.01])
FRAME = CopterAirframe()


def model_of(flight, change=None):
    return copter_model(flight, FRAME, SIGMA, Variant(change=change))


def matched(flight):
    return match_copter(flight, Signals(kind="copter"), FRAME, SIGMA)


def names(match):
    return {d.name for d in match.effects}


def close(value, truth):
    assert abs(value.real - truth) < 4.0 * value.sigma, (value, truth)


def within(match, key, truth):
    close(match.numbers[key], truth)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("factor", "seed", "side"), [(0.87, 1, "after"), (1.0 / 0.87, 2, "before")]
)
def test_a_payload_is_a_mass_that_changes_and_nothing_else(factor, seed, side):
    ratio, area, c_m = 1.0, 0.058108, 0.24833
    if side == "after":
        # The bare vehicle is the airframe's: what is dropped was on top of it.
        ratio, area, c_m = ratio * factor, area * factor, c_m * np.sqrt(factor)
    flight = copter_flight(mass=(110.0, factor), ratio=ratio, area=area, c_m=c_m, seed=seed)
    match = matched(flight)
    assert names(match) == {"mass_change"}
    assert match.explained
    assert side in match.note
    within(match, "mass_change.ratio", factor)
    within(match, "mass_change.moment", 110.0)


@pytest.mark.slow
def test_thrust_that_gives_way_is_no_mass_for_the_drag_stays():
    match = matched(copter_flight(weaker=(80.0, 0.85), seed=3))
    assert names(match) == {"thrust_change"}
    within(match, "thrust_change.ratio", 0.85)
    within(match, "thrust_change.moment", 80.0)


@pytest.mark.slow
@pytest.mark.parametrize(("rougher", "weaker"), [(1.5, 1.0), (1.3, 0.8)])
def test_drag_that_changes_is_neither_a_mass_nor_a_thrust(rougher, weaker):
    flight = copter_flight(rougher=(110.0, rougher), weaker=(110.0, weaker), wind=(3, 1), seed=5)
    match = matched(flight)
    assert not names(match) & {"mass_change", "thrust_change", "rotor_drag", "body_drag"}
    assert not match.explained
    assert f"at 110 s the thrust of one command became {weaker:.2f} times itself" in match.note


@pytest.mark.slow
def test_a_change_is_told_beside_what_else_differs():
    match = matched(copter_flight(mass=(130.0, 0.9), wind=(3.0, -2.0), expo=0.3, seed=4))
    assert names(match) == {"mass_change", "wind", "thrust_curve"}
    within(match, "mass_change.ratio", 0.9)
    within(match, "thrust_curve.expo", 0.3)


@pytest.mark.slow
def test_a_battery_that_nobody_measured_is_no_sudden_change():
    flight = copter_flight(volts=(12.6, 9.5), sag=1.0, seed=5)
    blind = replace(flight, battery=np.zeros((len(flight), 0)))
    assert not names(matched(blind)) & set(CHANGES)


@pytest.mark.slow
def test_a_front_is_a_wind_that_becomes_another_and_no_other_vehicle():
    """Mass and thrust that were less by half had been named beside a mean of the two winds."""
    before, by = np.array([3.75, 1.37]), (4.7, 1.7)
    match = matched(copter_flight(wind=before, front=(100.0, by), seed=11))
    assert names(match) == {"wind"}
    assert "the wind became another" in match.note
    # By straight lines over minutes the ends are told to some tenths of a metre a second.
    assert np.asarray(match.wind.law[0]) == pytest.approx(before, abs=0.5)
    assert np.asarray(match.wind.law[-1]) == pytest.approx(before + by, abs=0.5)


@pytest.mark.slow
def test_in_one_of_several_flights_the_others_are_left_as_they_are():
    flights = [
        copter_flight(seed=6, seconds=100.0),
        copter_flight(mass=(60.0, 1.15), seed=7, seconds=130.0),
    ]
    match = match_copter(
        joined(flights), Signals(kind="copter"), FRAME, np.stack([SIGMA for _ in flights])
    )
    assert names(match) == {"mass_change"}
    # Four sigma of flights twice as long, of which these have no need to show as much.
    assert match.numbers["mass_change.ratio"].real == pytest.approx(1.15, abs=0.0054)
    within(match, "mass_change.moment", 60.0)


def test_without_outputs_nothing_is_looked_for():
    whole = copter_flight(seed=8, mass=(60.0, 0.8))
    flight = replace(whole, commands=np.zeros((len(whole), 0)))
    assert change_of(fitted(model_of(flight)), lambda c: model_of(flight, c)) is None
    assert set(CHANGES) <= {n.name for n in matched(flight).not_testable}


@pytest.mark.parametrize("volts", [None, (12.6, 12.5)])
def test_scores_are_the_fall_of_chi_square_of_a_fit_that_has_the_change(volts):
    flight = copter_flight(seed=9, seconds=90.0, mass=(45.0, 1.05), volts=volts)
    fit = fitted(model_of(flight))
    moments = np.array([40, 90, 120])
    told = scores(fit, lambda c: model_of(flight, c), moments)
    for window, its in zip(moments, told, strict=True):
        t = float(flight.t[5 * window])
        changed = model_of(flight, Change(t, t))
        assert its == pytest.approx(_fall(fit, changed), rel=1e-9)


def _fall(fit, changed):
    """By the normal equations of all unknowns at once."""
    added = [i for n in CHANGES for i in changed.indices(n)]
    theta = changed.nominal
    theta[[i for i in range(len(theta)) if i not in added]] = fit.theta
    prior = 1.0 / changed.plausible**2
    its = summed(changed, theta, prior, fit.noise, fit.sensitivity)
    b = sum(block.b for block in its.blocks) + prior * (changed.nominal - theta)
    full = float(b @ np.linalg.solve(its.information, b))
    kept = [i for i in range(len(theta)) if i not in added]
    inside = its.information[np.ix_(kept, kept)]
    return full - float(b[kept] @ np.linalg.solve(inside, b[kept]))


def test_by_chance_a_change_is_found_no_more_often_than_is_said():
    found = 0
    for seed in range(100, 112):
        flight = copter_flight(seed=seed, seconds=120.0)
        its = change_of(fitted(model_of(flight)), lambda c, f=flight: model_of(f, c))
        found += its is not None
    assert found == 0


def test_derivatives_of_a_change_are_those_of_the_whole_prediction():
    flight = copter_flight(seed=1)
    assert_derivatives(model_of(flight, Change(120.0, 120.0, since=True)))


def test_a_column_that_begins_later_is_whitened_as_if_it_had_been_nothing_before():
    rng = np.random.default_rng(4)
    piece = np.repeat([0, 1], [30, 25])
    column, sensitivity = rng.normal(size=(55, 1)), rng.uniform(0.5, 2.0, 55)
    noise = AxisNoise(0.2, 0.1, correlation_s=2.0, white=0.3)
    begun = onsets(column, noise, sensitivity, piece, 0.5)
    rows = np.arange(55)
    for start in (0, 11, 29, 30, 40):
        masked = np.where(rows[:, None] >= start, column, 0.0)
        fading = np.where(piece == piece[start], begun.decay ** (rows - float(start)), 0.0)
        told = np.where(
            rows[:, None] >= start, begun.whole + begun.apart[start] * fading[:, None], 0.0
        )
        made = whitened(masked, noise, sensitivity, piece, 0.5)
        np.testing.assert_allclose(told, made, atol=1e-12)
