"""Where a search for noise and timing begins: where a flight is likeliest without any effect."""

import pytest

from benchmarks.explaining import heard
from onboard.core.diagnosis import examination
from onboard.core.diagnosis.procedure import examine
from onboard.core.estimate.engine import Engine
from onboard.core.model.linearisation import Linearisation
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec


@pytest.fixture(scope="module")
def begun():
    """Linearisation and model at which each search of a diagnosis began and ended."""
    seen = []
    tune = Engine.tune

    def watched(engine, **more):
        before = engine.point
        tune(engine, **more)
        if isinstance(engine, examination.Examination):
            seen.append((engine.model.size, before, engine.point))

    spec = FlightSpec(vehicle="copter", seed=5, duration=80.0, imus=random_imus(5))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Engine, "tune", watched)
        examine(heard(spec), 1)
    return seen


@pytest.mark.slow
def test_effects_are_added_where_the_flight_is_likeliest_without(begun):
    (few, blind, plain), (many, start, _), *_ = begun
    assert few < many
    assert blind.delay == Linearisation().delay
    assert start.moving == plain.moving
    assert start.scale == plain.scale
    assert start.antenna == plain.antenna
