"""Velocity integrated freely, window after window: as the drift, and small where it should be."""

from __future__ import annotations

import itertools
from dataclasses import fields, replace
from weakref import ref

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from onboard.core.estimate import dead_reckoning
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.dead_reckoning import (
    Chain,
    KnownIntervals,
    free_drift,
    free_errors,
    intervals,
)
from onboard.core.inputs.segments import Fixes, Segment
from onboard.core.model.linearisation import Linearisation
from onboard.mavlink.decode import Decoder
from sitl import recording
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec

TRUE = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.25, -0.2, 0.3))
HORIZON_S = 10.0


@pytest.fixture(scope="module")
def flight():
    """Chain of integrals, states, and the six (scale, beta) in force and estimated."""
    spec = FlightSpec(vehicle="copter", duration=85.0, imus=(TRUE,), seed=4)
    parser, decoder = mav.MAVLink(None), Decoder(system=1, component=1)
    calibrator = Calibrator()
    for _, frame in recording.fly(spec):
        for message in parser.parse_buffer(frame) or ():
            for sample in decoder.decode(message):
                calibrator.feed(sample)
    calibrator.finish()
    engine = calibrator.engine(1)
    chain = intervals([(c.segment, c.fixes) for c in engine.batches], engine.point)
    held = calibrator.parameters.six(1)
    scale = np.array(held.scale)
    in_force = np.concatenate([scale, -scale * np.array(held.offset)])
    # The filter's attitude belongs to its own estimate, and so does the drift that is least.
    return chain, list(engine.states), in_force, engine.solution().theta[:6]


def test_integrals_that_are_known_are_those_that_are_made():
    pieces, point = [piece(start) for start in (0.0, 9.0, 18.0)], Linearisation()
    known = KnownIntervals()
    for these in (pieces[:2], pieces, pieces[1:], pieces):
        for at in (point, replace(point, delay=0.15), point):
            made, again = known.of(these, at), intervals(these, at)
            for f in fields(Chain):
                assert np.array_equal(getattr(made, f.name), getattr(again, f.name))


def test_integrals_are_made_once(monkeypatch):
    made = []
    monkeypatch.setattr(
        dead_reckoning, "intervals", lambda some, point: made.append(some) or intervals(some, point)
    )
    pieces, known = [piece(start) for start in (0.0, 9.0, 18.0)], KnownIntervals()
    for count in (1, 2, 2, 3):
        known.of(pieces[:count], Linearisation())
    assert [list(some) for some in made] == [[one] for one in pieces]


def test_flight_that_nobody_keeps_is_not_kept():
    known = KnownIntervals()
    segment, fixes = piece(0.0)
    known.of([(segment, fixes)], Linearisation())
    gone = ref(segment), ref(fixes)
    del segment, fixes
    assert [of() for of in gone] == [None, None]


def piece(start):
    """Ten seconds of a turn, and fixes inside."""
    t = start + np.arange(0.0, 12.0, 0.02)
    ones = np.ones((len(t), 3))
    segment = Segment(
        t,
        0.1 * ones * np.sin(t)[:, None],
        ones * [0.0, 0.0, -9.8],
        t,
        np.broadcast_to(np.eye(3), (len(t), 3, 3)),
        np.eye(3),
    )
    at = start + np.arange(1.4, 10.4, 0.2)
    return segment, Fixes(at, np.zeros((len(at), 3)), np.zeros(len(at)), np.zeros(len(at)))


def windows(errors):
    """Index ranges of the windows: each begins with NaN."""
    begins = np.flatnonzero(np.isnan(errors.error[0]))
    return list(zip(begins, [*begins[1:], len(errors.t)], strict=True))


@pytest.mark.slow
def test_a_window_ends_with_the_drift_over_it(flight):
    chain, states, in_force, estimate = flight
    errors = free_errors(chain, states, (in_force, estimate), horizon_s=HORIZON_S)
    drift = free_drift(chain, states, (in_force, estimate), horizon_s=HORIZON_S, most=1)
    assert drift is not None
    ends = [errors.error[:, stop - 1] for _, stop in windows(errors)]
    assert any(np.allclose(end, drift.end, rtol=1e-9) for end in ends)


@pytest.mark.slow
def test_windows_follow_each_other_and_last_no_longer_than_the_horizon(flight):
    chain, states, in_force, _ = flight
    errors = free_errors(chain, states, (in_force,), horizon_s=HORIZON_S)
    spans = [(errors.t[a], errors.t[b - 1]) for a, b in windows(errors)]
    assert len(spans) >= 5
    assert all(end - start <= HORIZON_S + 0.01 for start, end in spans)
    assert all(b[0] >= a[1] - 0.01 for a, b in itertools.pairwise(spans))
    assert np.all(np.diff(errors.t) >= 0.0)


def test_the_estimate_drifts_little_and_what_is_wrong_grows_with_time(flight):
    chain, states, in_force, estimate = flight
    errors = free_errors(chain, states, (in_force, estimate), horizon_s=HORIZON_S)
    first = np.array([errors.error[:, a + 1] for a, b in windows(errors) if b - a > 20])
    last = np.array([errors.error[:, b - 1] for a, b in windows(errors) if b - a > 20])
    assert np.median(last[:, 0]) > 5.0 * np.median(first[:, 0])
    assert np.median(last[:, 1]) < 0.2 * np.median(last[:, 0])


def test_without_flight_there_is_nothing(flight):
    chain, states, in_force, _ = flight
    assert len(free_errors(chain[:0], states, (in_force,), horizon_s=HORIZON_S).t) == 0
