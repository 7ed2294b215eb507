from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.block_sums import total
from onboard.core.vehicle.effects.servo_lag import ServoLag
from onboard.core.vehicle.fit import fitted, summed
from onboard.core.vehicle.flight import History
from onboard.core.vehicle.matching import deviance, likelier
from onboard.core.vehicle.plane import plane_model
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.core.vehicle.several import joined
from tests.core.vehicle.flights import STEP, G, plane_flight, smooth
from tests.core.vehicle.planes import SIGMA, matched, names

pytestmark = pytest.mark.slow


def test_the_nominal_plane_is_clean_whichever_way_its_airspeed_is_reckoned():
    assert names(matched(plane_flight())) == set()
    assert names(matched(plane_flight(reading=1.0, seed=2))) == set()
    assert names(matched(plane_flight(reading=0.967, seed=3))) == set()


def test_the_wind_of_a_plane_is_found():
    match = matched(plane_flight(wind=(2.4, 6.6), seed=4))
    assert names(match) == {"wind"}
    assert "the wind became another" not in match.note
    assert match.wind is not None
    assert match.wind.north == pytest.approx(2.4, abs=0.15)
    assert match.wind.east == pytest.approx(6.6, abs=0.15)


@pytest.mark.parametrize(
    ("change", "effect", "key", "truth"),
    [
        ({"c_drag_p": 0.2}, "drag", "drag.c_drag_p", 0.2),
        ({"c_lift_0": 0.4}, "lift", "lift.c_lift_0", 0.4),
        ({"c_y_b": -0.5}, "side_force", "side_force.c_y_b", -0.5),
        ({"reading": 0.86}, "airspeed_scale", "airspeed_scale.scale", 0.86),
    ],
)
def test_each_coefficient_that_is_off_is_named_alone_with_its_value(change, effect, key, truth):
    match = matched(plane_flight(seed=5, **change))
    assert names(match) == {effect}
    number = match.numbers[key]
    assert abs(number.real - truth) < 4.0 * number.sigma


@pytest.mark.parametrize("reading", [0.967, 1.0])
def test_a_sensor_that_reads_one_of_the_nominal_ways_is_no_rival(reading):
    """Held half-way between them it would be off by as much as a little less drag explains."""
    match = matched(plane_flight(seed=6, wind=(-4.0, -2.5), c_drag_p=0.08, reading=reading))
    assert names(match) == {"wind", "drag"}
    assert not match.ambiguous


def test_a_propeller_that_pulls_less_at_speed_is_no_drag():
    """With the nominal one for all the thrust, the speed's share would be the profile's drag."""
    match = matched(plane_flight(seed=8, lost=0.008))
    assert "drag" not in names(match)
    drag = match.numbers["drag.c_drag_p"]
    assert abs(drag.real - 0.1) < 3.0 * drag.sigma
    slope = match.numbers["propeller_inflow"]
    assert abs(slope.real - 0.008) < 3.0 * slope.sigma
    assert slope.real > 3.0 * slope.sigma


def test_drag_of_sideslip_is_no_other_drag():
    match = matched(plane_flight(seed=9, slip_drag=1.5))
    assert names(match) == set()
    slip = match.numbers["slip_drag"]
    assert abs(slip.real - 1.5) < 3.0 * slip.sigma


def test_drag_that_grows_with_sideslip_itself_is_no_other_drag():
    match = matched(plane_flight(seed=9, slip_straight=0.25))
    assert names(match) == set()
    drag, slip = match.numbers["drag.c_drag_p"], match.numbers["slip_drag_straight"]
    assert abs(drag.real - 0.1) < 3.0 * drag.sigma
    assert abs(slip.real - 0.25) < 3.0 * slip.sigma


def test_a_windmill_that_brakes_less_than_its_line_says_is_no_lack_of_drag():
    """In a glide the straight line would brake twice as hard: drag would be taken off for it."""
    match = matched(plane_flight(seed=12, lost=0.02, braking=0.5, throttle_swing=0.3))
    assert "drag" not in names(match)
    drag, less = match.numbers["drag.c_drag_p"], match.numbers["propeller_braking"]
    assert abs(drag.real - 0.1) < 3.0 * drag.sigma
    assert abs(less.real - 0.5) < 3.0 * less.sigma
    assert less.real > 3.0 * less.sigma


