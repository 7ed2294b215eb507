"""Flight that is made ready at once: the same as batch by batch, and where it may not be joined."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.diagnosis.stepped import jumping
from onboard.core.estimate.calibration_model import calibration_model
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.passes import Pass
from onboard.core.filter.preparations import Source, stretch
from onboard.core.inputs.stretches import continues, fixes_of, joined
from onboard.core.model.linearisation import Linearisation
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.bias_step import BiasStep
from onboard.core.physics.effects.temperature_drift import TemperatureDrift
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


def test_joined_batches_have_every_sample_and_every_fix_once(batches):
    whole = joined(batches)
    assert np.array_equal(whole.t, np.unique(np.concatenate([b.segment.t for b in batches])))
    assert np.all(np.diff(whole.t_attitude) > 0.0)
    assert np.array_equal(
        fixes_of([b.fixes for b in batches]).t,
        np.unique(np.concatenate([b.fixes.t for b in batches])),
    )


def test_what_is_made_ready_at_once_is_what_is_made_ready_batch_by_batch(batches):
    model = calibration_model(POINT, more=(TemperatureDrift(Origin(0.0)),))
    source = Source(batches[0].segment, batches[0].fixes, batches[0].trusted, None, 1)
    at_once = a_pass(model).all_ready(*stretch(source, batches[1:]))
    assert len(at_once) > 2
    for made, batch in zip(at_once, batches, strict=False):
        skipped = made.of.skipped
        own = Source(batch.segment, batch.fixes, batch.trusted, None, skipped)
        (alone,) = a_pass(model).all_ready(*stretch(own, ()))
        assert np.array_equal(made.ready.measured, alone.ready.measured)
        for name in ("duration", "turn", "moved", "columns"):
            a, b = getattr(made.ready.steps, name), getattr(alone.ready.steps, name)
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)
        for name in ("t", "velocity", "R_attitude", "body", "ned", "noise"):
            a, b = getattr(made.ready.epochs, name), getattr(alone.ready.epochs, name)
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)


def test_a_gap_another_mount_or_another_delay_ends_a_stretch(batches):
    before, batch = batches[1:3]
    assert continues(batch, before)
    segment = batch.segment
    turned = replace(segment, R_bs=segment.R_bs[[1, 0, 2]])
    delayed = replace(segment, t=segment.t - 0.004)
    silent = replace(segment, slow={})
    for other in (turned, delayed, silent):
        assert not continues(replace(batch, segment=other), before)
    assert not continues(replace(batch, fresh=True), before)
    assert not continues(batches[3], before)


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
        (plain,) = a_pass(calibration_model(POINT)).all_ready(*stretch(source, ()))
        (evaluated,) = a_pass(model).all_ready(*stretch(source, ()))
        derived = jumping(plain.ready, model, [jump], batch.segment.R_bs)
        assert np.array_equal(derived.epochs.body, evaluated.ready.epochs.body)
        ends = derived.start + np.cumsum(derived.steps.duration)
        whole = np.abs(ends - derived.steps.duration / 2.0 - moment) > derived.steps.duration
        assert (~whole).sum() == (2 if batch is during else 0)
        a, b = derived.steps.columns, evaluated.ready.steps.columns
        np.testing.assert_allclose(a[whole], b[whole], rtol=1e-9, atol=1e-12)
        # In the step in which it jumps, both have the share of it that is left.
        np.testing.assert_allclose(a[~whole], b[~whole], atol=0.05)
    assert np.abs(a[-1, 0:3, -3:]).max() > 0.1
