"""Noise that has tails: they neither pull the estimate nor spoil the levels."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.filter.noise import ESTIMATED, NoiseLevels
from onboard.core.filter.passes import Pass
from onboard.core.filter.whitening import Uses
from onboard.core.inputs.segments import Fixes, Segment
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import euler_from_rotation, rotation_from_euler
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.nuisances import Six
from onboard.core.model.regressors import Model

SIGMA = 0.1
FIXES = 600
USES = Uses(height=False, attitude=False, recorded_attitude=True, earth=False)


def levels(velocity):
    none = dict.fromkeys(ESTIMATED, 1e-12)
    some = {"velocity": velocity, "vertical": 1.0, "height": 1.0, "force_walk": 0.02}
    return NoiseLevels(**none | some)


def flown(noise, bank=None, beta_sigma=0.5):
    """A still accelerometer and fixes with this noise (FIXES, 3), m/s."""
    bank = bank or (levels(SIGMA),)
    t = np.arange(0.0, 0.2 * FIXES + 2.0, 0.02)
    still = np.tile([0.0, 0.0, -STANDARD_GRAVITY], (len(t), 1))
    R = np.broadcast_to(np.eye(3), (len(t), 3, 3))
    segment = Segment(t, np.zeros((len(t), 3)), still, t, R, np.eye(3))
    zero = np.zeros(FIXES)
    fixes = Fixes(0.5 + 0.2 * np.arange(FIXES), noise, zero, zero)
    made = Pass(
        Model([Six(scale_sigma=1e-9, beta_sigma=beta_sigma)]),
        Linearisation(delay=0.0),
        bank,
        uses=USES,
    )
    return made, made.process(segment, fixes, np.ones(FIXES, dtype=bool))


def offset_of(made, result):
    prior = np.diag(1.0 / made.model.prior_sigma**2)
    sums = result.block.sums
    return np.linalg.solve(sums.N + prior, sums.b + prior @ made.model.prior)[3:]


@pytest.mark.parametrize("sigmas", [4.2, 5.2])
def test_a_fix_in_the_tail_pulls_no_more_than_one_at_the_edge(sigmas):
    """Influence is bounded: the same fix twice as far out moves the offset by little more."""
    rng = np.random.default_rng(1)
    quiet = SIGMA * rng.normal(size=(FIXES, 3))
    far, edge = quiet.copy(), quiet.copy()
    far[-30, 0], edge[-30, 0] = sigmas * SIGMA, np.sqrt(11.34) * SIGMA
    without = offset_of(*flown(quiet))[0]
    moved = [abs(offset_of(*flown(noise))[0] - without) for noise in (far, edge)]
    assert moved[0] < 1.2 * moved[1]


@pytest.mark.parametrize("outliers", [4.0, 40.0], ids=["in-the-tail", "refused"])
def test_outliers_do_not_carry_the_level_away(outliers):
    """Two of a hundred fixes are far off: neither half the true level nor twice it is likelier.

    Had a refused fix no say, a smaller level would refuse more, and be likelier for it.
    """
    rng = np.random.default_rng(2)
    noise = SIGMA * rng.normal(size=(FIXES, 3))
    far = rng.random(FIXES) < 0.02
    noise[far, 0] += outliers * SIGMA
    bank = tuple(levels(SIGMA * factor) for factor in (1.0, 0.5, 2.0))
    made, result = flown(noise, bank, beta_sigma=1e-6)
    assert bool(result.refused.get("velocity", 0) > 3) == (outliers > 8.0)
    assert np.argmax(made.log_likelihoods()) == 0


FOLLOWED = replace(
    levels(SIGMA),
    tilt_walk=1e-4,
    bias_walk=1e-6,
    attitude=0.02,
    heading=0.05,
    heading_time=5.0,
    heading_walk=1e-4,
    attitude_white=2e-4,
)


def with_heading(error, bank=(FOLLOWED,)):
    """A vehicle that is shaken to and fro, so that its velocity shows its heading.

    Args:
        error: (n,) of the recorded heading at the samples, rad.
        bank: noise levels.
    """
    t = np.arange(0.0, 0.2 * FIXES + 2.0, 0.02)
    force = np.stack([np.sin(t), np.cos(1.3 * t), np.full(len(t), -STANDARD_GRAVITY)], axis=1)
    R = rotation_from_euler(0.0, 0.0, error)
    segment = Segment(t, np.zeros((len(t), 3)), force, t, R, np.eye(3))
    at, zero = 0.5 + 0.2 * np.arange(FIXES), np.zeros(FIXES)
    gained = np.stack([1.0 - np.cos(at), np.sin(1.3 * at) / 1.3, zero], axis=1)
    noise = SIGMA * np.random.default_rng(4).normal(size=(FIXES, 3))
    made = Pass(
        Model([Six(scale_sigma=1e-9, beta_sigma=1e-9)]),
        Linearisation(delay=0.0),
        bank,
        uses=Uses(height=False, earth=False),
    )
    result = made.process(
        segment, Fixes(at, gained + noise, zero, zero), np.ones(FIXES, dtype=bool)
    )
    return made, result, t


def wandering(level, seed=5):
    """(n,) errors of a heading as the model has them, rad."""
    rng, n, step = np.random.default_rng(seed), int(10.0 * FIXES + 100), 0.02
    x, u, out = level * rng.normal(), level / 5.0 * rng.normal(), []
    for drive in rng.normal(size=n):
        u += 2.0 * level * 5.0**-1.5 * np.sqrt(step) * drive - (2.0 * u / 5.0 + x / 25.0) * step
        x += u * step
        out.append(x)
    return np.array(out)


def pulled(t):
    """Set anew twice, and pulled over twice: rad, more than the model has by tens of sigma."""
    at_once = np.where((t > 30.0) & (t < 60.0), 0.3, 0.0)
    return at_once + np.clip(0.1 * (t - 80.0), 0.0, 0.25) - np.clip(0.1 * (t - 100.0), 0.0, 0.25)


def test_a_heading_that_is_set_anew_is_not_followed():
    """The filter's own attitude stays with the gyroscope, to a third of what it is pulled by."""
    t = np.arange(0.0, 0.2 * FIXES + 2.0, 0.02)
    _, result, _ = with_heading(pulled(t))
    states = np.concatenate(result.states)
    yaw = np.array([euler_from_rotation(R)[2] for R in states[:, 4:13].reshape(-1, 3, 3)])
    assert np.abs(yaw).max() < 0.1
    assert result.refused["heading"] >= 4


def test_what_a_heading_is_pulled_by_does_not_carry_its_level_away():
    t = np.arange(0.0, 0.2 * FIXES + 2.0, 0.02)
    bank = tuple(replace(FOLLOWED, heading=0.05 * by) for by in (1.0, 0.5, 2.0))
    made, _, _ = with_heading(wandering(0.05)[: len(t)] + pulled(t), bank)
    assert np.argmax(made.log_likelihoods()) == 0
