from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from onboard.core.maths.frames import rotation_from_vector
from onboard.core.maths.spans import inside
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.atmosphere import density
from onboard.core.vehicle.battery import CELL_V, CHARGE_PERCENT, fitted_battery
from onboard.core.vehicle.effects.motor_lag import MotorLag
from onboard.core.vehicle.flown_alone import drift_alone
from onboard.core.vehicle.gusts import positive_square, signed_square
from onboard.core.vehicle.noise import AxisNoise, fitted_noise, whitened
from onboard.core.vehicle.recursion import Remembered, accumulated, ahead, behind, lagged
from onboard.core.vehicle.signals import Signals, Stream
from onboard.core.vehicle.smoother import PSI, Levels, Steps, smoothed
from onboard.core.vehicle.spans import grounded_spans, lasting_height
from tests.core.vehicle.flights import copter_flight


def test_the_default_frame_has_the_drag_that_the_simulator_prints():
    frame = CopterAirframe()
    assert frame.rotor_drag == pytest.approx(0.2483, abs=2e-4)
    assert 1.0 / frame.body_drag == pytest.approx(17.21, abs=0.01)


@pytest.mark.parametrize(("c_m", "area"), [(0.25, 0.06), (0.5, 0.04), (0.1, 0.01), (0.25, 0.0)])
def test_a_frame_with_drag_gives_that_drag(c_m, area):
    frame = CopterAirframe().with_drag(c_m, area)
    assert frame.rotor_drag == pytest.approx(c_m, rel=0.01)
    assert frame.body_drag == pytest.approx(area, abs=1e-3)


def test_momentum_drag_cannot_be_more_than_the_whole():
    frame = CopterAirframe.of({"mdrag_coef": 5.0})
    assert frame.body_drag == 0.0
    assert frame.rotor_drag < CopterAirframe().rotor_drag * 25.0


@pytest.mark.parametrize("given", [{"mass": "heavy"}, {"mass": 0.0}, {"disc_area": -1.0}])
def test_a_frame_that_makes_no_sense_is_refused(given):
    with pytest.raises(ValueError, match=r"mass|disc_area"):
        CopterAirframe.of(given)


def test_density_of_the_standard_atmosphere():
    assert density(0.0) == pytest.approx(1.225)
    assert density(1000.0) == pytest.approx(1.1117, abs=2e-4)
    assert density(5000.0) == pytest.approx(0.7364, abs=5e-4)


def test_whitened_noise_is_white_and_its_level_is_found():
    rng = np.random.default_rng(1)
    n, step, tau = 6000, 0.5, 2.5
    phi = np.exp(-step / tau)
    x = np.zeros(n)
    for k in range(1, n):
        x[k] = phi * x[k - 1] + np.sqrt(1 - phi**2) * rng.normal()
    y = 0.3 * (np.sqrt(0.75) * x + 0.5 * rng.normal(size=n))
    piece, ones = np.zeros(n, dtype=np.int64), np.ones(n)
    e = whitened(y[:, None], AxisNoise(0.3, 0.0, tau, 0.25), ones, piece, step)[:, 0]
    assert np.var(e) == pytest.approx(1.0, abs=0.06)
    for lag in (1, 2, 5):
        assert abs(np.mean(e[lag:] * e[:-lag])) < 0.05
    found = fitted_noise(y, ones, piece, step)
    assert found.correlation_s == 2.5
    assert found.white == 0.25
    assert found.force == pytest.approx(0.3, rel=0.1)


def test_noise_that_grows_with_sensitivity_is_told_from_noise_that_does_not():
    rng = np.random.default_rng(2)
    sensitivity = 0.3 + np.abs(rng.normal(size=4000))
    y = 1.5 * sensitivity * rng.normal(size=4000)
    piece = np.zeros(4000, dtype=np.int64)
    found = fitted_noise(y, sensitivity, piece, 0.1, gusts=True)
    assert found.gust == pytest.approx(1.5, rel=0.15)
    flat = fitted_noise(1.5 * rng.normal(size=4000), sensitivity, piece, 0.1, gusts=True)
    assert flat.gust < 0.3


def test_recursions_are_those_of_a_loop():
    rng = np.random.default_rng(3)
    z = rng.normal(size=(137, 2))
    y = np.zeros(2)
    slow = []
    for row in z:
        y = row + 0.83 * y
        slow.append(y)
    assert np.allclose(accumulated(z, 0.83), slow)


