"""The whitening filter: the paper's criterion as its special case, and white rows."""

import numpy as np
import pytest

from onboard.core.calibration_columns import Six
from onboard.core.columns import Model
from onboard.core.criterion import InitialVelocity, IntegralCriterion, Weighting
from onboard.core.frames import rotation_from_euler
from onboard.core.linearisation import Linearisation
from onboard.core.noise import NoiseLevels
from onboard.core.passes import Pass
from onboard.core.stretch import Fixes, Stretch
from onboard.core.whitening import Uses

SCALE = np.array([1.03, 0.97, 1.02])
OFFSET = np.array([0.2, -0.3, 0.15])
G = 9.80665


def flight(seed=1, seconds=40.0, noise=0.05):
    """A smooth tumbling flight at 200 Hz, GPS at 5 Hz on inertial sample times."""
    t = np.arange(0.0, seconds, 0.005)
    roll, pitch = 0.7 * np.sin(0.5 * t), 0.5 * np.sin(0.37 * t + 1.0)
    yaw = 0.3 * t
    R = rotation_from_euler(roll, pitch, yaw)
    a = np.stack([2 * np.sin(0.8 * t), 1.5 * np.cos(0.6 * t), 0.7 * np.sin(1.1 * t)], axis=-1)
    f = np.einsum("nji,nj->ni", R, a - np.array([0.0, 0.0, G]))
    v = np.stack(
        [-2.5 * np.cos(0.8 * t), 2.5 * np.sin(0.6 * t), -0.7 / 1.1 * np.cos(1.1 * t)], axis=-1
    )
    rng = np.random.default_rng(seed)
    k = np.arange(200, len(t) - 200, 40)
    return t, R, f / SCALE + OFFSET, k, v[k] + noise * rng.normal(size=(len(k), 3))


def passed(t, R, raw, k, v, levels, uses):
    # Angular rate from the attitude itself, as the paper has no gyroscope.
    w = np.zeros_like(raw)
    stretch = Stretch(t, w, raw, t, R, np.eye(3))
    fixes = Fixes(t[k], v, np.zeros(len(k)), np.zeros(len(k)))
    model = Model([Six(scale_sigma=1e5, beta_sigma=1e5)])
    made = Pass(model, Linearisation(delay=0.0), (levels,), uses=uses)
    return made, made.process(stretch, fixes, np.ones(len(k), dtype=bool))


PAPER = Uses(height=False, attitude=False, recorded_attitude=True, earth=False, gates=False)


def test_the_papers_criterion_is_the_special_case_without_process_noise():
    t, R, raw, k, v = flight()
    tiny = NoiseLevels(
        velocity=0.1,
        velocity_colour=1e-9,
        height=1.0,
        height_walk=1e-9,
        force_walk=1e-9,
        tilt_walk=1e-12,
        bias_walk=1e-12,
        attitude=1e-9,
        heading=1e-9,
    )
    made, result = passed(t, R, raw, k, v, tiny, PAPER)
    sums = result.portion.sums
    ours = np.linalg.solve(sums.N, sums.b)

    paper = IntegralCriterion(InitialVelocity.ELIMINATED, Weighting.EPOCHS)
    fixes = dict(zip(k.tolist(), v, strict=True))
    for i in range(len(t)):
        paper.specific_force(t[i], raw[i], R[i])
        if i in fixes:
            paper.velocity(t[i], fixes[i])
    theirs = paper.sums.solve()
    # The quadratures differ (Simpson here, trapezoid there); the criterion is the same.
    assert ours[:3] == pytest.approx(theirs.alpha, abs=2e-5)
    assert ours[3:] == pytest.approx(theirs.beta, abs=2e-4)
    assert ours[:3] == pytest.approx(SCALE, abs=0.02)
    del made


def test_rows_of_the_filters_own_noise_are_white_and_of_unit_variance():
    t, R, raw, k, v = flight(seed=5, seconds=200.0, noise=0.1)
    levels = NoiseLevels(velocity=0.1, velocity_colour=1e-6, force_walk=1e-6, tilt_walk=1e-9)
    made, result = passed(t, R, raw, k, v, levels, PAPER)
    sums = result.portion.sums
    theta = np.linalg.solve(sums.N, sums.b)
    # Chi-square of n - 6 degrees of freedom: five sigma either way.
    n = sums.rows - 6
    assert abs(sums.residual(theta) - n) < 5.0 * np.sqrt(2.0 * n)
    del made
