from __future__ import annotations

import math

import numpy as np
import pytest

from onboard.core.vehicle.agreement import agreement_of, aside_sentence
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.apart import apart_of
from onboard.core.vehicle.copter import Variant, copter_model
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.effects.body_drag import BodyDrag
from onboard.core.vehicle.effects.mass_change import Change
from onboard.core.vehicle.effects.rotor_drag import RotorDrag
from onboard.core.vehicle.effects.thrust_scale import ThrustScale
from onboard.core.vehicle.limits import FALSE_ALARM, FEWEST_FLIGHTS
from onboard.core.vehicle.plane import plane_model
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.core.vehicle.said import NOTHING, Said, is_of_vehicle
from onboard.core.vehicle.several import joined, of_parts
from onboard.core.vehicle.signals import Signals
from tests.core.vehicle.flights import copter_flight, plane_flight

SIGMA = np.array([0.003, 0.003, 0.01])
FRAME = CopterAirframe()
EFFECTS = (RotorDrag(FRAME), BodyDrag(FRAME), ThrustScale(FRAME))
UNKNOWNS = [u for e in EFFECTS for u in e.unknowns]
NOMINAL = np.array([u.nominal for u in UNKNOWNS])
FLOOR = np.array([u.floor for u in UNKNOWNS])
SURELY = 0.02 * FLOOR
"""Sigmas beside which what matters is a lot."""


def said(off=0.0, sigma=SURELY):
    return Said(EFFECTS, NOMINAL + off, np.diag(np.broadcast_to(sigma, 4) ** 2.0))


def odd_in(*flights):
    return [a.number for a in agreement_of([(f,) for f in flights]).aside]


def heavier(of, ratio):
    values, at = [], 0
    for e in EFFECTS:
        count = len(e.unknowns)
        values += e.heavier(of.values[at : at + count].tolist(), math.log(ratio))
        at += count
    return Said(EFFECTS, np.array(values), of.covariance)


def test_what_does_not_matter_is_no_contradiction_however_sure_it_is():
    assert odd_in(said(), said(0.99 * FLOOR)) == []
    assert odd_in(said(), said(np.array([0.0, 0.0, 0.0, 1.2]) * FLOOR)) == [1]


def test_what_chance_explains_is_no_contradiction_however_large_it_is():
    sigma = 0.1 * np.array([u.plausible for u in UNKNOWNS])
    assert odd_in(said(sigma=sigma), said(1.5 * sigma, sigma)) == []
    assert odd_in(said(sigma=sigma), said(FLOOR + 6.0 * sigma, sigma)) == [1]


def test_accused_by_chance_are_no_more_than_the_room_allows():
    rng = np.random.default_rng(3)
    sigma = 0.05 * np.array([u.plausible for u in UNKNOWNS])
    level = 0.05
    accused = [
        not apart_of(said(sigma * a, sigma), said(sigma * b, sigma), level).by_chance(level)
        for a, b in rng.normal(size=(400, 2, 4))
    ]
    assert np.mean(accused) <= level + 2.0 * math.sqrt(level / 400)


def test_two_flights_are_compared_in_what_both_know_alone():
    plausible = np.array([u.plausible for u in UNKNOWNS])
    blind = np.where(np.arange(4) == 3, plausible, SURELY)
    other = np.where(np.arange(4) == 3, 0.5, 0.0)
    assert odd_in(said(sigma=blind), said(other)) == []
    assert odd_in(said(), NOTHING) == []


def test_the_first_flight_is_the_one_that_is_asked_about():
    apart = 5.0 * FLOOR
    assert odd_in(said(), said(apart), said(apart)) == [1, 2]
    assert odd_in(said(), said(), said(apart)) == [2]
    # Of two that contradict each other, and of which the first knows nothing, neither is right.
    assert odd_in(NOTHING, said(), said(apart)) == [1, 2]


def test_flights_that_scatter_are_all_one_vehicles_and_one_far_beyond_is_not():
    rng = np.random.default_rng(1)
    every = [said(3.0 * FLOOR * rng.normal(size=4)) for _ in range(FEWEST_FLIGHTS + 2)]
    assert odd_in(*every) == []
    assert odd_in(*every, said(100.0 * FLOOR)) == [len(every)]


@pytest.mark.parametrize("ratio", [0.8, 1.25])
def test_another_mass_is_told_as_one(ratio):
    aside = agreement_of([(said(),), (heavier(said(), ratio),)]).aside[0]
    assert aside.mass is not None
    assert aside.mass.real == pytest.approx(ratio, abs=3.0 * aside.mass.sigma + 0.01)
    assert ("heavier" if ratio > 1.0 else "lighter") in aside_sentence(aside)
    other = apart_of(said(), said(np.array([5.0, 0.0, 0.0, 0.0]) * FLOOR), FALSE_ALARM)
    assert other.masses is None