@pytest.mark.parametrize(
    ("seed", "c_drag_p", "swing", "noise"),
    [(317, 0.05, 0.07, 0.18), (321, 0.05, 0.11, 0.29), (316, 0.03, 0.108, 0.223)],
)
def test_of_two_that_act_alike_the_one_that_differs_beside_all_others_is_named(
    seed, c_drag_p, swing, noise
):
    """Hardly moved, the throttle tells no thrust from drag; alone, thrust takes what is drag's.

    With both free the thrust is as it should be, and the drag is not.
    """
    found = matched(
        plane_flight(seed=seed, c_drag_p=c_drag_p, throttle_swing=swing, noise=noise, seconds=150.0)
    )
    assert names(found) == {"drag"}
    number = found.numbers["drag.c_drag_p"]
    assert abs(number.real - c_drag_p) < 3.0 * number.sigma


@pytest.mark.parametrize(("seed", "rival"), [(317, True), (321, False)])
def test_thrust_that_differs_is_not_exchanged_for_drag(seed, rival):
    """Where drag would do as well, and thrust beside it may be nominal, neither has a name."""
    match = matched(
        plane_flight(seed=seed, ratio=0.7, throttle_swing=0.1, noise=0.2, seconds=150.0)
    )
    number = match.numbers["thrust_scale.ratio"]
    assert abs(number.real - 0.7) < 2.0 * number.sigma
    assert (abs(number.real - 1.0) < 2.0 * number.sigma) is rival
    assert names(match) == (set() if rival else {"thrust_scale"})
    assert match.note.startswith("drag and thrust_scale would explain") is rival
    assert match.explained is not rival


def test_drag_is_known_no_better_than_the_law_of_the_propeller():
    """What bends the line is drag to the fit: its sigma says so, where there is such a line."""
    straight, bent = (
        matched(plane_flight(seed=13, seconds=240.0, lost=0.02, bend=bend)).numbers["drag.c_drag_p"]
        for bend in (0.0, 0.3)
    )
    shift = 0.3 * 0.02**2 * 9.80665 / 0.7 / (0.5 * 1.14 * (1.14 / 1.225) * 0.45 / 2.0)
    assert bent.real - straight.real == pytest.approx(shift, rel=0.2)
    assert shift == pytest.approx(bent.sigma, rel=0.3)
    none = matched(plane_flight(seed=13, seconds=240.0)).numbers["drag.c_drag_p"]
    assert none.sigma < 0.3 * shift


def test_a_heading_as_good_as_compasses_are_has_no_name_and_leaves_less_than_a_bad_one():
    good, bad = (
        [matched(plane_flight(seed=seed, heading_off=off)) for seed in range(10, 14)]
        for off in (0.02, 0.1)
    )
    assert all(names(match) == set() for match in good)
    assert any(match.explained for match in good)
    assert not any(match.explained for match in bad)
    assert np.mean([m.unexplained for m in good]) < 0.5 * np.mean([m.unexplained for m in bad])


@pytest.mark.parametrize(("c_lift_0", "explained"), [(0.4, False), (0.56, True)])
def test_a_difference_whose_size_nobody_knows_is_not_called_none(monkeypatch, c_lift_0, explained):
    """Its number may be anything; that the force is not that of the nominal airframe stays."""

    def doubt(fit):
        out = np.zeros(len(fit.theta))
        out[fit.model.indices("lift")] = 100.0
        return out

    monkeypatch.setattr("onboard.core.vehicle.matching.propeller_doubt", doubt)
    match = matched(plane_flight(seed=5, c_lift_0=c_lift_0))
    assert "lift" in {n.name for n in match.not_testable}
    assert "lift" not in names(match)
    assert match.explained is explained
    # Beside it all that would do in its place.
    told = match.note.partition(" would explain ")[0]
    assert ("lift" in told) is not explained


@pytest.mark.parametrize(("c_lift_0", "explained"), [(0.4, False), (0.55, True)])
def test_what_is_not_surely_large_is_not_called_nothing(monkeypatch, c_lift_0, explained):
    """Nearly three times what matters, with a sigma of half of that: no name, and not explained."""

    def doubt(fit):
        out = np.zeros(len(fit.theta))
        out[fit.model.indices("lift")] = 0.08, 0.5
        return out

    monkeypatch.setattr("onboard.core.vehicle.matching.propeller_doubt", doubt)
    match = matched(plane_flight(seed=5, c_lift_0=c_lift_0))
    assert "lift" not in {n.name for n in match.not_testable}
    assert names(match) == set()
    assert match.explained is explained
    assert ("lift" in match.note.partition(" would explain ")[0]) is not explained


