"""An accelerometer that lags behind its load: the loop, its memory, and a flight that conceals it.

The concealed effect has one width, and moves from turning point to turning point of the true load;
the regressors have three, and follow what was read, sample by sample.  They share the law and
nothing else.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.concealing import Secret
from benchmarks.explaining import heard
from onboard.core.diagnosis.procedure import diagnose
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.result import Status
from onboard.core.inputs.segments import Segment
from onboard.core.model.regressors import Model
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.accelerometer_hysteresis import (
    PLAYS,
    AccelerometerHysteresis,
    _branches,
)
from onboard.core.physics.effects.throttle_coupling import ThrottleCoupling
from onboard.core.physics.octaves import WEIGHTS
from sitl.builtin.effects.accelerometer_hysteresis import AccelerometerHysteresis as Concealed

ORIGIN = Origin(t0=0.0)
SHARED = np.array([[0.05, 0.15, 0.1], [0.1, -0.25, -0.05], [-0.1, 0.2, 0.3]])
"""Weights of the plays (axis, play), of either sign."""
ALONE = [0.3 * np.outer([1.0, -0.6, 1.2], play) for play in np.eye(len(PLAYS))]
"""One play on all axes: the loops whose widths the effect has among its own."""


def load(seconds=40.0, rate=100.0, seed=5):
    """A load of three axes that goes up and down by several m/s^2, and stands still at times."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-6.0, 6.0, (3, int(seconds) + 1))
    corners[:, 10:14] = corners[:, 10:11]
    f_b = np.column_stack([np.interp(t, np.arange(corners.shape[1]), c) for c in corners])
    return t, f_b


def segment(t, f_b):
    still = np.zeros((len(t), 3))
    return Segment(t, still, f_b, t[:2], np.stack([np.eye(3)] * 2), np.eye(3))


def read(f_b, weights):
    """What a sensor reads that conceals a loop of each width at once."""
    scene = SimpleNamespace(f_b=f_b)
    loops = [
        Concealed(x=x, y=y, z=z, width=2.0 * play).reads_too_much(scene)
        for play, (x, y, z) in zip(PLAYS, weights.T.tolist(), strict=True)
    ]
    return f_b + np.sum(loops, axis=0)


def unknowns_of(weights):
    """Sizes and shapes (9,) that stand for weights (axis, play)."""
    return np.linalg.solve(WEIGHTS.T, weights.T).ravel()


def taken_off(effect, made, t, weights):
    """By the regressors: what is added to the reading for the true load, (n, 3)."""
    nodes = SimpleNamespace(t=t, slow=lambda name: made.slow_at(name, t))
    return effect.acceleration(nodes) @ unknowns_of(weights)


def test_sizes_are_the_whole_of_the_loop_and_shapes_none_of_it():
    assert WEIGHTS.sum(axis=1) == pytest.approx([1.0, 0.0, 0.0])
    assert unknowns_of(SHARED)[:3] == pytest.approx(SHARED.sum(axis=1))
    effect = AccelerometerHysteresis(ORIGIN)
    assert effect.keys == ("x", "y", "z")
    assert len(effect.unknowns) == WEIGHTS.size


@pytest.mark.parametrize("weights", [SHARED, *ALONE])
def test_about_its_size_the_regressors_give_the_true_load_back(weights):
    t, f_b = load()
    reading = read(f_b, weights)
    effect = AccelerometerHysteresis(ORIGIN).about(unknowns_of(weights))
    made = Model([effect]).remembering(segment(t, reading), {})
    assert reading + taken_off(effect, made, t, weights) == pytest.approx(f_b, abs=1e-9)


@pytest.mark.parametrize("weights", [SHARED, *ALONE])
def test_without_its_size_they_are_right_to_first_order(weights):
    t, f_b = load()
    reading = read(f_b, weights)
    effect = AccelerometerHysteresis(ORIGIN)
    made = Model([effect]).remembering(segment(t, reading), {})
    left = reading + taken_off(effect, made, t, weights) - f_b
    taken_back = np.max(np.sum(np.abs(weights) / PLAYS, axis=1))
    assert np.sqrt(np.mean(left**2)) < taken_back * np.sqrt(np.mean((reading - f_b) ** 2))


def test_an_offset_that_comes_and_goes_moves_no_follower():
    """What the throttle makes of the reading comes after the load has been felt."""
    t, f_b = load()
    throttle = np.interp(t, t[::300], np.random.default_rng(7).uniform(0.0, 1.0, len(t[::300])))
    size = np.array([1.5, -1.2, 0.8])
    told = {"throttle": (t, throttle)}
    reading = read(f_b, SHARED) + throttle[:, None] * size
    beside = ((ThrottleCoupling(ORIGIN), size),)

    def off(effect):
        made = Model([effect]).remembering(segment(t, reading).with_slow(told), {})
        left = reading - throttle[:, None] * size + taken_off(effect, made, t, SHARED) - f_b
        return np.sqrt(np.mean(left**2))

    effect = AccelerometerHysteresis(ORIGIN)
    assert off(effect.about(unknowns_of(SHARED), beside)) < 1e-6
    assert off(effect.about(unknowns_of(SHARED))) > 0.02, "alone they ride on it"


