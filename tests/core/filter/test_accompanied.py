"""Columns that go through a pass beside its own take no part in it, and come out as if they did."""

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.going_through import through
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.filter.accompanied import NO_PART, AccompaniedPass
from onboard.core.filter.noise import USUAL
from onboard.core.filter.passes import Pass
from onboard.core.maths.blocks import total
from onboard.core.model.regressors import Family, Model, Unknown
from tests.core.estimate.test_simulated_flights import fed, flown

pytestmark = pytest.mark.slow


class Swinging(Family):
    """A force along x that nobody has felt."""

    name = "swinging"
    unknowns = (Unknown("swing", "m/s^2", 0.0, NO_PART),)

    def acceleration(self, nodes):
        out = np.zeros((*nodes.t.shape, 3, 1))
        out[..., 0, 0] = np.sin(nodes.t)
        return out


@pytest.fixture(scope="module")
def engine():
    samples, _ = flown("copter", 75.0, seed=3)
    return fed(samples, Calibrator(CalibratorSettings(refine=False))).engine(1)


@pytest.fixture(scope="module")
def wide(engine):
    return Model((*engine.model.families, Swinging()))


def gone(engine, made):
    """Sums of all blocks, once gates know what the flight says."""
    found = engine.solution()
    theta, covariance = made.model.taken_over(engine.model, found.theta, found.covariance)
    own = getattr(made, "own", made.model.size)
    made.hold(theta[:own], covariance[:own, :own])
    made.keep_traces = True
    results = [through(made, batch, 10.0) for batch in engine.batches]
    return total([r.block for r in results]), results


def test_all_else_is_as_without_them(engine, wide):
    plain, expected = gone(engine, Pass(engine.model, engine.point, (USUAL,)))
    made = AccompaniedPass(engine.model, wide, engine.point, USUAL)
    sums, results = gone(engine, made)
    for name in ("N", "b", "G"):
        there = getattr(plain, name)
        np.testing.assert_allclose(
            getattr(sums, name), there, rtol=1e-9, atol=1e-9 * np.abs(there).max()
        )
    assert (sums.rows, sums.s) == (plain.rows, pytest.approx(plain.s, rel=1e-9))
    for ours, theirs in zip(results, expected, strict=True):
        assert ours.refused == theirs.refused
        np.testing.assert_allclose(ours.traces.columns, theirs.traces.columns, rtol=1e-5)


def test_they_come_out_as_columns_of_the_model_do(engine, wide):
    made, whole = (
        AccompaniedPass(engine.model, wide, engine.point, USUAL),
        Pass(wide, engine.point, (USUAL,)),
    )
    gone(engine, made)
    expected, _ = gone(engine, whole)
    sums, m = made.sums.member(0), engine.model.size
    assert sums.N[m, m] > 1.0
    np.testing.assert_allclose(sums.N[m], expected.N[m], rtol=1e-6, atol=1e-6 * sums.N[m, m])
    assert sums.b[m] == pytest.approx(expected.b[m], rel=1e-6)
