"""Gusts within a step pull a wing ahead: that is no smaller drag."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.effects.gust_lift import GustLift
from onboard.core.vehicle.flight import flight_of
from onboard.core.vehicle.plane import plane_model
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.core.vehicle.signals import Signals, Stream
from onboard.core.vehicle.trajectory import Motion
from tests.core.vehicle.flights import plane_flight
from tests.core.vehicle.planes import SIGMA, matched, names

pytestmark = pytest.mark.slow

FRAME = PlaneAirframe()


def force(alpha, pressure):
    """Ahead and down, by the file's coefficients."""
    lift = FRAME.c_lift_0 + FRAME.c_lift_a * alpha
    drag = FRAME.c_drag_p + FRAME.induced * lift**2
    ahead = lift * np.sin(alpha) - drag * np.cos(alpha)
    down = -lift * np.cos(alpha) - drag * np.sin(alpha)
    return pressure * ahead, pressure * down


def shaken(flight, gusts, samples=16):
    """The flight with means of the force in gusts up and down, so fast that each step has many."""
    speed = np.linalg.norm(flight.v_b, axis=1)
    alpha = np.arctan2(flight.v_b[:, 2], flight.v_b[:, 0])
    pressure = FRAME.pressure(flight.rho, speed)
    # A step's mean is over as many angles to either side, so that it has no gust of its own.
    half = np.abs(np.random.default_rng(1).normal(0.0, gusts, (len(flight), samples)))
    off = np.concatenate([half, -half], axis=1) / speed[:, None]
    each = force(alpha[:, None] + off, pressure[:, None])
    still = force(alpha, pressure)
    f_b = flight.f_b.copy()
    f_b[:, 0] += each[0].mean(axis=1) - still[0]
    f_b[:, 2] += each[1].mean(axis=1) - still[1]
    return replace(flight, f_b=f_b, shaken=np.var(each[1], axis=1))


def test_the_mean_force_is_that_over_the_angles():
    flight = shaken(plane_flight(seed=3, seconds=240.0, noise=0.0), 1.5)
    model = plane_model(flight, FRAME, SIGMA)
    theta = model.nominal
    theta[model.index("gust_lift")] = 1.0
    left = (flight.f_b - model.predicted(theta)[:, :3])[:, [0, 2]]
    without = theta.copy()
    without[model.index("gust_lift")] = 0.0
    before = (flight.f_b - model.predicted(without)[:, :3])[:, [0, 2]]
    # Of 1.4 m/s^2 ahead no more than the fourth order is left.
    assert np.mean(before[:, 0]) == pytest.approx(1.4, rel=0.3)
    assert np.all(np.abs(np.mean(left, axis=0)) < 0.04 * np.mean(before[:, 0]))


def test_less_drag_in_fast_gusts_is_no_smaller_drag():
    flight = shaken(plane_flight(seed=4, seconds=240.0, reading=1.0), 2.0)
    told = matched(flight)
    assert not {"drag", "thrust_scale"} & names(told)
    drag = told.numbers["drag.c_drag_p"]
    assert abs(drag.real - 0.1) < 2.0 * drag.sigma
    # Nor is it a rule that nothing is: without what shakes it the same force is another drag.
    blind = matched(replace(flight, shaken=np.zeros(len(flight))))
    assert blind.numbers["drag.c_drag_p"].real < 0.085


def test_vibration_that_is_no_gust_takes_no_drag_away():
    flight = plane_flight(seed=5, seconds=240.0, reading=1.0)
    rough = replace(flight, shaken=np.full(len(flight), 3.0**2))
    drags = [matched(f).numbers["drag.c_drag_p"] for f in (flight, rough)]
    assert abs(drags[0].real - drags[1].real) < drags[0].sigma
    assert names(matched(rough)) == set()


def test_drag_that_is_another_is_told_in_fast_gusts():
    flight = shaken(plane_flight(seed=6, seconds=240.0, reading=1.0, c_drag_p=0.16), 1.0)
    told = matched(flight)
    assert "drag" in names(told)
    drag = told.numbers["drag.c_drag_p"]
    assert abs(drag.real - 0.16) < 3.0 * drag.sigma


def test_a_flight_keeps_how_much_its_samples_scatter_in_a_step():
    t = np.arange(0.0, 20.0, 0.02)
    n = len(t)
    f_b = np.tile([0.0, 0.0, -9.8], (n, 1))
    f_b[:, 2] += 3.0 * (-1.0) ** np.arange(n) + t
    motion = Motion(
        t,
        f_b,
        np.zeros((n, 3)),
        np.tile(np.eye(3), (n, 1, 1)),
        np.tile([20.0, 0.0, 0.0], (n, 1)),
        np.full(n, 650.0),
        0.05,
        np.full(3, 1e-3),
    )
    flight = flight_of([motion], Signals(kind="plane"), Stream(), [], 580.0)
    # Up and down in turn, of four to six samples; and hardly anything by what goes on over steps.
    assert flight.shaken == pytest.approx(np.full(len(flight), 9.0), rel=0.06)
    early = flight.t < 10.0
    assert flight.cut(early).shaken == pytest.approx(flight.shaken[early])


def test_without_samples_within_the_steps_nothing_is_asked():
    model = plane_model(plane_flight(seed=7), FRAME, SIGMA)
    assert not any(isinstance(e, GustLift) for e in model.effects)
