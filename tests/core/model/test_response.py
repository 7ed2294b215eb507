"""A receiver's response changes as it says it does, and is found where an even mean is not."""

import numpy as np
import pytest

from onboard.core.model.linearisation import SHAPES
from onboard.core.model.response import Response
from onboard.core.model.smoothing import SPREAD, Gained, averaged

REACH = 0.62
STEP = 0.02
APART = 0.2
T = 3.0 + APART * np.arange(120)


def velocity(t, top, seed=3):
    """A velocity of sines up to ``top`` Hz, as gusts shake a plane, and its acceleration."""
    rng = np.random.default_rng(seed)
    f, phase = 2.0 * np.pi * rng.uniform(0.1, top, 60), rng.uniform(0.0, 6.28, (60, 3))
    size = rng.uniform(0.5, 1.0, (60, 3)) / np.hypot(1.0, f[:, None] / 6.28)
    angle = f[:, None] * t[:, None, None] + phase
    return (size * np.sin(angle)).sum(axis=1), (f[:, None] * size * np.cos(angle)).sum(axis=1)


def sampled(top, seed=3, step=STEP):
    """What is gained by samples of the acceleration."""
    return Gained(0.0, step, velocity(np.arange(0.0, T[-1] + 3.0, step), top, seed)[1])


@pytest.fixture(scope="module")
def gained():
    return sampled(2.5, step=0.004)


def response(gained, window, shares, t=T):
    return Response(gained, t, window, np.array(shares), REACH)


def value(gained, window, shares, t=T):
    """What a receiver reports of the velocity gained."""
    more = response(gained, window, shares, t).shaped
    return gained.velocity(t) + gained.seen(t, [averaged(window, gained.step)])[0] + more


MIXED = (0.4, 0.2, -0.3, 0.25)


@pytest.mark.parametrize("window", [0.2, 0.3, 0.6])
@pytest.mark.parametrize("shares", [(0.0,) * 4, (1.0, 0.0, 0.0, 0.0), MIXED])
def test_its_force_is_what_it_changes_by_with_time(gained, window, shares):
    h = 0.02
    change = value(gained, window, shares, T + h) - value(gained, window, shares, T - h)
    force = response(gained, window, shares).force
    # An acceleration of 2.5 Hz bends by 1.6 % over h, and that of the even mean is the mean's.
    assert force == pytest.approx(change / (2.0 * h), abs=0.03 * np.abs(force).max())


@pytest.mark.parametrize("window", [0.2, 0.3, 0.6])
@pytest.mark.parametrize("shares", [(0.0,) * 4, (1.0, 0.0, 0.0, 0.0), MIXED])
def test_its_slope_is_what_it_changes_by_with_the_square_of_the_span(gained, window, shares):
    wide, narrow = np.sqrt(window**2 + 1e-3), np.sqrt(window**2 - 1e-3)
    change = (value(gained, wide, shares) - value(gained, narrow, shares)) / 2e-3
    slope = response(gained, window, shares).slope
    assert slope == pytest.approx(change, abs=0.02 * np.abs(slope).max())


@pytest.mark.parametrize("newer", [0.3, 0.5, 0.8])
def test_two_moments_an_epoch_apart_are_one_of_the_shapes(gained, newer):
    window = SPREAD * APART * np.sqrt(newer * (1.0 - newer))
    # The mean of the two is at the epoch.
    seen = newer * gained.velocity(T + (1.0 - newer) * APART)
    seen += (1.0 - newer) * gained.velocity(T - newer * APART)
    shares = (1.0, 0.0, 0.0, 0.0) if newer >= 0.5 else (0.0, 1.0, 0.0, 0.0)
    assert value(gained, window, shares) == pytest.approx(seen, abs=1e-9)


