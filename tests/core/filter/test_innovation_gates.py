"""Innovation gates: how often they refuse what is right, and when they believe again."""

import math

import numpy as np
import pytest

from onboard.core.filter import innovation_gates
from onboard.core.filter.innovation_gates import GateRefusal, InnovationGates, tails
from onboard.core.filter.limits import (
    ANEW,
    GATE_HEIGHT,
    GATE_VELOCITY,
    PATIENCE_S,
    RECEIVER_M_S,
    RECOVERY_FIXES,
    RECOVERY_S,
    TAIL,
)
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.uncertainty import Covariance
from onboard.core.maths.chi_square import survival

LEVELS = NoiseLevels(velocity=0.1, velocity_colour=0.05)
NONE = np.zeros(2)


def judged(gates, t, kinds, y, h=None, C=None, sigma=10.0):
    """Verdict on whitened innovations ``y``, ``sigma`` (m/s) each, about an estimate of zero."""
    h = np.zeros((len(y), 2)) if h is None else h
    E = sigma * np.column_stack([y, h])
    C = np.zeros((2, 2)) if C is None else C
    return gates.judge(t, kinds, E, y, h, NONE, Covariance(C), np.eye(len(y)) / sigma)


@pytest.mark.parametrize(("kinds", "name"), [("vvv", "velocity"), ("h", "height")])
def test_false_alarms_come_as_often_as_chi_square_says(monkeypatch, kinds, name):
    """Innovations drawn from the filter's model, the estimate's own uncertainty included."""
    n = len(kinds)
    limit = {1: 3.841, 2: 5.991, 3: 7.815}[n]  # 0.95 quantiles: often enough to be counted
    monkeypatch.setattr(
        innovation_gates,
        "GATES",
        tuple((kind, name, limit) for kind, name, _ in innovation_gates.GATES),
    )
    rng = np.random.default_rng(2)
    gates = InnovationGates(LEVELS)
    C = np.array([[0.4, 0.1], [0.1, 0.3]])
    root = np.linalg.cholesky(C)
    draws, refused = 4000, 0
    for _ in range(draws):
        gates.forget()
        h = rng.normal(size=(n, 2))
        y = rng.normal(size=n) + h @ (root @ rng.normal(size=2))
        verdict = judged(gates, 0.0, kinds, y, h, C)
        assert verdict in (None, GateRefusal(name))
        refused += verdict is not None
    assert refused / draws == pytest.approx(0.05, abs=4.0 * math.sqrt(0.05 * 0.95 / draws))


@pytest.mark.parametrize("sigma", [1e-3, 0.02, 0.1])
@pytest.mark.parametrize("uncertain", [0.0, 0.05])
def test_a_velocity_is_a_fault_only_if_no_good_receiver_errs_so(sigma, uncertain):
    """However quiet the noise is: an error counts against it and a good receiver's together."""
    spread = math.sqrt(sigma**2 + uncertain**2 + RECEIVER_M_S**2)
    edge = math.sqrt(GATE_VELOCITY) * spread
    h, C = np.eye(3), (uncertain / sigma) ** 2 * np.eye(3)
    for off, refused in ((0.99 * edge, None), (1.01 * edge, GateRefusal("velocity"))):
        y = np.array([0.6, -0.8, 0.0]) * off / sigma
        E = sigma * np.column_stack([y, h])
        gates = InnovationGates(LEVELS)
        verdict = gates.judge(0.0, "vvv", E, y, h, np.zeros(3), Covariance(C), np.eye(3) / sigma)
        assert verdict == refused


def test_the_limits_have_the_probabilities_that_are_claimed():
    assert survival(GATE_VELOCITY, 3) == pytest.approx(1.4e-6, rel=0.05)
    assert survival(GATE_VELOCITY, 2) == pytest.approx(3e-7, rel=0.05)
    for free, limit in TAIL.items():
        assert survival(limit, free) == pytest.approx(0.01, rel=0.01)
    assert survival(GATE_HEIGHT, 1) == pytest.approx(4.3e-8, rel=0.05)
    assert survival(ANEW["t"] * TAIL[2], 2) == pytest.approx(3e-7, rel=0.05)
    assert survival(ANEW["y"] * TAIL[1], 1) == pytest.approx(4.3e-8, rel=0.05)