def test_each_column_has_a_factor_of_its_own_and_a_piece_begins_anew():
    z = np.random.default_rng(4).normal(size=(61, 3))
    factors, starts = np.array([0.9, 0.0, 0.4]), np.zeros(61, dtype=bool)
    starts[[0, 1, 17, 40]] = True
    y, slow = np.zeros(3), []
    for row, begins in zip(z, starts, strict=True):
        y = row + (0.0 if begins else 1.0) * factors * y
        slow.append(y)
    np.testing.assert_allclose(accumulated(z, factors, starts), slow, atol=1e-11)


@pytest.mark.parametrize("law", [behind, ahead])
def test_what_is_remembered_is_what_the_law_says_of_this_question(law):
    rng = np.random.default_rng(5)
    ask = Remembered()
    signals, pieces = rng.normal(size=(2, 50, 2)), np.zeros((2, 50), dtype=np.int64)
    pieces[1, 20:] = 1
    for signal, lag, piece, step in itertools.product(signals, (0.1, 0.3), pieces, (0.1, 0.2)):
        for _ in range(2):
            np.testing.assert_array_equal(
                ask(law, signal, lag, piece, step), law(signal, lag, piece, step)
            )
    other = ahead if law is behind else behind
    np.testing.assert_array_equal(
        ask(other, signal, lag, piece, step), other(signal, lag, piece, step)
    )


@pytest.mark.parametrize("at_once", [1, 40_000])
def test_noise_is_the_same_however_much_of_it_is_tried_at_once(monkeypatch, at_once):
    rng = np.random.default_rng(6)
    y, sensitivity = rng.normal(size=(2, 3000))
    piece = np.repeat([0, 1, 2], 1000)
    whole = fitted_noise(y, np.abs(sensitivity), piece, 0.5, gusts=True)
    monkeypatch.setattr("onboard.core.vehicle.noise.AT_ONCE", at_once)
    assert fitted_noise(y, np.abs(sensitivity), piece, 0.5, gusts=True) == whole


def test_a_lag_shifts_a_ramp_by_its_time_constant():
    t = 0.1 * np.arange(200)
    out = lagged(t[:, None], 0.3, np.zeros(200, dtype=np.int64), 0.1)[:, 0]
    assert out[100:] == pytest.approx(t[100:] - 0.3, abs=1e-6)


@pytest.mark.parametrize("u", [-4.0, -0.5, 0.0, 1.0, 6.0])
def test_squares_in_gusts_are_those_of_many_gusts(u):
    g = 2.0 * np.random.default_rng(4).normal(size=400_000)
    still = np.array([u])
    signed = signed_square(still, 4.0)
    assert signed[0] == pytest.approx(np.mean(np.abs(u + g) * (u + g)), abs=0.08)
    assert positive_square(still, 4.0, signed)[0] == pytest.approx(
        np.mean(np.maximum(0.0, u + g) ** 2), abs=0.08
    )


def test_a_battery_is_known_from_how_it_gives_way():
    t = np.arange(0.0, 300.0, 0.1)
    amperes = 25.0 + 8.0 * np.sin(t / 7.0)
    left = 100.0 * (1.0 - np.cumsum(amperes * 0.1) / 3600.0 / 3.0)
    volts = np.interp(left, CHARGE_PERCENT, CELL_V) / CELL_V[-1] * 12.6 - 0.03 * amperes
    found = fitted_battery(t, volts, amperes, 12.6)
    assert found is not None
    assert found.capacity == pytest.approx(3.0, rel=0.05)
    assert found.resistance == pytest.approx(0.03, rel=0.1)


def test_the_ground_is_found_but_a_hover_is_not_the_ground():
    t = np.arange(0.0, 100.0, 0.2)
    height = np.interp(t, [0, 10, 20, 60, 70, 100], [580, 580, 600, 600, 580, 580])
    v = np.stack([0 * t, 0 * t, -np.gradient(height, t)], axis=1)
    spans = grounded_spans(t, v, height)
    assert spans[0][0] <= 0.0
    assert 9.0 < spans[0][1] < 15.0
    assert all(not a <= 40.0 <= b for a, b in spans)
    assert any(a < 75.0 and b >= 99.0 for a, b in spans)


def _taken_off(wander_m, *, measured=True):
    """A plane that stands for 10 s, rolls for 6 s, flies, and lands, as a receiver has it."""
    t = np.arange(0.0, 200.0, 0.2)
    speed = np.interp(t, [0, 10, 16, 180, 186, 200], [0, 0, 20, 20, 0, 0])
    climbed = np.interp(t, [0, 16, 40, 150, 180, 200], [0, 0, 60, 60, 0, 0])
    down = -np.gradient(climbed, t) if measured else np.full(len(t), np.nan)
    return t, np.stack([speed, 0 * t, down], axis=1), climbed + wander_m * t / t[-1]


