"""Secrets that ArduPilot's SITL flies: drawn alike from a seed, and sealed by their answer."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.flown_sealed import AIR, OF_COPTERS, OF_PLANES, SENSORS, Secret, drawn
from onboard.answers.match import NAMES

SENSOR_NAMES = {"gps_lever_arm"}


@pytest.mark.parametrize("seed", range(40))
def test_a_seed_always_has_the_same_answer_and_another_one_another(seed):
    secret = drawn(seed)
    assert secret.seal == drawn(seed).seal
    assert secret.seal != drawn(seed + 1).seal
    assert secret.names - SENSOR_NAMES <= set(NAMES[secret.vehicle])
    # Every number to be told is of an effect that is there, or a setting.
    for key in secret.truth:
        assert key.startswith("SIM_") or key.split(".")[0] in secret.names


def test_every_effect_sets_something_of_the_simulator_and_has_something_to_be_told():
    for draw in (*OF_COPTERS, *OF_PLANES, *AIR, *SENSORS):
        secret = Secret(1, "copter")
        draw(secret, np.random.default_rng(1))
        assert secret.airframe or secret.parameters
        assert secret.names or secret.truth
