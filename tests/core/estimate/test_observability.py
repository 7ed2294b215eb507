"""Observability on synthetic flights: information matrices built from specific forces."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onboard.core.estimate.observability import Needs, assess, describe, posterior_covariance
from onboard.core.estimate.result import SIX_NAMES

G = 9.80665


def information(f_b, noise=1.0):
    """Of samples f_b (n, 3) that measure the error of each axis: f d_scale - d_offset."""
    total = np.zeros((6, 6))
    for axis in range(3):
        row = np.zeros((len(f_b), 6))
        row[:, axis] = f_b[:, axis]
        row[:, 3 + axis] = -1.0
        total += row.T @ row / noise**2
    return total


def flight(n, x=0.0, y=0.0, z=0.0):
    """Specific forces with the given standard deviations about level flight."""
    rng = np.random.default_rng(5)
    f = rng.normal(size=(n, 3))
    f = (f - f.mean(axis=0)) / f.std(axis=0)
    return f * [x, y, z] + [0.0, 0.0, -G]


def test_a_rich_flight_is_observed_in_full_and_needs_no_advice():
    result = assess(information(flight(50_000, 3, 3, 3)))
    assert result.observed == (True,) * 6
    assert result.coverage.percent == 100
    assert result.weak == ()
    assert result.note == ""
    assert result.coverage.advice == ""


def test_no_flight_is_zero_percent_everywhere():
    result = assess(np.zeros((6, 6)))
    assert result.observed == (False,) * 6
    assert result.coverage.per_parameter == pytest.approx((0,) * 6, abs=1e-9)
    assert result.sigma == pytest.approx(tuple(Needs().prior))
    # Unknown alike is not coupled: six directions, one number each.
    assert sorted(w.members for w in result.weak) == [(i,) for i in range(6)]


def test_a_hover_sees_only_the_sum_of_z_scale_and_offset():
    result = assess(information(flight(1_000_000, 3, 3, 0.01)))
    assert result.observed == (True, True, False, True, True, False)
    (weak,) = result.weak
    assert weak.members == (2, 5)
    assert weak.sentence == "z scale and z offset cannot be told apart"
    assert "turns" in weak.advice
    assert result.coverage.weakest in ("z scale", "z offset")
    assert result.coverage.advice == weak.advice
    assert weak.sentence in result.note
    # The combination that stays unknown changes nothing that is measured: f d_scale = d_offset.
    needs = Needs()
    d_scale, d_offset = np.array(weak.weights) * needs.target[[2, 5]]
    assert d_offset == pytest.approx(-G * d_scale, rel=1e-3)


def test_axes_that_were_not_excited_are_named_one_by_one():
    result = assess(information(flight(1_000_000, 0.01, 0.01, 3)))
    assert result.observed == (False, False, True, True, True, True)
    assert [w.members for w in result.weak] == [(0,), (1,)]
    assert [SIX_NAMES[0] in w.sentence for w in result.weak] == [True, False]
    assert "brake" in result.weak[0].advice
    assert "to both sides" in result.weak[1].advice


def test_each_kind_of_vehicle_is_told_what_it_can_do():
    known = information(flight(1_000_000, 3, 0.01, 3))

    def advised(kind):
        return assess(known, kind=kind).coverage.advice

    assert "sideslip" in advised("plane")
    for kind in ("copter", "rover", "boat", "", "submarine"):
        assert advised(kind)
        assert "sideslip" not in advised(kind)
    assert "left and to the right" in advised("copter")
    assert not any(word in advised("rover") for word in ("fly", "throttle", "nose"))


def test_an_unexcited_scale_does_not_condemn_the_offset_beside_it():
    """Little mean force along y: no sane y scale could move the y offset by much."""
    f = flight(1_000_000, 3, 0.01, 3)
    f[:, 1] += 0.3
    result = assess(information(f))
    assert not result.observed[1]
    assert result.observed[4]


def test_offsets_that_turn_only_together_are_a_pair():
    N = information(flight(1_000_000, 3, 3, 3))
    # Kill the difference of x and y offset: project it out of the information.
    v = np.array([0, 0, 0, 1, -1, 0]) / np.sqrt(2)
    P = np.eye(6) - np.outer(v, v)
    result = assess(P @ N @ P)
    assert [w.members for w in result.weak] == [(3, 4)]
    assert result.weak[0].weights == pytest.approx((0.5**0.5, -(0.5**0.5)), rel=1e-2) or (
        result.weak[0].weights == pytest.approx((-(0.5**0.5), 0.5**0.5), rel=1e-2)
    )
    assert "headings" in result.weak[0].advice


def test_a_prior_that_is_already_good_enough_is_not_called_observed():
    needs = Needs(prior_scale=0.005, prior_offset=0.04)
    result = assess(np.zeros((6, 6)), needs)
    assert result.observed == (False,) * 6
    assert result.coverage.percent == 0


def test_the_weakest_is_the_one_furthest_from_what_is_needed():
    N = np.diag(1 / np.array([0.002, 0.02, 0.002, 0.01, 0.01, 0.01]) ** 2)
    result = assess(N)
    assert result.coverage.weakest == "y scale"
    assert result.coverage.percent == min(result.coverage.per_parameter)
    assert result.coverage.per_parameter[1] == result.coverage.percent < 100


@pytest.mark.parametrize("bad", [np.full((6, 6), np.nan), -np.eye(6), np.full((6, 6), np.inf)])
def test_a_matrix_that_is_none_counts_as_no_information(bad):
    result = assess(bad)
    assert result.coverage.percent == pytest.approx(0, abs=1e-9)
    assert result.observed == (False,) * 6


roots = arrays(np.float64, (4, 6), elements=st.floats(-300, 300))


@given(roots, roots)
def test_more_information_never_lowers_coverage_nor_loses_a_number(A, B):
    less, more = assess(A.T @ A), assess(A.T @ A + B.T @ B)
    for before, after in zip(less.coverage.per_parameter, more.coverage.per_parameter, strict=True):
        assert after >= before - 1e-6
    for s_before, s_after in zip(less.sigma, more.sigma, strict=True):
        assert s_after <= s_before * (1 + 1e-9)


@given(roots)
def test_flags_coverage_and_weak_directions_agree(A):
    result = assess(A.T @ A)
    for observed, percent in zip(result.observed, result.coverage.per_parameter, strict=True):
        assert observed == (percent == 100)
    weak = sorted(i for w in result.weak for i in w.members)
    assert weak == [i for i in range(6) if not result.observed[i]]
    assert [w.excess for w in result.weak] == sorted((w.excess for w in result.weak), reverse=True)
    for w in result.weak:
        assert w.excess >= 1 - 1e-6
        assert np.linalg.norm(w.weights) == pytest.approx(1)
    assert (result.coverage.advice == "") == (result.weak == ())
    assert assess(A.T @ A) == result


@given(roots)
def test_posterior_covariance_is_the_inverse_where_the_inverse_is_sane(A):
    N, prior = A.T @ A, Needs().prior
    direct = np.linalg.inv(N + np.diag(prior**-2.0))
    assert np.allclose(posterior_covariance(N, prior), direct, rtol=1e-6, atol=1e-9)


def test_every_group_has_a_sentence_and_an_advice():
    for bits in range(1, 64):
        members = tuple(i for i in range(6) if bits & 1 << i)
        sentence, advice = describe(members)
        assert all(SIX_NAMES[i] in sentence for i in members)
        assert advice


def test_offsets_that_need_the_same_flight_are_said_in_one_sentence():
    note = assess(np.zeros((6, 6))).note
    assert note.count("turn through all headings") == 1
    assert "x offset, y offset and z offset are not known well enough" in note
