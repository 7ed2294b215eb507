"""What a receiver makes of accelerations beside the linearisation's, against two other ways."""

import numpy as np
import pytest

from onboard.core.inputs.segments import Segment
from onboard.core.model.around import around
from onboard.core.model.nuisances import Six
from onboard.core.model.quadrature import NodeMaker
from onboard.core.model.smoothing import SPREAD, weight_of_two
from onboard.core.model.spread import place_weights, velocity_weights

STEP, APART = 0.002, 0.2
TAU = np.arange(-1.5, 1.5, STEP)
SHARES = [
    (0.0, 0.0, 0.0, 0.0),
    (0.7, 0.0, 0.0, 0.0),
    (0.0, 0.9, 0.4, 0.0),
    (0.1, 0.2, -0.5, 0.3),
]


def manoeuvre():
    """Turns and loads at half a hertz to one and a half."""
    t = np.arange(0.0, 6.0, 0.02)
    w = np.stack([0.6 * np.sin(3.0 * t), 0.3 * np.cos(5.0 * t), 0.4 * np.sin(2.0 * t + 1.0)], -1)
    f = np.stack([2.0 * np.sin(6.0 * t), 1.5 * np.cos(4.0 * t), 4.0 * np.sin(9.0 * t) - 9.8], -1)
    level = np.broadcast_to(np.eye(3), (len(t), 3, 3))
    return Segment(t, w, f, t, level, np.eye(3))


def responses(window, h):
    """Moments and weights of each shape, as receivers have them, and its share."""
    newer, older, leaning, late = h
    less, lag = weight_of_two(window, APART), window / SPREAD

    def two(p):
        between = window / SPREAD / np.sqrt(p * (1.0 - p))
        return np.array([p * between, (p - 1.0) * between]), np.array([1.0 - p, p])

    even = window * (np.arange(4000) + 0.5) / 4000 - 0.5 * window, np.full(4000, 1.0 / 4000)
    wait = -lag * np.log((np.arange(20000) + 0.5) / 20000)
    return [
        (1.0 - newer - older - late, even),
        (newer, two(less)),
        (older, two(1.0 - less)),
        (0.5 * leaning, two(0.25)),
        (-0.5 * leaning, two(0.75)),
        (late, (lag - wait, np.full(20000, 1.0 / 20000))),
    ]


@pytest.mark.parametrize("h", SHARES)
@pytest.mark.parametrize("window", [0.15, 0.33])
def test_weights_are_those_of_velocities_that_the_shapes_mix(window, h):
    weights = velocity_weights(TAU[None], STEP, window, APART, np.array(h))[0]
    for w in (1.0, 5.0, 12.0):
        # An acceleration cos(w t + 1) has gained the velocity sin(w t + 1) / w.
        expected = sum(
            share * float(weight @ (np.sin(w * at + 1.0) - np.sin(1.0))) / w
            for share, (at, weight) in responses(window, h)
        )
        assert weights @ np.cos(w * TAU + 1.0) == pytest.approx(expected, abs=3e-5)


@pytest.mark.parametrize("h", SHARES)
def test_an_even_acceleration_is_reported_as_it_is(h):
    assert abs(velocity_weights(TAU[None], STEP, 0.3, APART, np.array(h)).sum()) < 1e-9


@pytest.mark.parametrize("h", SHARES)
def test_places_are_weighed_as_those_of_the_force(h):
    """``X = t^2 / 2``: half the variance of the response, in whichever shape."""
    weights = place_weights(TAU[None], STEP, 0.3, APART, np.array(h))[0]
    assert weights.sum() == pytest.approx(0.3**2 / 24.0, rel=1e-3)


@pytest.mark.parametrize("h", SHARES)
def test_a_column_is_what_the_response_to_the_force_changes_by(h):
    segment = manoeuvre()
    epoch = segment.t[0] + 0.7 + APART * np.arange(20)
    columns = Six().acceleration

    def at(six):
        maker = NodeMaker(segment, np.zeros(3), six)
        return around(maker, epoch, 0.33, None, np.array(h))

    six, moved = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]), np.array([0.02, -0.01, 0.03, 0, 0, 0.2])
    here = at(six)
    stack = np.zeros((20, 9, 6))
    here.spread.add(columns(here.spread.nodes), np.arange(6), stack)
    velocity, place = stack[:, 0:3], stack[:, 3:6]
    there = at(six + moved)
    size = np.abs(there.averaged - here.averaged).max()
    np.testing.assert_allclose(
        velocity @ moved, there.averaged - here.averaged, atol=0.03 * size, rtol=0.0
    )
    np.testing.assert_allclose(
        place @ moved, there.averaged_place - here.averaged_place, atol=1e-4, rtol=0.0
    )
