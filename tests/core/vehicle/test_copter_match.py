from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.effects.motor_lag import MotorLag
from onboard.core.vehicle.flight import History
from onboard.core.vehicle.several import joined
from onboard.core.vehicle.signals import Signals
from tests.core.vehicle.flights import STEP, copter_flight

pytestmark = pytest.mark.slow
SIGMA = np.array([0.003, 0.003, 0.01])


def matched(flight):
    return match_copter(flight, Signals(kind="copter"), CopterAirframe(), SIGMA)


def handed_back(match):
    return CopterAirframe.of({k: v for k, v in match.frame.items() if isinstance(v, float)})


def names(match):
    return {d.name for d in match.effects}


def within(match, key, truth, sigmas=4.0):
    number = match.numbers[key]
    assert abs(number.real - truth) < sigmas * number.sigma, (key, number, truth)


def test_the_nominal_airframe_in_still_air_is_clean():
    match = matched(copter_flight())
    assert names(match) == set()
    assert match.explained
    within(match, "rotor_drag.mcoef", 0.24833)
    within(match, "body_drag.x", 0.058108)


def test_a_wind_is_found_and_is_taken_for_nothing_else():
    match = matched(copter_flight(wind=(-3.0, 5.2), seed=2))
    assert names(match) == {"wind"}
    assert match.wind is not None
    assert match.wind.north == pytest.approx(-3.0, abs=0.1)
    assert match.wind.east == pytest.approx(5.2, abs=0.1)
    assert match.mismatch["x"].after < 0.05 < match.mismatch["x"].before
    assert match.alone_after < 0.2 * match.alone_before


@pytest.mark.parametrize("rising", [2.5, -1.5])
def test_air_that_rises_is_neither_a_propeller_nor_a_wind_across(rising):
    match = matched(copter_flight(wind=(-2.2, 3.8), rising=rising, seed=6))
    assert names(match) == {"wind"}
    assert match.explained
    within(match, "rising", rising)
    within(match, "wind.north", -2.2)
    within(match, "wind.east", 3.8)
    assert f"the air {'rose' if rising > 0.0 else 'sank'} by {abs(rising)} m/s" in match.note


def test_a_wind_that_grows_with_height_is_told_from_a_uniform_one():
    match = matched(copter_flight(wind=(4.0, -3.0), exponent=0.5, seed=3))
    assert names(match) == {"wind", "wind_profile"}
    within(match, "wind_profile.exponent", 0.5)


def test_both_drags_are_found_with_their_sizes():
    match = matched(copter_flight(c_m=0.45, area=0.03, seed=4))
    assert names(match) == {"rotor_drag", "body_drag"}
    within(match, "rotor_drag.mcoef", 0.45)
    within(match, "body_drag.x", 0.03)
    # A frame file with them has just these.
    frame = handed_back(match)
    assert frame.rotor_drag == pytest.approx(0.45, rel=0.03)
    assert frame.body_drag == pytest.approx(0.03, rel=0.05)


def test_thrust_that_leans_is_no_offset_of_the_accelerometer():
    match = matched(copter_flight(tilt=(0.05, 0.0), seed=5))
    assert names(match) == {"thrust_tilt"}
    within(match, "thrust_tilt.x", 0.05)


def test_thrust_by_mass_and_its_curve_are_told_apart():
    assert names(matched(copter_flight(ratio=0.8, seed=6))) == {"thrust_scale"}
    assert names(matched(copter_flight(expo=0.2, seed=7))) == {"thrust_curve"}


def test_a_hover_hands_back_its_thrust_and_not_what_makes_it():
    """Mass, curve and battery are nobody's to tell there; what they make of 60 % throttle is."""
    match = matched(copter_flight(ratio=0.82, seed=31, seconds=120.0, still=True))
    assert names(match) == set()
    assert not match.shown
    frame = handed_back(match)

    def thrust(hover, expo, command=0.6):
        return ((1.0 - expo) * command + expo * command**2) / hover

    found = thrust(frame.hoverThrOut, frame.propExpo)
    assert found == pytest.approx(0.82 * thrust(0.39, 0.65), rel=2e-3)
    assert match.mismatch["z"].after < 0.01 * match.mismatch["z"].before
    assert match.alone_after < 0.05 * match.alone_before
    assert "the thrust is known" in match.note