def _covered(spans, begin, end):
    at = np.linspace(begin, end, 50)
    return inside(at, spans).all()


@pytest.mark.parametrize("wander_m", [-6.0, -2.5, 0.0, 2.5, 6.0])
@pytest.mark.parametrize("measured", [True, False])
def test_a_plane_rolls_before_it_flies_wherever_its_height_wanders_to(wander_m, measured):
    t, v, height = _taken_off(wander_m, measured=measured)
    spans = grounded_spans(t, v, height, rolls=True, wings=True)
    assert _covered(spans, 0.0, 15.5)
    assert _covered(spans, 181.0, 199.0)
    assert not inside(np.linspace(25.0, 170.0, 50), spans).any()


@pytest.mark.parametrize("damaged", [-1e4, -300.0, 300.0, 1e6])
@pytest.mark.parametrize("measured", [True, False])
@pytest.mark.parametrize("at_s", [0.0, 5.0, 12.0, 60.0, 199.8])
def test_one_damaged_height_hides_no_stand_and_makes_none(damaged, measured, at_s):
    t, v, height = _taken_off(-2.5, measured=measured)
    height[np.argmin(np.abs(t - at_s))] += damaged
    spans = grounded_spans(t, v, height, rolls=True, wings=True)
    assert _covered(spans, 0.0, 15.5)
    assert _covered(spans, 181.0, 199.0)
    assert not inside(np.linspace(25.0, 170.0, 50), spans).any()
    assert abs(np.min(lasting_height(t, height)) + 2.5) < 0.1


@pytest.mark.parametrize("count", [1, 2, 3, 7, 50])
def test_a_climb_is_what_it_was(count):
    t = 0.2 * np.arange(count)
    lasting = lasting_height(t, 3.0 * t)
    np.testing.assert_allclose(lasting[3:-3], 3.0 * t[3:-3])
    assert np.max(np.abs(lasting - 3.0 * t)) <= 3.0 * 0.6 + 1e-9


def test_what_may_hover_has_not_landed_above_where_it_stood():
    t, v, height = _taken_off(0.0)
    hovering = (t > 80.0) & (t < 90.0)
    v[hovering] = 0.0
    for wings in (False, True):
        spans = grounded_spans(t, v, height, rolls=True, wings=wings)
        assert not inside(t[hovering], spans).any()


@pytest.mark.parametrize("wander_m", [0.0, 4.0])
def test_a_second_stand_is_told_by_the_autopilot_wherever_the_height_has_wandered(wander_m):
    t = np.arange(0.0, 300.0, 0.2)
    up = np.interp(t, [0, 10, 20, 90, 100, 200, 210, 280, 290], [0, 0, 20, 20, 0, 0, 20, 20, 0])
    v = np.stack([0 * t, 0 * t, -np.gradient(up, t)], axis=1)
    height, said = up + wander_m * (t > 150.0), (up < 0.01) & (t < 280.0)
    spans = grounded_spans(t, v, height, said=said)
    assert _covered(spans, 100.0, 199.0)
    assert not inside(t[(up > 10.0)], spans).any()


def test_a_word_that_nobody_took_back_does_not_end_a_flight_that_moves():
    t, v, height = _taken_off(0.0)
    stuck = np.ones(len(t), dtype=bool)
    for said in (None, stuck):
        spans = grounded_spans(t, v, height, said=said, rolls=True, wings=True)
        assert not inside(np.linspace(25.0, 170.0, 50), spans).any()


def test_a_model_without_error_does_not_drift_alone():
    flight = copter_flight(seconds=40.0)
    n = len(flight)
    none, slope = np.zeros((n, 3)), np.zeros((n, 3, 3))
    assert drift_alone(flight, none, slope)[-1] == 0.0
    push = none + np.array([0.1, 0.0, 0.0])
    level = drift_alone(copter_flight(seconds=40.0, still=True), push, slope)[-1]
    assert level == pytest.approx(1.0, rel=1e-6)