def test_what_could_not_be_tested_is_not_taken_for_nominal(monkeypatch):
    """With a throttle that hardly moves, less thrust and more drag are one to the flight.

    Where nobody knows the drag, the thrust is no more known: either would explain it.
    """
    flight = plane_flight(seed=321, ratio=0.7, throttle_swing=0.1, noise=0.2, seconds=150.0)
    (thrust,) = matched(flight).effects
    assert (thrust.name, thrust.rivals) == ("thrust_scale", ())

    def doubt(fit):
        out = np.zeros(len(fit.theta))
        out[fit.model.indices("drag")] = 100.0
        return out

    monkeypatch.setattr("onboard.core.vehicle.matching.propeller_doubt", doubt)
    match = matched(flight)
    assert "drag" in {n.name for n in match.not_testable}
    assert names(match) == set()
    assert not match.explained
    assert match.note.startswith("drag and thrust_scale would explain")


def test_servos_without_a_lag_leave_the_fit_at_a_minimum():
    """Nominally they are slow; a fit that cannot go below a shortest lag would stop on its way."""
    flight = plane_flight(seed=4, wind=(-3.4, 7.0), c_drag_p=0.18, reading=1.0, servo_lag=1e-4)
    model = plane_model(flight, PlaneAirframe(), SIGMA)
    fit = likelier(model)
    score = total(fit.blocks, len(fit.theta))[1] + fit.prior * (model.nominal - fit.theta)
    # What a Newton step would still gain, of a chi-square.
    assert score @ np.linalg.solve(fit.information, score) < 0.1
    match = matched(flight)
    assert names(match) == {"wind", "drag"}
    lag, drag = match.numbers["servo_lag"], match.numbers["drag.c_drag_p"]
    assert abs(lag.real) < 3.0 * lag.sigma + 0.003
    assert abs(drag.real - 0.18) < 3.0 * drag.sigma


def test_of_two_valleys_the_likelier_is_taken(monkeypatch):
    """Whichever start leads there."""
    model = plane_model(plane_flight(seed=4, wind=(2.4, 6.6), reading=1.0), PlaneAirframe(), SIGMA)
    right = fitted(model)
    wrong = right.theta.copy()
    wrong[model.index("propeller_inflow")] += 0.05
    wrong[model.index("log_ratio")] += 0.5
    worse = summed(model, wrong, right.prior, right.noise, right.sensitivity)
    assert deviance(worse) > deviance(right) + 10.0
    starts = []
    for order in ([right, worse], [worse, right]):
        left = list(order)

        def fitted_from(its, start=None, noise=None, left=left):
            starts.append(start)
            return left.pop(0)

        monkeypatch.setattr("onboard.core.vehicle.matching.fitted", fitted_from)
        assert likelier(model) is right
    # The second begins in the wind of the first, and with all else as it nominally is.
    again = starts[1]
    assert again[model.index("north")] == right.theta[model.index("north")]
    assert again[model.index("log_ratio")] == 0.0


def test_a_fit_ends_at_the_same_place_from_another_ones_end_and_noise():
    """Where some steps are gone and the rest is fitted again, nothing is begun from nothing."""
    whole = plane_flight(seed=6, wind=(3.0, -5.0))
    model = plane_model(whole, PlaneAirframe(), SIGMA)
    kept = np.arange(len(whole)) % 97 > 0
    fewer = replace(model, flight=whole.kept(kept))
    before = fitted(model)
    again, anew = fitted(fewer, before.theta, before.noise), fitted(fewer)
    assert np.max(np.abs(again.theta - anew.theta) / anew.sigma) < 0.1
    assert [its.correlation_s for its in again.noise] == [its.correlation_s for its in anew.noise]
    assert np.allclose(again.sigma, anew.sigma, rtol=0.02)


def rolling(flight, seconds):
    """The flight, begun by a roll along a runway that nobody has told it from."""
    n = round(seconds / flight.step_s)
    R_bn, v_n, f_b = flight.R_bn.copy(), flight.v_n.copy(), flight.f_b.copy()
    airspeed, commands = flight.airspeed.copy(), flight.commands.copy()
    speed = 20.0 * np.minimum(np.arange(n) / (0.6 * n), 1.0)
    R_bn[:n] = np.eye(3)
    v_n[:n] = speed[:, None] * np.array([1.0, 0.0, 0.0])
    f_b[:n] = np.stack([np.gradient(speed, flight.step_s), 0.0 * speed, 0.0 * speed - G], axis=1)
    airspeed[:n] = speed
    commands[:n, 0] = 0.8
    v_b = np.einsum("nij,nj->ni", R_bn, v_n)
    return replace(
        flight, R_bn=R_bn, v_n=v_n, v_b=v_b, f_b=f_b, airspeed=airspeed, commands=commands
    )