def test_a_loop_that_has_no_inverse_is_taken_off_in_part():
    t, f_b = load()
    effect = AccelerometerHysteresis(ORIGIN).about(unknowns_of(5.0 * ALONE[0]))
    made = Model([effect]).remembering(segment(t, f_b), {})
    assert np.max(np.abs(made.slow_at(effect.name, t))) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("weights", ALONE)
def test_noise_of_the_reading_does_not_make_the_loop_look_higher(weights):
    t, f_b = load(seconds=200.0)
    noise = np.random.default_rng(6).normal(0.0, 0.06, f_b.shape)
    effect = AccelerometerHysteresis(ORIGIN).about(unknowns_of(weights))
    made = Model([effect]).remembering(segment(t, read(f_b, weights) + noise), {})
    found, true = -taken_off(effect, made, t, weights), read(f_b, weights) - f_b
    higher = np.sum(found * true, axis=0) / np.sum(found**2, axis=0)
    assert higher == pytest.approx(1.0, abs=0.04)


def test_the_memory_goes_on_from_segment_to_segment_and_ends_at_a_gap():
    t, f_b = load()
    # On a plateau the load alone does not say on which branch it is.
    cut, overlap = int(np.searchsorted(t, 12.0)), 20
    effect = AccelerometerHysteresis(ORIGIN)
    model = Model([effect])
    whole = model.remembering(segment(t, f_b), {})
    first = model.remembering(segment(t[:cut], f_b[:cut]), {})
    rest = segment(t[cut - overlap :], f_b[cut - overlap :])
    goes_on = model.remembering(rest, first.slow)
    at = rest.t[::7]
    np.testing.assert_allclose(
        goes_on.slow_at(effect.name, at), whole.slow_at(effect.name, at), atol=1e-9
    )
    anew = model.remembering(rest, {})
    assert np.max(np.abs(anew.slow_at(effect.name, at) - whole.slow_at(effect.name, at))) > 0.5


def test_a_model_without_memory_leaves_the_segment_as_it_is():
    t, f_b = load(seconds=12.0)
    plain = segment(t, f_b)
    assert Model([]).remembering(plain, {}) is plain


@pytest.mark.slow
@pytest.mark.parametrize(("vehicle", "width"), [("copter", 1.0), ("plane", 4.0)])
def test_flights_that_conceal_it_are_explained_however_wide_it_is(vehicle, width):
    """Of right sigmas one number in 29 is further off; 3 sigma of the mean of two such flights."""
    concealed = Concealed(x=0.2, y=0.16, z=0.2, width=width)
    spec = replace(Secret(601, vehicle, "control").spec(), effects=(concealed,))
    said = diagnose(heard(spec), 1)
    assert [e.name for e in said.effects] == ["accelerometer_hysteresis"]
    assert said.mismatch.held_out_after < said.mismatch.held_out_before
    for key in "xyz":
        true, found = getattr(concealed, key), said.effects[0].unknowns[key]
        assert abs(found.value - true) < max(0.1 * abs(true), 3.0 / np.sqrt(2.0) * found.sigma), key


@pytest.mark.slow
def test_a_loop_that_would_give_energy_is_none_and_the_flight_is_not_explained():
    backwards = Concealed(x=-0.2, y=-0.2, z=-0.2, width=2.0)
    spec = replace(Secret(601, "plane", "control").spec(), effects=(backwards,))
    said = diagnose(heard(spec), 1)
    assert "accelerometer_hysteresis" not in [e.name for e in said.effects]
    assert said.verdict in (Verdict.PARTLY_EXPLAINED, Verdict.UNEXPLAINED)
    assert said.calibration.status is not Status.CALIBRATED
    assert "the other way round" in said.note


@pytest.mark.parametrize("count", [1, 2, 3, 500, 513])
def test_followers_of_a_known_load_are_the_limit_of_those_of_a_reading(count):
    rng = np.random.default_rng(count)
    reading = np.cumsum(rng.normal(0.0, 0.4, count))
    start = rng.uniform(-1.0, 1.0) * np.minimum(1.0, 0.3 / np.array(PLAYS))
    alone = _branches(reading, start, np.zeros(len(PLAYS)))
    almost = _branches(reading, start, np.full(len(PLAYS), 1e-12))
    np.testing.assert_allclose(alone, almost, rtol=0.0, atol=1e-9)
