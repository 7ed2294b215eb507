"""Which of what was found the simulator can be told."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from onboard.answers.match_settings import settings_of
from tests.report.matches_by_hand import by_hand

RECORDING = SimpleNamespace(derived=True)
"""It has no accelerometer whose settings there could be."""


@pytest.mark.parametrize(("change", "handed_back"), [(0.0, True), (0.2, True), (1.5, False)])
def test_a_wind_that_becomes_another_is_no_constant_one(change, handed_back):
    vehicle = by_hand().vehicle
    vehicle = replace(vehicle, wind=replace(vehicle.wind, change=change))
    names = {s.name for s in settings_of(vehicle, (), vehicle.effects, RECORDING)}
    assert ("SIM_WIND_SPD" in names) == handed_back
    assert ("SIM_WIND_DIR" in names) == handed_back