@pytest.mark.parametrize("shares", [(0.0,) * 4, (1.0, 0.0, 0.0, 0.0), MIXED])
def test_its_place_changes_by_what_it_makes_of_the_velocity(shares):
    """And of each shape alike: a place is the velocity's integral, and a mean of it is, too.

    Of motion that is so slow that Simpson's rule leaves two hundredths of an even mean.
    """
    gained, h, window = sampled(1.0, step=0.004), 0.02, 0.3
    earlier, now, later = (response(gained, window, shares, T + by) for by in (-h, 0.0, h))
    even = gained.seen(T, [averaged(window, gained.step)])[0]
    speed = even + now.shaped
    change = (later.place - earlier.place) / (2.0 * h)
    assert change == pytest.approx(speed, abs=0.03 * np.abs(even).max())
    for shape, change in zip(now.shapes, (later.places - earlier.places) / (2.0 * h), strict=True):
        assert change == pytest.approx(shape, abs=0.03 * np.abs(even).max())


@pytest.mark.parametrize("newer", [0.3, 0.5, 0.8])
def test_a_place_between_two_epochs_is_on_the_line_between_theirs(gained, newer):
    window = SPREAD * APART * np.sqrt(newer * (1.0 - newer))
    shares = (1.0, 0.0, 0.0, 0.0) if newer >= 0.5 else (0.0, 1.0, 0.0, 0.0)
    place = ((0.0, 0.0, 1.0, 0.0),)
    at = [gained.seen(T + by * APART, [place])[0] for by in (1.0 - newer, 0.0, -newer)]
    made = response(gained, window, shares).place
    seen = newer * at[0] + (1.0 - newer) * at[2] - at[1]
    assert made == pytest.approx(seen, abs=1e-9)


def fitted(gained, seen, passes, *, shaped):
    """Spans of Gauss-Newton steps from 0.25 s, with and without the shares taken in."""
    window, shares, spans = 0.25, np.zeros(4), []
    for _ in range(passes):
        taken = shares if shaped else np.zeros(4)
        made = response(gained, window, taken)
        columns = np.concatenate([made.slope[None], made.shapes]).reshape(1 + len(SHAPES), -1)
        left = seen - value(gained, window, taken)
        # Shares are weights: a prior of one beside noise of 1 cm/s.
        prior = np.diag([0.0, *(1e-4,) * len(SHAPES)])
        wanted = columns @ left.ravel() - prior @ np.array([0.0, *taken])
        change = np.linalg.solve(columns @ columns.T + prior, wanted)
        window = float(np.sqrt(np.clip(window**2 + change[0], 0.01, 1.4)))
        shares = np.clip(taken + change[1:], (0.0, 0.0, -1.0, 0.0), 1.0)
        spans.append(window)
    return np.array(spans)


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("newer", [0.6, 0.8])
def test_in_gusts_a_span_comes_to_rest_with_its_shares_taken_in(newer, seed):
    """Fixes are of the motion itself, of which samples at 50 Hz miss a part."""
    true = SPREAD * APART * np.sqrt(newer * (1.0 - newer))
    later, earlier = T + (1.0 - newer) * APART, T - newer * APART
    seen = newer * velocity(later, 9.0, seed)[0] + (1.0 - newer) * velocity(earlier, 9.0, seed)[0]
    seen -= velocity(np.zeros(1), 9.0, seed)[0]
    v = sampled(9.0, seed)
    with_shares, without = (
        np.abs(fitted(v, seen, 12, shaped=shaped) - true) for shaped in (True, False)
    )
    assert with_shares[5:].max() < 1e-3
    assert without[5:].max() > 4e-3


@pytest.mark.parametrize("window", np.geomspace(1e-11, 1e-5, 25))
def test_a_span_that_rounding_hides_is_none(window):
    gained = Gained(0.0, 0.01, np.ones((200, 3)))
    made = Response(gained, np.array([0.8, 1.0]), window, np.full(4, 0.2), REACH)
    assert np.abs(made.shaped).max() < 1e-9