def test_a_hover_that_shows_nothing_is_no_closer_with_what_nobody_knows():
    match = matched(copter_flight(seed=32, seconds=120.0, still=True))
    assert not match.shown
    assert match.mismatch["z"].after == match.mismatch["z"].before
    assert handed_back(match).hoverThrOut == pytest.approx(0.39)


@pytest.mark.parametrize("seconds", [11.0, 25.0, 50.0])
def test_a_short_flight_is_not_clean_by_having_no_flight_to_be_proven_on(seconds):
    match = matched(copter_flight(ratio=0.6, seed=33, seconds=seconds))
    assert not match.explained or names(match)
    assert match.mismatch["z"].after < 0.1 * match.mismatch["z"].before
    for difference in match.effects:
        if difference.level == "vehicle" and difference.name != "turbulence":
            assert difference.held_out_after < difference.held_out_before


def test_recordings_of_one_match_share_no_block_however_short_they_are():
    flights = [copter_flight(seed=k, seconds=s) for k, s in ((1, 11.0), (2, 13.0), (3, 17.3))]
    whole = joined(flights)
    block = whole.blocks_of(whole.t)
    assert len(np.unique(block)) >= 5
    for k in range(2):
        assert block[whole.part == k].max() < block[whole.part == k + 1].min()
    alone = copter_flight(seconds=240.0)
    assert len(np.unique(alone.blocks_of(alone.t))) == 20


def test_a_battery_that_gives_way_is_seen_in_the_thrust():
    match = matched(copter_flight(volts=(12.6, 9.5), sag=1.0, seed=8))
    assert names(match) == {"voltage_sag"}
    within(match, "voltage_sag.share", 1.0)


def test_a_voltage_that_falls_by_little_is_not_left_to_the_thrust():
    """By 3 % in a whole flight, and 7 % below the full one: thrust that would be 14 % too small."""
    match = matched(copter_flight(volts=(11.9, 11.5), sag=1.0, expo=0.3, seed=12))
    assert names(match) == {"voltage_sag", "thrust_curve"}
    within(match, "thrust_curve.expo", 0.3)
    within(match, "voltage_sag.share", 1.0)


def test_a_battery_that_is_down_as_soon_as_it_is_loaded_was_full_at_rest():
    """Flown from 10.4 V on, it is no pack of fewer cells, whose thrust would be a third less."""
    flight = copter_flight(volts=(10.4, 8.0), sag=1.0, seed=13)
    match = matched(replace(flight, rest_volts=12.6))
    assert names(match) == {"voltage_sag"}
    within(match, "voltage_sag.share", 1.0)
    within(match, "thrust_scale.log_ratio", 0.0)


def test_without_outputs_the_sides_are_told_and_the_thrust_is_not_tested():
    flight = copter_flight(wind=(4.0, 0.0), seed=9)
    match = matched(flight.kept(np.ones(len(flight), dtype=bool)).__class__(
        **{f: getattr(flight, f) for f in flight.__slots__ if f != "commands"},
        commands=np.zeros((len(flight), 0)),
    ))  # fmt: skip
    assert names(match) == {"wind"}
    assert {"thrust_scale", "thrust_curve", "motor_lag"} <= {n.name for n in match.not_testable}


def test_a_hover_says_little_and_says_so():
    match = matched(copter_flight(still=True, seconds=60.0, seed=10))
    assert names(match) == set()
    assert {"rotor_drag", "body_drag"} <= {n.name for n in match.not_testable}