def test_a_tilt_of_the_attitude_is_found_from_the_velocity():
    n, dt = 300, 0.2
    rng = np.random.default_rng(5)
    f_n = np.zeros((n, 3)) + np.array([0.0, 0.0, -9.81])
    tilt = np.array([0.01, -0.02, 0.0])
    # What is integrated with a tilted attitude lacks tilt x force.
    lost = np.cumsum(np.cross(tilt, f_n) * dt, axis=0)
    measured = lost - lost[0] + 0.02 * rng.normal(size=(n, 3))
    dts = np.full(n, dt)
    dts[0] = 0.0
    steps = Steps(
        dts,
        f_n * dts[:, None],
        np.zeros((n, 3)),
        np.broadcast_to(rotation_from_vector(np.zeros(3)), (n, 3, 3)).copy(),
        measured,
    )
    out = smoothed(steps, Levels(1e-4, 0.02), np.full(3, 0.03))
    assert np.mean(out.x[:, PSI], axis=0)[:2] == pytest.approx(tilt[:2], abs=2e-3)


def test_a_climb_on_the_spot_is_no_standing_where_no_vertical_speed_is_measured():
    t = np.arange(0.0, 90.0, 0.2)
    climb = np.interp(t, [0.0, 10.0, 30.0, 60.0, 75.0, 90.0], [0.0, 0.0, 40.0, 40.0, 0.0, 0.0])
    rng = np.random.default_rng(3)
    v = np.column_stack([0.05 * rng.standard_normal((len(t), 2)), np.full(len(t), np.nan)])
    v[(t > 30.0) & (t < 60.0), 0] = 5.0
    spans = grounded_spans(t, v, 500.0 + climb + 0.05 * rng.standard_normal(len(t)))
    assert len(spans) == 2
    assert spans[0] == pytest.approx((-3.0, 13.0), abs=1.5)
    assert spans[1] == pytest.approx((72.0, 92.8), abs=1.5)


@pytest.mark.parametrize("tau", [0.05, 0.1, 0.2])
def test_a_motor_is_a_low_pass_and_no_delay(tau):
    """Gain and phase of ``1 / (1 + i w tau)`` at half a Hertz."""
    flight = copter_flight(seconds=60.0)
    omega = np.pi
    t = flight.t - flight.t[0]
    asked = np.column_stack([np.cos(omega * t), np.sin(omega * t)])
    air = Air(replace(flight, commands=asked))
    MotorLag().act(air, [tau])
    came = (air.commands[200:] * np.exp(1j * omega * t[200:, None]))[:, 0]
    answer = 2.0 * np.mean(came).conjugate()
    assert abs(answer - 1.0 / (1.0 + 1j * omega * tau)) < 0.01


def test_a_lag_acts_in_proportion_to_its_length_through_none():
    """A fit has a slope there, on both sides and the same."""
    rng = np.random.default_rng(3)
    x = np.cumsum(rng.normal(size=(100, 2)), axis=0)
    piece = np.zeros(100, dtype=np.int64)
    late, later, lead = (behind(x, lag, piece, 0.1) - x for lag in (0.001, 0.002, -0.001))
    np.testing.assert_allclose(later, 2.0 * late, atol=1e-9)
    np.testing.assert_allclose(lead, -late, atol=1e-9)
    assert np.abs(late).max() > 1e-3
    np.testing.assert_allclose(behind(x, 0.3, piece, 0.1), lagged(x, 0.3, piece, 0.1), atol=1e-9)


def test_servos_of_a_swash_plate_are_no_motors():
    """ArduPilot gives them the numbers of motors 1 to 3."""
    functions = {f"SERVO{n}_FUNCTION": 32.0 + n for n in (1, 2, 3)}
    outputs = Stream(np.arange(3.0), np.full((3, 4), 1500.0))
    assert Signals(outputs=outputs, parameters=functions).motors == (0, 1, 2)
    for frame in (6.0, 11.0, 13.0):
        heli = functions | {"FRAME_CLASS": frame}
        assert Signals(outputs=outputs, parameters=heli).motors == ()


@pytest.mark.parametrize(("frame", "rotors"), [(7.0, (0, 1, 3)), (8.0, (4, 5)), (9.0, (4, 5))])
def test_servos_that_lean_a_rotor_or_its_stream_are_no_motors(frame, rotors):
    """A tail servo has the number of motor 7, the flaps of a ducted fan those of 1 to 4."""
    channels = (0, 1, 3, 6) if frame == 7.0 else range(6)
    functions = {f"SERVO{n + 1}_FUNCTION": 33.0 + n for n in channels}
    outputs = Stream(np.arange(3.0), np.full((3, 8), 1500.0))
    built = functions | {"FRAME_CLASS": frame}
    assert Signals(outputs=outputs, parameters=built).motors == rotors
    hexa = functions | {"FRAME_CLASS": 2.0}
    assert Signals(outputs=outputs, parameters=hexa).motors == tuple(channels)
