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
from tests.core.diagnosis.problems import Problem
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
