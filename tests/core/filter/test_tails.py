"""A receiver whose noise has tails: they neither pull the estimate nor spoil the levels."""

import numpy as np
import pytest

from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.passes import Pass
from onboard.core.filter.whitening import Uses
from onboard.core.inputs.segments import Fixes, Segment
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.nuisances import Six
from onboard.core.model.regressors import Model

SIGMA = 0.1
FIXES = 600
USES = Uses(height=False, attitude=False, recorded_attitude=True, earth=False)


def levels(velocity):
    return NoiseLevels(velocity, *(1e-12, 1.0, 1.0, 1e-12), 0.02, *(1e-12,) * 6)


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