def test_sigmas_cover_the_truth_over_many_flights():
    misses = []
    for seed in range(8):
        numbers = matched(copter_flight(wind=(2.0, -1.0), seconds=120.0, seed=100 + seed)).numbers
        for key, truth in (("wind.north", 2.0), ("wind.east", -1.0), ("thrust_curve.expo", 0.65)):
            misses.append(abs(numbers[key].real - truth) / numbers[key].sigma)
    assert np.mean(np.array(misses) < 2.0) >= 0.85
    assert max(misses) < 5.0


def test_a_gust_front_is_said_and_is_not_called_clean():
    flight = copter_flight(seed=11)
    struck = (flight.t > flight.t[0] + 80.0) & (flight.t < flight.t[0] + 89.0)
    flight.f_b[struck, 0] += 0.25 * 5.0
    match = matched(flight)
    assert names(match) == set()
    assert not match.explained
    assert "no effect describes the force at" in match.note


def test_motors_that_follow_late_have_the_time_constant_of_their_low_pass():
    match = matched(copter_flight(lag=0.12, seed=21))
    assert names(match) == {"motor_lag"}
    number = match.numbers["motor_lag.time_constant"]
    assert abs(number.real - 0.12) < 3.0 * number.sigma
    assert number.sigma < 0.01


@pytest.mark.parametrize("late", [0.05, 0.17])
def test_outputs_that_are_logged_late_are_a_delay_of_the_log_and_no_motor(late):
    flight = copter_flight(seed=22)
    command = np.interp(flight.t - late, flight.t, flight.commands[:, 0])
    flight.commands[:, 0], flight.commands[:, 1] = command, command**2
    match = matched(flight)
    assert names(match) == {"output_delay"}
    delay = match.effects[0].values["delay"]
    assert match.effects[0].level == "sensor"
    assert abs(delay.real - late) < 3.0 * delay.sigma + 0.005


def test_rotors_that_lean_ahead_and_aside_alike_are_not_said_to_drag_less():
    """The simulator's form of the drag and less of it would do as well: it is one effect more."""
    match = matched(copter_flight(tilt=(0.036, -0.036), seed=32, noise=0.03))
    assert names(match) == {"thrust_tilt"}
    within(match, "rotor_drag.mcoef", 0.24833)


def test_without_a_ground_no_wind_is_said_to_grow_with_height():
    """The lowest point that was flown is no ground: the law would have its end there."""
    flight = copter_flight(wind=(4.0, -3.0), seed=3)
    match = matched(replace(flight, ground=float(np.min(flight.height)), ground_seen=False))
    why = {n.name: n.why for n in match.not_testable}
    assert "ground" in why["wind_profile"]
    assert "ground" in why["ground_effect"]
    assert names(match) == {"wind"}


def test_effects_that_undo_each_other_are_found_both():
    """More thrust by a curve that has less of it at hover: alone, neither explains anything."""
    match = matched(copter_flight(ratio=1.25, expo=0.946, seed=11))
    assert names(match) == {"thrust_scale", "thrust_curve"}
    within(match, "thrust_curve.expo", 0.946)


def test_two_are_not_taken_for_a_third():
    """A battery that gives way and thrust that makes up for it look like another curve."""
    flight = copter_flight(ratio=1.25, volts=(12.6, 9.5), sag=1.0, seed=12)
    assert names(matched(flight)) == {"thrust_scale", "voltage_sag"}


def test_motors_follow_through_steps_that_are_left_out():
    """Settled anew at each cut they would have been where they were asked to be."""
    flight = copter_flight(lag=0.2, seed=22)
    whole = replace(flight, history=History(flight.commands, flight.piece))
    kept = np.arange(len(flight)) % 15 > 1
    flight = whole.kept(kept)
    flight.piece[:] = np.cumsum(np.diff(flight.t, prepend=flight.t[0]) > 1.5 * STEP)
    air = Air(flight)
    MotorLag().act(air, [0.2])
    through = Air(whole)
    MotorLag().act(through, [0.2])
    np.testing.assert_allclose(air.commands, through.commands[kept], atol=1e-12)
    number = matched(flight).numbers["motor_lag.time_constant"]
    assert number.real == pytest.approx(0.2, rel=0.05)
