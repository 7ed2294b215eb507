"""Segments made ready once for several passes: the same sums, and no more memory than allowed."""

import numpy as np
import pytest

from onboard.core.estimate.calibration_model import calibration_model
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.engine import through
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.filter import preparations
from onboard.core.filter.limits import MOST_PREPARED_BYTES
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.passes import Pass
from onboard.core.filter.preparations import Preparations
from onboard.core.model.linearisation import Linearisation
from onboard.core.physics.catalogue import catalogue
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.accelerometer_hysteresis import AccelerometerHysteresis
from tests.core.estimate.test_simulated_flights import fed, flown

POINT = Linearisation(delay=0.12)
LOUDER = NoiseLevels().scaled("velocity", 2.0).scaled("bias_walk", 3.0)


@pytest.fixture(scope="module")
def batches():
    samples, _ = flown("copter", 60.0, seed=4)
    return fed(samples, Calibrator(CalibratorSettings(refine=False))).engine(1).batches


@pytest.fixture(scope="module")
def model():
    """With an effect that remembers what was before a segment."""
    return calibration_model(POINT, more=(AccelerometerHysteresis(Origin(0.0)),))


def passed(model, batches, levels, ready=None):
    prior = model.prior, np.diag(model.prior_sigma**2)
    made = Pass(model, POINT, (levels,), theta=prior[0], covariance=prior[1], preparations=ready)
    for batch in batches:
        through(made, batch, 30.0)
    return made


def assert_same_sums(one, two, tolerance):
    assert two.rows == one.rows
    scale = np.sqrt(np.maximum(np.diagonal(one.N[0]), 1e-12))
    np.testing.assert_allclose(
        two.N[0] / scale / scale[:, None], one.N[0] / scale / scale[:, None], atol=tolerance
    )
    np.testing.assert_allclose(two.b[0] / scale, one.b[0] / scale, atol=tolerance * one.rows)


def test_a_pass_with_what_another_has_made_ready_gives_the_same_sums(batches, model):
    ready = Preparations(MOST_PREPARED_BYTES)
    first = passed(model, batches, NoiseLevels(), ready)
    assert len(ready) == len(batches)
    again = passed(model, batches, NoiseLevels(), ready)
    fresh = passed(model, batches, NoiseLevels())
    assert len(ready) == len(batches)
    assert_same_sums(fresh.sums, first.sums, 1e-12)
    assert_same_sums(fresh.sums, again.sums, 1e-12)
    np.testing.assert_allclose(again.bias_b, fresh.bias_b, rtol=0.0, atol=1e-12)


def test_other_noise_and_so_another_bias_of_the_gyroscope_change_next_to_nothing(batches, model):
    ready = Preparations(MOST_PREPARED_BYTES)
    before = passed(model, batches, NoiseLevels(), ready)
    again = passed(model, batches, LOUDER, ready)
    fresh = passed(model, batches, LOUDER)
    assert np.abs(fresh.bias_b - before.bias_b).max() > 1e-6
    difference = np.linalg.solve(fresh.sums.N[0] + np.eye(model.size), again.sums.b[0])
    difference -= np.linalg.solve(fresh.sums.N[0] + np.eye(model.size), fresh.sums.b[0])
    sigma = np.sqrt(np.diagonal(np.linalg.inv(fresh.sums.N[0] + np.eye(model.size))))
    assert np.abs(difference / sigma).max() < 1e-2
    np.testing.assert_allclose(again.bias_b, fresh.bias_b, rtol=0.0, atol=1e-6)


def test_what_effects_remember_is_the_same_about_another_linearisation(batches, model, monkeypatch):
    ready = Preparations(MOST_PREPARED_BYTES)
    passed(model, batches, NoiseLevels(), ready)
    point = Linearisation(delay=0.17, window=0.2)
    monkeypatch.setattr(f"{__name__}.POINT", point)
    fresh = passed(model, batches, NoiseLevels())
    asked = []
    monkeypatch.setattr(AccelerometerHysteresis, "remembers", lambda *a: asked.append(a))
    there = ready.elsewhere()
    moved = passed(model, batches, NoiseLevels(), there)
    assert asked == []
    assert len(there) == len(batches)
    assert_same_sums(fresh.sums, moved.sums, 1e-12)


def test_what_has_no_room_is_made_anew(batches, model):
    whole = Preparations(MOST_PREPARED_BYTES)
    fresh = passed(model, batches, NoiseLevels(), whole)
    size = sum(kept.size for kept in whole._kept.values())
    most = size // 2
    half = Preparations(most)
    passed(model, batches, NoiseLevels(), half)
    again = passed(model, batches, NoiseLevels(), half)
    assert 0 < len(half) < len(whole)
    assert sum(kept.size for kept in half._kept.values()) <= most
    assert_same_sums(fresh.sums, again.sums, 1e-12)


def test_a_quarter_of_an_hour_with_every_effect_is_less_than_what_may_be_kept(batches):
    every = tuple(e for e in catalogue(Origin(0.0)) if e.unknowns)
    ready = Preparations(MOST_PREPARED_BYTES)
    passed(calibration_model(POINT, more=every), batches, NoiseLevels(), ready)
    kept = list(ready._kept.values())
    fix = sum(k.ready.size for k in kept) / sum(len(k.ready.epochs) for k in kept)
    assert 5 * 900 * fix < MOST_PREPARED_BYTES


@pytest.mark.parametrize("over_recordings", [False, True])
def test_beside_an_autopilot_nothing_is_kept(batches, model, monkeypatch, over_recordings):
    monkeypatch.setattr(preparations, "preferred", lambda: over_recordings)
    ready = Preparations()
    passed(model, batches, NoiseLevels(), ready)
    assert bool(len(ready)) is over_recordings
