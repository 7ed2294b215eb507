"""A copter that leans into gusts as an autopilot does: motion is told, attitude follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.copter import Variant, copter_model
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.fit import fitted
from onboard.core.vehicle.signals import Signals
from tests.core.vehicle.flights import STEP, G, copter_flight, flight_with, smooth

C_M, AREA = 0.24833, 0.058108
SIGMA = np.array([0.003, 0.003, 0.01])
COPTER = Signals(kind="copter")
MEMORY_S = 2.0


def gauss_markov(rng, n, size):
    keep = np.exp(-STEP / MEMORY_S)
    x = np.empty(n)
    x[0] = rng.normal()
    for k in range(1, n):
        x[k] = keep * x[k - 1] + np.sqrt(1.0 - keep**2) * rng.normal()
    return size * x


def leaning_flight(seed, seconds=160.0, gust=0.8):
    """Drag of the nominal frame, a velocity that no gust moves, and a tilt that holds it.

    ``gust`` is the RMS of a horizontal component, m/s; there is a third of it upwards.
    """
    rng = np.random.default_rng(seed)
    n = int(seconds / STEP)
    t = STEP * np.arange(n)
    v_n = np.stack([smooth(rng, n, s, 4.0) for s in (4.0, 4.0, 1.0)], axis=1)
    gusts = np.stack([gauss_markov(rng, n, size * gust) for size in (1.0, 1.0, 0.3)], axis=1)
    u_n = v_n - np.array([2.0, -1.5, 0.0]) - gusts
    height = 600.0 + smooth(rng, n, 5.0, 6.0)
    rho = 1.225 * (1 - 0.0065 * height / 288.15) ** 4.2559
    f_n = np.gradient(v_n, STEP, axis=0) - np.array([0.0, 0.0, G])
    yaw = smooth(rng, n, 1.0, 6.0)
    ahead = np.stack([np.cos(yaw), np.sin(yaw), np.zeros(n)], axis=1)
    drag_n = np.zeros((n, 3))
    for _ in range(8):  # drag follows the attitude, and the attitude the drag
        pull = f_n - drag_n
        thrust = np.linalg.norm(pull, axis=1)
        z = -pull / thrust[:, None]
        y = np.cross(z, ahead)
        y /= np.linalg.norm(y, axis=1)[:, None]
        R = np.stack([np.cross(y, z), y, z], axis=-1)
        u = np.einsum("nji,nj->ni", R, u_n)
        linear = C_M * np.sqrt(rho / 1.225 * thrust / G)
        drag = -linear[:, None] * u - 0.5 * (rho * AREA)[:, None] * np.abs(u) * u
        drag_n = np.einsum("nij,nj->ni", R, drag)
    f_b = np.einsum("nji,nj->ni", R, f_n)
    commands = commanded(thrust, rho, u[:, 2])
    f_b = f_b + 0.01 * rng.normal(size=(n, 3))
    return flight_with(t, R, v_n, height, f_b, commands=commands)


def commanded(thrust, rho, sinking):
    """Commands of the nominal frame that give this thrust."""
    ratio = rho / (1.225 * (1 - 0.0065 * 593.0 / 288.15) ** 4.2559)
    outflow = 2 * 29.3 * 12.09 / (3.0 * G)
    power = (thrust / ratio + G / outflow**2 * np.maximum(-sinking, 0.0) ** 2) * 0.39 / G
    command = (-0.35 + np.sqrt(0.35**2 + 4 * 0.65 * power)) / (2 * 0.65)
    return np.stack([command, command**2, np.ones_like(command)], axis=1)


def test_without_its_tilt_a_flight_keeps_path_and_heading():
    flight = copter_flight(seconds=30.0)
    level = flight.levelled()
    R = level.R_bn
    assert np.allclose(R @ np.swapaxes(R, -1, -2), np.eye(3))
    assert np.allclose(np.einsum("nji,nj->ni", R, level.v_b), flight.v_n)
    assert np.allclose(R[:, 2], [0.0, 0.0, 1.0])
    # The nose points the same way over ground.
    across = R[:, 0, 0] * flight.R_bn[:, 0, 1] - R[:, 0, 1] * flight.R_bn[:, 0, 0]
    assert np.allclose(across, 0.0)


SPEED = 6.0
SLOPE = C_M + 1.2 * SPEED * AREA
"""Of the lateral drag at this speed, 1/s: known better than either of its parts."""


def slope(fit):
    linear = fit.theta[fit.model.indices("rotor_drag")[0]]
    return linear + 1.2 * SPEED * np.mean(fit.theta[fit.model.indices("body_drag")])


@pytest.mark.slow
def test_a_tilt_that_answers_gusts_takes_nothing_off_the_drag():
    told, plain = [], []
    for seed in range(8):
        gusty = Variant(gusts=0.8)
        model = copter_model(leaning_flight(seed), CopterAirframe(), SIGMA, gusty)
        assert model.instrumented == (0, 1, 2)
        told.append(slope(fitted(model)))
        plain.append(slope(fitted(replace(model, instrumented=()))))
    error = np.std(told, ddof=1) / np.sqrt(len(told))
    assert error < 0.1 * SLOPE
    assert abs(np.mean(told) - SLOPE) < 3.0 * error
    # Least squares takes the answer for the cause.
    assert np.mean(plain) < 0.8 * SLOPE
    assert abs(np.mean(told) - SLOPE) < 0.5 * abs(np.mean(plain) - SLOPE)


@pytest.mark.slow
@pytest.mark.parametrize("gust", [0.1, 0.8])
def test_gusts_have_their_size_and_are_answered_whether_they_are_named_or_not(gust):
    """Answers to gusts too small to be told from errors of the velocity bend the thrust as much."""
    sizes = []
    for seed in range(3, 5):
        match = match_copter(leaning_flight(seed, gust=gust), COPTER, CopterAirframe(), SIGMA)
        named = {d.name for d in match.effects}
        assert named == ({"wind"} if gust < 0.15 else {"wind", "turbulence"})
        assert "faster_gusts" in match.numbers
        if match.wind is not None and match.wind.turbulence_rms is not None:
            sizes.append(match.wind.turbulence_rms)
    if sizes:
        # Flights of 80 gusts along two axes.
        assert abs(np.mean(sizes) / gust - 1.0) < 4.0 / np.sqrt(2 * 2 * 80 * len(sizes)) + 0.05


def test_gusts_of_a_size_do_what_the_best_straight_line_through_the_drag_does():
    flight = copter_flight(still=True, seconds=20.0)
    model = copter_model(flight, CopterAirframe(), SIGMA)
    theta = model.nominal
    rotor, body = model.indices("rotor_drag"), model.indices("body_drag")
    linear = theta.copy()
    linear[body] = 0.0
    ahead = model.sensitivity_to(linear, 0.7)[:, 0]
    assert np.allclose(ahead, model.sensitivity(linear)[:, 0], rtol=1e-6)
    square = theta.copy()
    square[rotor] = 0.0
    # E f(g) g / s^2 of f = k |g| g is k s sqrt(8 / pi): of three points sqrt(3) instead.
    k = 0.5 * flight.rho * theta[body[0]]
    told = model.sensitivity_to(square, 0.7)[:, 0] / (k * 0.7)
    assert np.allclose(told, np.sqrt(8.0 / np.pi), rtol=0.1)
    assert np.all(model.sensitivity(square)[:, 0] < 0.3 * told * k * 0.7)
