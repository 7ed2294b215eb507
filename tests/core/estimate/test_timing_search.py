"""Timing that moves from pass to pass: where it ends, and what a slow receiver leaves alone."""

from dataclasses import fields, replace

import numpy as np
import pytest

from benchmarks.explaining import heard
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.limits import MOST_IDLE, MOST_ROUNDS
from onboard.core.inputs.segments import Fixes
from onboard.core.model.linearisation import SHAPES
from sitl.recording import FlightSpec


@pytest.fixture(scope="module")
def engine():
    """A copter's minute, its sums made and no more."""
    return heard(FlightSpec(vehicle="copter", seed=8, duration=70.0)).engine(1)


def again(engine):
    """Another engine over the same flight, from where that one has come to."""
    made = Engine(engine.settings, engine.prior, engine.point, engine.noise)
    made.batches = list(engine.batches)
    return made


def every(fixes, step):
    """Each one of so many."""
    return Fixes(*(getattr(fixes, f.name)[::step] for f in fields(fixes)))


@pytest.mark.slow
def test_timing_that_is_asked_to_and_fro_ends_between(engine, monkeypatch):
    engine = again(engine)
    engine.tune()
    rest = engine.point
    passes = []

    def restless(self, theta, covariance, model=None):
        """To one side and to the other of where it was at rest."""
        passes.append(theta)
        return replace(rest, delay=rest.delay + 0.15 * (-1.0) ** len(passes))

    monkeypatch.setattr(Engine, "asked", restless)
    engine.tune(levels=False)
    assert abs(engine.point.delay - rest.delay) < 0.15 / 2.0
    assert len(passes) <= 5 + MOST_IDLE < MOST_ROUNDS


@pytest.mark.parametrize("apart", [0.2, 1.0, 1.4])
def test_shapes_are_followed_where_fixes_are_as_near_as_is_looked_around_them(engine, apart):
    engine = again(engine)
    step = round(apart / float(np.median(np.diff(engine.batches[0].fixes.t))))
    engine.batches = [replace(b, fixes=every(b.fixes, step)) for b in engine.batches]
    theta = engine.model.prior.copy()
    theta[[engine.model.index[name] for name in SHAPES]] = 0.3
    certain = np.diag(engine.model.prior_sigma**2)
    assert engine.asked(theta, certain).shapes == ((0.3,) * 4 if apart < 1.2 else (0.0,) * 4)