def test_weaker_rotors_with_the_same_drag_are_no_mass():
    """A smaller mass, and drag that is off by less than matters, would make the same of them."""
    keys = said().keys
    weaker = np.zeros(4)
    weaker[keys.index(("thrust_scale", "log_ratio"))] = np.log(0.85)
    aside = agreement_of([(said(0.0, 0.2 * FLOOR),), (said(weaker, 0.2 * FLOOR),)]).aside[0]
    assert aside.mass is None
    assert aside.name == "thrust_scale"


def loaded(model, theta, ratio):
    out = theta.copy()
    for e in model.effects:
        if is_of_vehicle(e):
            places = model.indices(e.name)
            out[places] = e.heavier(theta[places].tolist(), math.log(ratio))
    return out


def without(model, *names):
    theta = model.nominal
    theta[[k for k, u in enumerate(model.unknowns) if u.name.startswith(names)]] = 0.0
    return theta


def test_a_heavier_copter_is_one_whose_mass_has_changed():
    """As the effect of a payload has it, but for what is only estimated beside the effects."""
    flight = copter_flight(seconds=20.0)
    always = Variant(change=Change(float(flight.t[0]), float(flight.t[0])))
    model = copter_model(flight, FRAME, SIGMA, always)
    theta = without(model, "rotor_z", "body_z", "inflow")
    changed = theta.copy()
    changed[model.indices("mass_change")] = math.log(1.3)
    np.testing.assert_allclose(
        model.predicted(loaded(model, theta, 1.3)), model.predicted(changed), rtol=1e-9
    )


def test_a_heavier_plane_has_all_its_forces_by_mass_divided():
    model = plane_model(plane_flight(seconds=20.0), PlaneAirframe(), SIGMA)
    theta = without(model, "propeller")
    np.testing.assert_allclose(
        model.predicted(loaded(model, theta, 1.3)), model.predicted(theta) / 1.3, rtol=1e-9
    )


def test_some_of_several_flights_keep_their_clock_and_their_ground():
    every = joined([copter_flight(seed=k, seconds=30.0) for k in range(3)])
    some = of_parts(every, (0, 2))
    assert some.parts == 2
    np.testing.assert_allclose(some.t[some.part == 1], every.t[every.part == 2])
    np.testing.assert_allclose(some.height[some.part == 1], every.height[every.part == 2])


def matched(*flights):
    sigmas = np.tile(SIGMA, (len(flights), 1))
    return match_copter(joined(flights), Signals(kind="copter"), FRAME, sigmas)


@pytest.mark.slow
def test_a_flight_of_another_airframe_has_no_part_in_the_answer_and_is_named():
    first = copter_flight(seed=3, seconds=80.0, wind=(3.0, -2.0), noise=0.05)
    other = copter_flight(seed=4, seconds=80.0, wind=(-2.0, 1.0), noise=0.05, area=0.1)
    alone, both = matched(first), matched(first, other)
    assert not both.explained
    assert [a.number for a in both.aside] == [1]
    assert both.aside[0].name == "body_drag"
    assert "flight 2 contradicts flight 1" in both.note
    assert "mass_change" not in {d.name for d in both.effects}
    for key in ("body_drag.x", "rotor_drag.mcoef", "thrust_scale.log_ratio"):
        assert both.numbers[key].real == pytest.approx(alone.numbers[key].real)
    assert both.other_winds[0].north == pytest.approx(-2.0, abs=0.3)


@pytest.mark.slow
def test_a_payload_in_one_of_two_flights_is_told_as_its_mass():
    first = copter_flight(seed=3, seconds=80.0, wind=(3.0, -2.0), noise=0.02)
    other = copter_flight(seed=4, seconds=80.0, wind=(-2.0, 1.0), noise=0.02, mass=(0.0, 1.25))
    aside = matched(first, other).aside[0]
    assert aside.mass is not None
    assert aside.mass.real == pytest.approx(1.25, abs=max(4.0 * aside.mass.sigma, 0.01))


@pytest.mark.slow
def test_a_flight_that_lost_its_payload_agrees_with_one_without():
    first = copter_flight(seed=3, seconds=80.0, noise=0.02, mass=(40.0, 0.8))
    for mass in (None, (0.0, 0.8)):
        other = copter_flight(seed=4, seconds=60.0, wind=(-2.0, 1.0), noise=0.02, mass=mass)
        match = matched(first, other)
        assert match.aside == ()
        changed = next(d for d in match.effects if d.name == "mass_change")
        assert changed.values["ratio"].real == pytest.approx(0.8, abs=0.02)
