"""A push is judged by what was flown after it, and by nothing else."""

from __future__ import annotations

import pytest

from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.samples import ImuSample, VehicleState
from onboard.daemon.learning.proof import ProofFlight


@pytest.fixture
def proof():
    return ProofFlight(CalibratorSettings())


@pytest.fixture
def heard(monkeypatch):
    """Times of the inertial samples that an estimator was fed with, by estimator."""
    fed = {}

    class Estimator:
        imus = ()

        def __init__(self, settings):
            self.times = fed.setdefault(len(fed), [])

        def feed(self, sample):
            if isinstance(sample, ImuSample):
                self.times.append(sample.t)

    monkeypatch.setattr("onboard.daemon.learning.proof.Calibrator", Estimator)
    monkeypatch.setattr("onboard.daemon.learning.proof.hand_on", lambda *_: None)
    return fed


def fly(proof, start):
    parameters = ParametersInForce()
    proof.feed(VehicleState(start, armed=True), parameters)
    proof.feed(ImuSample(start + 1.0, 1, (0.0, 0.0, -9.8)), parameters)
    return proof.feed(VehicleState(start + 2.0, armed=False), parameters)


def test_flights_that_say_too_little_add_up(proof, heard):
    proof.feed(VehicleState(0.0, armed=False), ParametersInForce())
    proof.expect({"one"})
    fly(proof, 10.0)
    proof.expect({"one"})
    fly(proof, 20.0)
    assert list(heard.values()) == [[11.0, 21.0]]


def test_what_taught_a_push_does_not_judge_it(proof, heard):
    proof.feed(VehicleState(0.0, armed=False), ParametersInForce())
    proof.expect({"one"})
    fly(proof, 10.0)
    proof.expect({"two"})  # in its place
    fly(proof, 20.0)
    assert list(heard.values()) == [[11.0], [21.0]]


def test_a_verdict_on_one_of_two_takes_nothing_from_the_other(proof, heard):
    proof.feed(VehicleState(0.0, armed=False), ParametersInForce())
    proof.expect({"one", "two"})
    fly(proof, 10.0)
    proof.expect({"two"})
    fly(proof, 20.0)
    assert list(heard.values()) == [[11.0, 21.0]]
