"""What a plane does that no effect knows of, and what its flight cannot tell, is no air."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.effects.airspeed_scale import seen_by_a_pitot
from onboard.core.vehicle.plane import plane_commands
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.core.vehicle.signals import Signals, Stream
from tests.core.vehicle.flights import plane_flight
from tests.core.vehicle.planes import matched, names

pytestmark = pytest.mark.slow


def upwards(flight, coefficient):
    """A force across the flow, by the pressure of still air."""
    q = 0.5 * flight.rho**2 / 1.225 * np.sum(flight.v_b**2, axis=1) * 0.45 / 2.0
    alpha = np.arctan2(flight.v_b[:, 2], flight.v_b[:, 0])
    flight.f_b[:, 0] += q * coefficient(alpha) * np.sin(alpha)
    flight.f_b[:, 2] -= q * coefficient(alpha) * np.cos(alpha)
    return flight


def test_lift_that_bends_is_no_air_and_its_line_is_told():
    flight = plane_flight(seed=41, seconds=240.0, angles=0.04)
    bent = upwards(flight, lambda alpha: -40.0 * (alpha + 0.03) ** 2)
    match = matched(bent)
    assert "no line over the angle of attack" in match.note
    assert "turbulence" not in names(match)
    assert not match.explained
    assert match.numbers["lift.c_lift_a"].real == pytest.approx(6.9, rel=0.2)


def test_a_wind_that_is_another_one_higher_up_is_no_gust():
    flight = plane_flight(seed=42, reading=1.0)
    climbed = np.linspace(0.0, 200.0, len(flight))
    blown = 0.02 * (climbed - climbed.mean())
    flight.height[:] += climbed
    flight.v_n[:, 0] += blown
    flight.v_b[:] = np.einsum("nij,nj->ni", flight.R_bn, flight.v_n)
    match = matched(flight)
    assert not {"turbulence", "lift", "drag", "side_force"} & names(match)
    assert "the wind" in match.note


def test_an_airspeed_that_is_off_by_as_much_at_every_speed_has_no_other_scale():
    flight = plane_flight(seed=43, seconds=240.0, reading=1.0)
    flight.airspeed[:] += 1.5
    match = matched(flight)
    assert names(match) == set()
    assert "reads off by as much at every speed" in match.note
    assert not match.explained


@pytest.mark.parametrize(("seed", "reading"), [(52, None), (51, 1.0)])
def test_gusts_repeat_with_nothing_that_a_plane_does(seed, reading):
    match = matched(plane_flight(seed=seed, wind=(3.0, 1.0), gusts=0.5, reading=reading))
    assert "repeats" not in match.note
    assert "the wind became another" not in match.note
    assert not {"lift", "side_force"} & names(match)
    for effect in match.effects:
        if effect.name == "turbulence" and reading is None:
            # Known no better than the side force that shows it.
            assert abs(effect.values["rms"].real - 0.5) < 2.0 * effect.values["rms"].sigma


def test_a_plane_that_hardly_slips_shows_no_side_force_and_its_wind_is_right():
    """A force of none fits what there is of sideslip, whatever the force is, in any wind across."""
    flight = plane_flight(seed=44, wind=(0.0, 4.0))
    still = flight.v_b - np.einsum("nij,j->ni", flight.R_bn, [0.0, 4.0, 0.0])
    still[:, 1] = 0.0
    flight.v_n[:] = np.einsum("nji,nj->ni", flight.R_bn, still)
    flight.v_n[:, 1] += 4.0
    noise = np.random.default_rng(1).normal(0.0, 0.02, flight.v_n.shape)
    flight.v_b[:] = np.einsum("nij,nj->ni", flight.R_bn, flight.v_n + noise)
    flight.commands[:, 1] = 0.0
    flight.f_b[:, 1] = np.random.default_rng(2).normal(0.0, 0.02, len(flight))
    match = matched(flight)
    assert "side_force" not in names(match)
    assert "side_force" in {n.name for n in match.not_testable}
    assert match.wind.east == pytest.approx(4.0, abs=0.2)


def test_without_outputs_nothing_is_said_of_the_side_force():
    """A rudder that nobody recorded goes with the sideslip."""
    whole = plane_flight(seed=45, c_y_b=-0.4)
    flight = replace(whole, commands=np.zeros((len(whole), 0)))
    match = matched(flight)
    assert "side_force" not in names(match)
    assert "no rudder output" in {n.name: n.why for n in match.not_testable}["side_force"]


def test_a_file_may_have_no_induced_drag():
    """What is told as none is not handed back as what the file had before."""
    flight = plane_flight(seed=46)
    alpha = np.arctan2(flight.v_b[:, 2], flight.v_b[:, 0])
    lift = 0.56 + 6.9 * alpha
    flight = upwards(flight, lambda alpha: 0.0 * alpha)
    q = 0.5 * flight.rho**2 / 1.225 * np.sum(flight.v_b**2, axis=1) * 0.45 / 2.0
    flight.f_b[:, 0] += q * lift**2 * PlaneAirframe().induced * np.cos(alpha)
    flight.f_b[:, 2] += q * lift**2 * PlaneAirframe().induced * np.sin(alpha)
    match = matched(flight)
    assert names(match) == {"drag"}
    assert PlaneAirframe.of(match.frame).induced < 0.2 * PlaneAirframe().induced


def outputs_of(functions, us, reversed_=()):
    """Commands of a plane whose channels have these functions, and pulse widths."""
    parameters = {f"SERVO{n}_FUNCTION": f for n, f in functions.items()}
    parameters |= {f"SERVO{n}_REVERSED": 1.0 for n in reversed_}
    t = 0.1 * np.arange(us.shape[0])
    return plane_commands(Signals(outputs=Stream(t, us), parameters=parameters, kind="plane")).x


def test_a_v_tail_is_a_rudder_and_an_elevator():
    """Its rudder was none, and a third of the side force was told with a sigma of a twentieth."""
    rng = np.random.default_rng(1)
    throttle, rudder, elevator = rng.uniform(-400.0, 400.0, (3, 50))
    left, right = 0.5 * (elevator + rudder), 0.5 * (elevator - rudder)
    functions = {1: 4.0, 2: 80.0, 3: 70.0, 4: 79.0}
    us = 1500.0 + np.column_stack([0.0 * left, -right, throttle, left])
    got = outputs_of(functions, us, reversed_=(2,))
    assert got[:, 1] == pytest.approx(0.5 * rudder / 500.0)
    assert got[:, 2] == pytest.approx(0.5 * elevator / 500.0)


def test_elevons_are_an_elevator_and_no_rudder():
    rng = np.random.default_rng(2)
    throttle, aileron, elevator = rng.uniform(-400.0, 400.0, (3, 50))
    left, right = 0.5 * (elevator - aileron), 0.5 * (elevator + aileron)
    us = 1500.0 + np.column_stack([-right, -left, throttle])
    got = outputs_of({1: 78.0, 2: 77.0, 3: 70.0}, us, reversed_=(1, 2))
    assert not got[:, 1].any()
    assert got[:, 2] == pytest.approx(0.5 * elevator / 500.0)


def test_flight_past_the_stall_is_left_out_and_said():
    """What a stalled wing does no coefficient of the file tells."""
    flight = plane_flight(seed=47, seconds=150.0)
    stalled = (flight.t > 120.0) & (flight.t < 129.0)
    flight.v_b[stalled, 2] = 0.6 * flight.v_b[stalled, 0]
    flight.v_n[:] = np.einsum("nji,nj->ni", flight.R_bn, flight.v_b)
    match = matched(flight)
    assert names(match) == set()
    assert "the wing is stalled, or nearly so, for 9 s, of which nothing is told" in match.note
    assert "stalled" not in matched(plane_flight(seed=47, seconds=150.0)).note


@pytest.mark.parametrize(
    ("degrees", "share"), [(0.0, 1.0), (20.0, 1.0), (55.0, 0.5**0.5), (90.0, 0.0)]
)
@pytest.mark.parametrize("aside", [1, 2])
def test_a_pitot_tube_sees_less_of_what_comes_from_aside(degrees, share, aside):
    u_b = np.zeros((1, 3))
    u_b[0, [0, aside]] = 20.0 * np.cos(np.radians(degrees)), 20.0 * np.sin(np.radians(degrees))
    assert seen_by_a_pitot(u_b) == pytest.approx(20.0 * share, abs=1e-9)


def test_an_airspeed_sensor_in_a_slip_reads_no_other_wind_and_has_no_other_scale():
    wind = np.array([3.0, -2.0, 0.0])
    flight = plane_flight(seed=4, seconds=150.0, wind=wind[:2], reading=1.0, kicks=1.9)
    u_b = flight.v_b - np.einsum("nij,j->ni", flight.R_bn, wind)
    share = seen_by_a_pitot(u_b) / np.linalg.norm(u_b, axis=1)
    assert np.min(share) < 0.97
    match = matched(replace(flight, airspeed=flight.airspeed * share))
    assert names(match) == {"wind"}
    assert [match.wind.north, match.wind.east] == pytest.approx(wind[:2], abs=0.1)
    assert "airspeed sensor" not in match.note
