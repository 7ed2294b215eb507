from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.answer_errors import answered_by_commands
from onboard.core.vehicle.copter import copter_model
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.fit import fitted
from onboard.core.vehicle.limits import WINDOW_STEPS
from onboard.core.vehicle.signals import Signals
from tests.core.vehicle.flights import copter_flight, smooth

SIGMA = np.array([0.003, 0.003, 0.01])
EXPO = 0.65


def undone(flight, gone):
    """The flight whose thrust by one command is ``exp(-gone)`` (n,) of itself, and commanded back.

    Its force is what it was: that is what an autopilot holds.
    """
    c = flight.commands[:, 0]
    power = ((1.0 - EXPO) * c + EXPO * c * c) * np.exp(gone)
    now = (np.sqrt((1.0 - EXPO) ** 2 + 4.0 * EXPO * power) - (1.0 - EXPO)) / (2.0 * EXPO)
    commands = np.stack([now, now**2, flight.commands[:, 2]], axis=1)
    return replace(flight, commands=commands)


def disturbed(seed, share=0.06, ratio=1.0):
    flight = copter_flight(seed=seed, wind=(3.0, 1.0), ratio=ratio)
    gone = smooth(np.random.default_rng(seed), len(flight), share, 2.0)
    return undone(flight, gone)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "ratio"), [(3, 1.0), (5, 0.7)])
def test_commands_that_undo_a_disturbance_are_no_weaker_rotors(seed, ratio):
    flight = disturbed(seed, ratio=ratio)
    match = match_copter(flight, Signals(kind="copter"), CopterAirframe(), SIGMA)
    for key, truth in (("thrust_scale.ratio", ratio), ("thrust_curve.expo", EXPO)):
        its = match.numbers[key]
        assert abs(its.real - truth) < 3.0 * its.sigma
    if ratio == 1.0:
        assert not {"thrust_scale", "thrust_curve"} & {d.name for d in match.effects}


@pytest.mark.parametrize("seed", [3, 4, 6])
def test_the_truth_is_between_force_over_command_and_command_over_force(seed):
    flight = copter_flight(seed=seed, wind=(3.0, 1.0))
    rng = np.random.default_rng(seed)
    gone = np.repeat(rng.normal(0.0, 0.02, len(flight) // WINDOW_STEPS), WINDOW_STEPS)
    fit = fitted(copter_model(undone(flight, gone), CopterAirframe(), SIGMA))
    k = fit.model.index("expo")
    most = np.linalg.solve(fit.information, answered_by_commands(fit).score)[k]
    assert fit.theta[k] + 2.0 * fit.sigma[k] < EXPO < fit.theta[k] + most


def test_commands_that_nothing_disturbs_are_believed():
    model = copter_model(copter_flight(seed=3), CopterAirframe(), SIGMA)
    fit = fitted(model)
    k = model.index("expo")
    doubted = replace(fit, answered=answered_by_commands(fit))
    assert doubted.sigma[k] < 1.2 * fit.sigma[k]
