"""What an accelerometer has to read at rest, by sensors whose errors are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.real.flights import resting_force
from benchmarks.real.rest import rest_of, run, table
from onboard.core.inputs.samples import ImuSample
from tests.benchmarks.test_real_numbers import fit, offering

TRUE = np.array([1.02, 0.985, 1.015, 0.2, -0.15, 0.3])
RNG = np.random.default_rng(8)
G = 9.80665


def standing(up: np.ndarray) -> np.ndarray:
    """(3,) what a sensor with these errors reads where ``up`` (3,) is up, nothing in force."""
    return G * up / np.linalg.norm(up) / TRUE[:3] + TRUE[3:]


@pytest.mark.parametrize("up", [(0.0, 0.0, -1.0), (0.2, -0.1, -1.0), (-1.0, 0.0, 0.0)])
def test_what_is_right_feels_gravity_however_it_stands(up) -> None:
    made = replace(fit(TRUE, 1e-6 * np.eye(6)), rest=standing(np.array(up)))
    assert rest_of(made).estimate == pytest.approx(0.0, abs=1e-9)
    assert abs(rest_of(made).in_force) > 0.05


def test_what_is_offered_is_asked_at_rest_too() -> None:
    made = replace(fit(TRUE, 1e-6 * np.eye(6)), rest=standing(np.array([0.0, 0.0, -1.0])))
    assert np.isnan(rest_of(made).offered)
    assert rest_of(offering(made, TRUE)).offered == pytest.approx(0.0, abs=1e-9)
    assert np.isnan(rest_of(offering(made, TRUE, "not_sure")).offered)
    assert "1 with something offered" in table(run([made, offering(made, TRUE)]))


def test_estimates_that_scatter_as_they_claim_are_off_by_a_sigma() -> None:
    sigma = np.array([0.01, 0.01, 0.01, 0.05, 0.05, 0.05])
    up = np.array([0.1, 0.05, -1.0])
    off = [
        rest_of(replace(fit(TRUE + sigma * draw, np.diag(sigma**2)), rest=standing(up))).off
        for draw in RNG.standard_normal((400, 6))
    ]
    assert np.std(off) == pytest.approx(1.0, abs=0.1)


def test_only_what_stands_is_at_rest() -> None:
    def sampled(t: float, *, moves: bool) -> ImuSample:
        f = 0.01 * RNG.standard_normal(3) + np.array([0.1, 0.2, -9.7])
        turn = 0.5 * np.sin(3.0 * t) if moves else 0.0
        return ImuSample(t, 1, (float(f[0]), float(f[1]), float(f[2])), (turn, 0.0, 0.0))

    stood = [sampled(0.05 * k, moves=False) for k in range(300)]
    assert resting_force(stood, 1) == pytest.approx([0.1, 0.2, -9.7], abs=0.01)
    assert np.all(np.isnan(resting_force([sampled(0.05 * k, moves=True) for k in range(300)], 1)))


def test_who_was_not_seen_standing_is_left_out() -> None:
    made = fit(TRUE, np.eye(6))
    assert run([made]) == []
    assert "nobody" in table([])
    (rest,) = run([replace(made, rest=standing(np.array([0.0, 0.0, -1.0])))])
    assert "1" in table([rest])
