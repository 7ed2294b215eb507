"""What only makes up for a constant that changes is not named in its place."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from onboard.answers.recorded import Recorded, later
from onboard.answers.verdict import headline
from onboard.core.diagnosis.candidates import Candidate
from onboard.core.diagnosis.constancy import Pieces
from onboard.core.diagnosis.shadows import needless
from onboard.core.inputs.samples import ImuSample, VehicleState
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import GpsTruth, random_imus
from sitl.recording import FlightSpec, fly_messages
from tests.core.diagnosis.problems import BLOCK_S, Problem
from tests.core.diagnosis.test_constancy import SHAPES, T, flight

RATE = Candidate("clock_skew", (10,), (inf,))


def gone(made: Problem) -> list[Candidate]:
    """What is needless beside a latency of its own in every piece."""
    pieces = Pieces.of(made.blocks, made.model).freed(made.columns("late"))[0]
    return needless(pieces, [RATE], np.zeros(made.model.size))


def with_rate(made: Problem, column, size: float = 0.0) -> Problem:
    """The same where the unknown of the effect has another column, and is there."""
    h = made.h.copy()
    h[:, :, 10] = column
    return replace(made, h=h, y=made.y + size * column)


@pytest.mark.parametrize("seed", range(10))
def test_what_fits_a_step_as_growth_is_its_shadow(seed):
    made = flight(seed, late=2.0 * SHAPES["stepping"])
    grown = with_rate(made, made.h[:, :, 6] * T[:, None] / T[-1])
    fit = Pieces.of(grown.blocks, grown.model)
    C = np.linalg.inv(fit.N.sum(axis=0) + np.diag(fit.prior))
    assert fit.theta[10] ** 2 / C[10, 10] > 100.0  # which is no chance, by itself
    assert gone(grown) == [RATE]


@pytest.mark.parametrize("seed", range(10))
def test_what_is_there_stays_beside_a_constant_that_changes(seed):
    made = flight(seed, late=2.0 * SHAPES["stepping"])
    rng = np.random.default_rng(seed + 100)
    assert gone(with_rate(made, rng.normal(size=made.y.shape), 0.5)) == []


def stepping_within(seed: int, size: float, rate: float = 0.0) -> Problem:
    """A latency that steps in the middle of a block, beside growth by time, in every row."""
    made = flight(seed)
    blocks, rows = made.y.shape
    t = BLOCK_S * (np.arange(blocks * rows).reshape(blocks, rows) + 0.5) / rows
    h, late = made.h.copy(), made.h[:, :, 6]
    h[:, :, 10] = late * t / T[-1]
    return replace(made, h=h, y=made.y + size * late * (t > T[9]) + rate * h[:, :, 10])


@pytest.mark.parametrize("seed", range(10))
def test_a_step_within_a_piece_is_no_growth_either(seed):
    """Within ten seconds it is as steep as no clock, and all of it had been put to the rate."""
    made = stepping_within(seed, 10.0)
    pieces = Pieces.of(made.blocks, made.model).freed(made.columns("late"))[0]
    C = np.linalg.inv(pieces.N.sum(axis=0) + np.diag(pieces.prior))
    assert pieces.theta[10] ** 2 / C[10, 10] > 25.0
    assert gone(made) == [RATE]


@pytest.mark.parametrize("seed", range(10))
def test_growth_that_is_there_stays_beside_a_step_within_a_piece(seed):
    assert gone(stepping_within(seed, 10.0, 20.0)) == []


def test_a_piece_with_a_size_of_its_own_is_one_with_a_column_of_its_own():
    made = flight(3, place=0.8 * (np.arange(16) == 5))
    own = list(made.columns("place"))
    pieces = Pieces.of(made.blocks, made.model)
    silenced = pieces.silenced(5, own)
    h, y = made.rows
    column = np.zeros((len(y), 3))
    inside = np.repeat(np.arange(16), len(y) // 16) == 5
    column[inside] = h[inside][:, own]
    wide = np.hstack([h, column])
    prior = np.concatenate([1.0 / made.model.prior_sigma, np.zeros(3)])
    centre = np.concatenate([made.model.prior, np.zeros(3)])
    A, b = np.vstack([wide, np.diag(prior)]), np.concatenate([y, prior * centre])
    x = np.linalg.lstsq(A, b, rcond=None)[0]
    np.testing.assert_allclose(silenced.theta, x[:-3], rtol=1e-6, atol=1e-9)
    assert silenced.square == pytest.approx(float(np.sum((y - wide @ x) ** 2)), rel=1e-9)
    plain = np.linalg.lstsq(A[:, :-3], b, rcond=None)[0]
    fall = np.sum((b - A[:, :-3] @ plain) ** 2) - np.sum((b - A @ x) ** 2)
    assert pieces.apart(own)[5] == pytest.approx(float(fall), rel=1e-6)
    assert np.argmax(pieces.apart(own)) == 5


def samples(seed: int, delay: float) -> list:
    spec = FlightSpec(
        vehicle="copter",
        seed=seed,
        duration=90.0,
        imus=random_imus(31),
        gps=GpsTruth(delay=delay),
        loop_rate=100,
    )
    decoder = Decoder()
    return [s for _, message in fly_messages(spec) for s in decoder.decode(message)]


@pytest.mark.slow
def test_a_latency_that_is_set_between_two_flights_is_no_clock():
    first, second = samples(31, 0.10), samples(32, 0.22)
    landed = max(s.t for s in first if isinstance(s, ImuSample))
    by = landed + 60.0 - min(s.t for s in second if isinstance(s, ImuSample))
    recorded = Recorded((1,))
    for s in (*first, VehicleState(landed + 1.0, armed=False, landed=True)):
        recorded.feed(s)
    for s in second:
        if s.t is not None:
            recorded.feed(later(s, s.t, by))
    recorded.finish()
    made = recorded.answer(1).diagnosis
    assert "clock_skew" not in [e.name for e in made.effects]
    (change,) = made.inconstant
    assert (change.effect, change.contradicts) == ("gps_latency", True)
    assert headline(made) == "The latency of GPS is not the same in parts of the flight"
