"""A latency can grow by no more than stamps and the receiver's own time part by."""

import numpy as np
import pytest

from onboard.core.inputs.clock_rates import most_growth
from onboard.core.inputs.limits import CRYSTAL
from onboard.core.inputs.segments import Batch, Fixes, Segment
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.clock_skew import MOST, ClockSkew

FLOWN_S = 300.0
RATE_HZ = 5.0


def flown(stamped, own):
    """Batches of a minute, which share the fix between them, as a recording is cut."""
    n, cut = len(stamped), int(60.0 * RATE_HZ)
    segment = Segment(np.zeros(2), *np.zeros((2, 2, 3)), np.zeros(2), np.eye(3)[None], np.eye(3))
    every = Fixes(stamped, np.zeros((n, 3)), *np.zeros((2, n)), own=own)
    parts = [every.between(i, min(i + cut + 1, n)) for i in range(0, n - 1, cut)]
    return [
        Batch(segment, f, np.ones(len(f), dtype=bool), fresh=not k) for k, f in enumerate(parts)
    ]


def times():
    return np.arange(0.0, FLOWN_S, 1.0 / RATE_HZ)


@pytest.mark.parametrize("crystal", [-1e-4, 0.0, 1e-4])
def test_of_a_receiver_that_is_always_as_late_it_is_what_crystals_do(crystal):
    own = 500_000.0 + times()
    wait = np.random.default_rng(1).exponential(0.01, len(own)).clip(0.0, 0.05)
    most = most_growth(flown(0.12 + (1.0 + crystal) * times() + wait, own))
    assert CRYSTAL <= most < 2.0 * CRYSTAL


@pytest.mark.parametrize("rate", [-2e-3, 4e-4, 2e-3])
def test_of_one_that_falls_behind_it_is_as_much(rate):
    most = most_growth(flown(0.12 + (1.0 + rate) * times(), times()))
    # A second of the autopilot for a second of the receiver: as good as the rate is small.
    assert most == pytest.approx(np.hypot(rate, CRYSTAL), rel=2.0 * abs(rate))


def test_a_receiver_that_begins_its_time_anew_leaves_room_for_anything():
    own = np.where(times() < 100.0, 604_700.0, -100.0) + times()
    assert most_growth(flown(times(), own)) > 1.0


def test_without_the_receivers_time_nobody_knows():
    own = times()
    own[7] = np.nan
    assert most_growth(flown(times(), own)) is None
    assert most_growth(flown(times(), np.zeros(0))) is None
    assert most_growth([]) is None


@pytest.mark.parametrize(
    ("growth", "sigma"), [(None, MOST), (2.0 * CRYSTAL, 2.0 * CRYSTAL), (1.0, MOST)]
)
def test_clocks_run_apart_no_faster_than_that(growth, sigma):
    (rate,) = ClockSkew(Origin(0.0, latency_growth=growth)).unknowns
    assert rate.prior_sigma == sigma
    assert (rate.name, rate.unit, rate.prior) == ("clock_rate", "1", 0.0)