def test_an_uncertain_estimate_widens_the_gate():
    y, h = np.array([8.0, 0.0, 0.0]), np.eye(3, 2)
    assert judged(InnovationGates(LEVELS), 0.0, "vvv", y, h) == GateRefusal("velocity")
    assert judged(InnovationGates(LEVELS), 0.0, "vvv", y, h, 10.0 * np.eye(2)) is None


def test_what_is_in_the_tail_is_brought_to_its_edge():
    h, C = np.zeros((7, 2)), Covariance(np.zeros((2, 2)))
    y = np.array([0.0, 6.0, 0.0, 5.0, 3.0, 4.0, 9.0])
    wider = tails("vvvhtty", y, h, C)
    # So much more variance makes the normalised square that of the edge.
    assert wider == {
        "v": pytest.approx(36.0 / TAIL[3]),
        "h": pytest.approx(25.0 / TAIL[1]),
        "t": pytest.approx(25.0 / TAIL[2]),
        "y": pytest.approx(81.0 / TAIL[1]),
    }
    assert tails("vvvhtty", 0.2 * y, h, C) == {}
    assert tails("h", y[3:4], np.eye(1, 2), Covariance(10.0 * np.eye(2))) == {}


def test_the_first_impossible_kind_is_named():
    gates = InnovationGates(LEVELS)
    y = np.array([0.0, 9.0, 0.0, 9.0, 0.0, 0.0, 0.0])
    assert judged(gates, 0.0, "vvvhtty", y) == GateRefusal("velocity")
    y[1] = 0.0
    gates.forget()
    assert judged(gates, 0.0, "vvvhtty", y) == GateRefusal("height")


def test_velocity_is_believed_again_after_it_was_steady_for_long_enough():
    gates = InnovationGates(LEVELS)
    assert judged(gates, 0.0, "vvv", np.array([9.0, 0.0, 0.0])) == GateRefusal("velocity")
    t = [0.2 * k for k in range(1, 20)]
    believed = [at for at in t if judged(gates, at, "vvv", np.zeros(3)) is None]
    assert believed[0] >= 0.2 + RECOVERY_S - 1e-9
    assert believed[0] >= 0.2 * RECOVERY_FIXES
    assert believed[0] < 0.2 + RECOVERY_S + 0.21


def test_velocity_that_jumps_inside_a_wide_gate_is_not_believed():
    gates = InnovationGates(LEVELS)
    judged(gates, 0.0, "vvv", np.array([9.0, 0.0, 0.0]))
    h, wide = np.eye(3, 2), 1e3 * np.eye(2)
    for k in range(1, 30):
        jumping = np.array([20.0 * (-1) ** k, 0.0, 0.0])
        assert judged(gates, 0.2 * k, "vvv", jumping, h, wide) == GateRefusal("recovery")


def test_a_height_that_stays_off_is_a_new_reference():
    gates = InnovationGates(LEVELS)
    y = np.full(1, 9.0)
    verdicts = [judged(gates, 0.5 * k, "h", y) for k in range(20)]
    first = next(k for k, v in enumerate(verdicts) if v.renewed)
    assert 0.5 * first == PATIENCE_S
    # What is right in between counts from anew.
    gates.forget()
    judged(gates, 0.0, "h", y)
    assert judged(gates, 1.0, "h", np.zeros(1)) is None
    assert not judged(gates, PATIENCE_S + 0.5, "h", y).renewed


def test_no_gate_refuses_a_recorded_attitude():
    y = np.array([0.0, 0.0, 0.0, 0.0, 9.0, 9.0, 99.0])
    assert judged(InnovationGates(LEVELS), 0.0, "vvvhtty", y) is None
