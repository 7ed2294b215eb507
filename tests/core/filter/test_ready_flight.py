"""Flight that is gone through when it is asked for, and what of it serves for jumps."""

import numpy as np
import pytest

from onboard.core.diagnosis.stepped import Places, jumping
from onboard.core.estimate.calibration_model import calibration_model
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.passes import Pass
from onboard.core.filter.preparations import Source
from onboard.core.model.linearisation import Linearisation
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.bias_step import BiasStep
from tests.core.estimate.test_simulated_flights import fed, flown

POINT = Linearisation(delay=0.12)
BIAS = np.array([1e-3, -5e-4, 2e-3])


@pytest.fixture(scope="module")
def samples():
    return flown("copter", 60.0, seed=4)[0]


@pytest.fixture(scope="module")
def batches(samples):
    return fed(samples, Calibrator(CalibratorSettings(refine=False))).engine(1).batches


def a_pass(model):
    made = Pass(model, POINT, (NoiseLevels(),))
    made.bias_b = BIAS
    return made


def test_flight_that_is_gone_through_when_it_is_asked_for_gives_the_same(samples):
    soon, late = (
        fed(samples, Calibrator(CalibratorSettings(refine=False, at_once=at_once))).engine(1)
        for at_once in (True, False)
    )
    assert not late.blocks
    one, two = soon.solution(), late.solution()
    assert len(late.blocks) == len(soon.blocks)
    sigma = np.sqrt(np.diag(one.covariance))
    assert np.abs((two.theta - one.theta) / sigma).max() < 1e-2
    np.testing.assert_allclose(np.sqrt(np.diag(two.covariance)), sigma, rtol=1e-2)


def test_columns_of_a_jump_are_those_of_the_offset_from_its_moment_on(batches):
    before, during = batches[1:3]
    moment = float(during.fixes.t[20]) - POINT.delay + 0.03
    jump = BiasStep(Origin(0.0)).at(moment)
    model = calibration_model(POINT, more=(jump,))
    for batch in (before, during):
        source = Source(batch.segment, batch.fixes, batch.trusted, None, 0)
        places = calibration_model(POINT, more=(Places(1),))
        derived = a_pass(places).made_anew(source, batch.segment).ready
        evaluated = a_pass(model).made_anew(source, batch.segment)
        jumping(derived, [(model.slices[jump.name].start, moment)], batch.segment.R_bs)
        assert np.array_equal(derived.epochs.body, evaluated.ready.epochs.body)
        ends = derived.start + np.cumsum(derived.steps.duration)
        whole = np.abs(ends - derived.steps.duration / 2.0 - moment) > derived.steps.duration
        assert (~whole).sum() == (2 if batch is during else 0)
        a, b = derived.steps.columns, evaluated.ready.steps.columns
        np.testing.assert_allclose(a[whole], b[whole], rtol=1e-9, atol=1e-12)
        # In the step in which it jumps, both have the share of it that is left.
        np.testing.assert_allclose(a[~whole], b[~whole], atol=0.05)
    assert np.abs(a[-1, 0:3, -3:]).max() > 0.1


def test_traces_keep_nothing_alive_but_themselves(batches):
    """Of an hour's flight they are kept; a view of something larger keeps all of that."""
    made = a_pass(calibration_model(POINT))
    made.keep_traces = True
    kept = [made.process(b.segment, b.fixes, b.trusted).traces for b in batches]
    arrays = [
        array
        for traces in kept
        for array in (
            traces.t,
            traces.velocities,
            traces.innovation,
            traces.columns,
            *traces.refused_by.values(),
        )
    ]
    assert arrays
    roots = {}
    for array in arrays:
        root = array
        while isinstance(root.base, np.ndarray):
            root = root.base
        roots[id(root)] = root.nbytes
    assert sum(roots.values()) < 1.1 * sum(array.nbytes for array in arrays)