def test_what_no_airframe_does_bends_no_number():
    flight = plane_flight(
        seed=20, seconds=150.0, wind=(-3.0, -6.0), c_drag_p=0.145, throttle_swing=0.12
    )
    match = matched(rolling(flight, 6.0))
    assert names(match) == {"wind", "drag"}
    drag = match.numbers["drag.c_drag_p"]
    assert abs(drag.real - 0.145) < 3.0 * drag.sigma


def test_what_gusts_may_have_turned_is_no_reason_to_name_drag_before_thrust():
    """The throttle hardly moves; beside all others induced drag is off by what gusts turn it."""
    match = matched(
        plane_flight(
            seed=42,
            seconds=150.0,
            ratio=0.75,
            gusts=0.5,
            throttle_swing=0.09,
            noise=0.2,
            reading=1.0,
        )
    )
    # Nor is thrust named: drag would do nearly as well, and beside it the thrust may be nominal.
    assert names(match) <= {"turbulence"}
    assert match.note.startswith("drag and thrust_scale would explain")
    assert not match.explained


def kicked_flight(seed, **changes):
    """Kicks of the rudder, of which a recording lacks the moment."""
    flight = plane_flight(seed=seed, kicks=0.5, **changes)
    whole = replace(flight, history=History(flight.commands, flight.piece))
    jumps = np.abs(np.diff(flight.commands[:, 1], prepend=0.0)) > 0.1
    flight = whole.kept(~jumps)
    flight.piece[:] = np.cumsum(np.diff(flight.t, prepend=flight.t[0]) > 1.5 * STEP)
    return flight


def test_a_servo_follows_through_steps_that_are_left_out():
    """Settled anew at each cut, rudder and sideslip would share the side force in another way."""
    number = matched(kicked_flight(31, c_y_b=-0.4)).numbers["side_force.c_y_b"]
    assert number.real == pytest.approx(-0.4, rel=0.05)
    assert abs(number.real + 0.4) < 3.0 * number.sigma


def test_several_flights_keep_their_commands_apart():
    flights = [kicked_flight(seed, seconds=60.0) for seed in (1, 2)]
    model = ServoLag()
    alone = []
    for flight in flights:
        air = Air(flight)
        model.act(air, [0.2])
        alone.append(air.commands)
    together = Air(joined(flights))
    model.act(together, [0.2])
    assert together.commands == pytest.approx(np.concatenate(alone), abs=1e-9)


@pytest.mark.parametrize("seed", [41, 42])
def test_on_a_straight_and_even_flight_a_heading_that_is_off_is_no_wind_that_is_sure(seed):
    """Two degrees at 24 m/s are 0.9 m/s across: by sideslip they were told to 0.04 m/s."""
    still = {"turning": 0.0, "speeds": 0.0}
    flight = plane_flight(seed=seed, seconds=40.0, turned=0.04, reading=1.0, **still)
    match = matched(replace(flight, attitude_sigma=np.array([1e-3, 1e-3, 0.05])))
    across = match.numbers["wind.east"]
    assert abs(across.real) < 3.0 * across.sigma
    assert abs(across.real) < 0.5


def test_turns_tell_the_wind_from_a_heading_that_is_off():
    known = np.array([1e-3, 1e-3, 0.05])
    flight = plane_flight(seed=44, wind=(2.0, -3.0), turned=0.04, reading=1.0)
    match = matched(replace(flight, attitude_sigma=known))
    for key, truth in (("north", 2.0), ("east", -3.0)):
        number = match.numbers[f"wind.{key}"]
        assert abs(number.real - truth) < 4.0 * number.sigma
        assert number.sigma < 0.15
    off = match.numbers["turned_down"]
    assert abs(abs(off.real) - 0.04) < 4.0 * off.sigma


def test_a_sensor_that_fails_in_flight_is_no_gust():
    """Gusts of 172 m/s had explained it, and the flight alone was four times as far off."""
    flight = plane_flight(wind=(3.0, -2.0), reading=1.0, seed=4)
    rng = np.random.default_rng(2)
    wanders = 347.0 + smooth(rng, len(flight), 0.5, 20.0)
    late = flight.t > flight.t[0] + 100.0
    match = matched(replace(flight, airspeed=np.where(late, wanders, flight.airspeed)))
    assert names(match) == {"wind"}
    assert match.explained
    assert "airspeed sensor reads what the force of the wing contradicts" in match.note
    assert "airspeed_scale" in {n.name for n in match.not_testable}
