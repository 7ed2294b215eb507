"""What a flight wants further off than anything can be, and what is no such thing."""

import math

import numpy as np
import pytest

from onboard.core.estimate.calibration_model import beyond_range, calibration_model, least_square
from onboard.core.model.linearisation import Linearisation
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.accelerometer_hysteresis import AccelerometerHysteresis
from onboard.core.physics.effects.gps_overshoot import GpsOvershoot

SIGMA = 1e-3
AT_50_HZ = 0.02


def asked_for(square, *more, step=AT_50_HZ):
    """What is said of a flight that asks for a span of this square, s^2, to one in a thousand."""
    point = Linearisation()
    model = calibration_model(point, more=more)
    theta, covariance = np.zeros(model.size), SIGMA**2 * np.eye(model.size)
    theta[model.index["window_squared"]] = square
    return beyond_range(point, model, theta, covariance, step=step)


@pytest.mark.parametrize("sigmas", [2.9, -2.9])
def test_a_span_of_which_nobody_can_say_that_it_is_none_is_one(sigmas):
    assert asked_for(sigmas * SIGMA) == []


def test_a_receiver_whose_variance_is_surely_negative_is_none_that_averages():
    assert asked_for(least_square(AT_50_HZ) - 3.1 * SIGMA) == [
        "the receiver's averaging would have to be further off than can be told"
    ]


def test_beside_what_overshoots_it_may_be():
    assert asked_for(-0.2, GpsOvershoot(Origin(t0=0.0))) == []


def test_samples_that_are_means_are_no_receiver_that_overshoots():
    """Of a velocity that bends, its mean over the step has that much more."""
    bend, t = 2.0, np.linspace(-0.5, 0.5, 10001)
    for step in (0.1, AT_50_HZ):
        mean = np.mean(0.5 * bend * (step * t) ** 2)
        assert -least_square(step) * bend / 24.0 == pytest.approx(mean, rel=1e-3)


@pytest.mark.parametrize("kind", [AccelerometerHysteresis, GpsOvershoot])
@pytest.mark.parametrize(("sigmas", "said"), [(-2.9, False), (-3.1, True), (9.0, False)])
def test_no_size_is_surely_of_the_sign_that_nature_does_not_allow(kind, sigmas, said):
    point, effect = Linearisation(), kind(Origin(t0=0.0))
    model = calibration_model(point, more=(effect,))
    sizes, shapes = effect.unknowns[: len(effect.keys)], effect.unknowns[len(effect.keys) :]
    for unknown in sizes:
        theta, covariance = np.zeros(model.size), SIGMA**2 * np.eye(model.size)
        theta[model.index[unknown.name]] = sigmas * SIGMA
        theta[[model.index[u.name] for u in shapes]] = -9.0 * SIGMA
        words = f"{kind.effect} would have to be the other way round than it can be"
        found = beyond_range(point, model, theta, covariance, step=AT_50_HZ)
        assert found == [words] * said


def test_sums_of_earlier_flights_do_not_say_how_often_they_were_sampled():
    assert asked_for(-10.0, step=math.inf) == []


@pytest.mark.parametrize("hertz", [5.0, 20.0])
def test_the_low_pass_of_an_accelerometer_is_a_delay_and_no_variance(hertz):
    """ArduPilot's, biquad by bilinear transform (LowPassFilter2p), at 1 kHz."""
    ohm = math.tan(math.pi * hertz / 1000.0)
    c = 1.0 + 2.0 * math.cos(math.pi / 4.0) * ohm + ohm**2
    b, a1, a2 = ohm**2 / c, 2.0 * (ohm**2 - 1.0) / c, (1.0 - 2.0 * 0.5**0.5 * ohm + ohm**2) / c
    y, x = [0.0, 0.0], np.zeros(4000)
    x[2] = 1.0
    for n in range(2, len(x)):
        y.append(b * (x[n] + 2.0 * x[n - 1] + x[n - 2]) - a1 * y[-1] - a2 * y[-2])
    h, t = np.array(y), (np.arange(len(x)) - 2.0) / 1000.0
    delay = h @ t
    assert h.sum() == pytest.approx(1.0)
    assert delay == pytest.approx(2.0**0.5 / (2.0 * math.pi * hertz), rel=0.01)
    assert abs(h @ (t - delay) ** 2) < 1e-3 * delay**2
