"""The published criterion against brute force, known truths and its own invariances."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.core.estimate.certificate import uniform_bound
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import rotation_from_euler
from tests.core.criterion import (
    CriterionSums,
    InitialVelocity,
    IntegralCriterion,
    Weighting,
)

TREATMENTS = list(InitialVelocity)
WEIGHTINGS = list(Weighting)
ALPHA, BETA = np.array([1.03, 0.98, 1.015]), np.array([0.2, -0.15, 0.3])
V0 = np.array([3.0, -2.0, 1.0])


class Flight:
    """Unevenly timed specific force, attitude and velocities; exact up to ``noise``."""

    def __init__(self, seed, *, n=400, epochs=60, noise=0.0, start=5.0, v0=V0):
        rng = np.random.default_rng(seed)
        self.t = start + np.cumsum(rng.uniform(0.01, 0.1, n))
        s = self.t - self.t[0]
        phase = rng.uniform(0, 6, 6)
        self.R_nb = rotation_from_euler(
            0.8 * np.sin(0.9 * s + phase[0]), 0.4 * np.sin(0.7 * s + phase[1]), 0.5 * s + phase[2]
        )
        f = np.stack([3 * np.sin((0.5 + k / 3) * s + phase[3 + k]) for k in range(3)], axis=-1)
        self.f_hat = f + np.array([0.0, 0.0, -9.0])
        # Velocities anywhere between the samples, the first sample's time included.
        self.t_v = np.sort(np.r_[self.t[0], rng.uniform(self.t[0], self.t[-1], epochs - 1)])
        self.v_n = v0 + self.integral(self.R_nb * (ALPHA * self.f_hat + BETA)[:, None, :])
        self.v_n = self.v_n.sum(axis=2)
        self.v_n[:, 2] += STANDARD_GRAVITY * (self.t_v - self.t[0])
        self.v_n += noise * rng.normal(size=self.v_n.shape)

    def integral(self, values):
        """Of the broken line through ``values`` (n, ...), from the start to every epoch."""
        result = []
        for end in self.t_v:
            inside = self.t[(self.t > self.t[0]) & (self.t < end)]
            nodes = np.r_[self.t[0], inside, end]
            flat = values.reshape(len(self.t), -1)
            line = np.stack([np.interp(nodes, self.t, c) for c in flat.T], axis=-1)
            result.append(np.trapezoid(line, nodes, axis=0).reshape(values.shape[1:]))
        return np.array(result)

    def rows(self):
        """H (m, 3, 6) and y (m, 3), without any treatment of the initial velocity."""
        H = np.concatenate(
            [self.integral(self.R_nb * self.f_hat[:, None, :]), self.integral(self.R_nb)], axis=2
        )
        y = self.v_n - np.outer(self.t_v - self.t[0], [0, 0, STANDARD_GRAVITY])
        return H, y

    def weights(self, weighting):
        if weighting is Weighting.EPOCHS:
            return np.ones(len(self.t_v))
        dt = np.diff(self.t_v)
        return 0.5 * (np.r_[dt, 0] + np.r_[0, dt])

    def feed(self, criterion, order="time"):
        if order == "velocities first":
            for t, v in zip(self.t_v, self.v_n, strict=True):
                criterion.velocity(t, v)
        k = 0
        for t, f, R in zip(self.t, self.f_hat, self.R_nb, strict=True):
            while order == "time" and k < len(self.t_v) and self.t_v[k] < t:
                criterion.velocity(self.t_v[k], self.v_n[k])
                k += 1
            criterion.specific_force(t, f, R)
        while order == "time" and k < len(self.t_v):
            criterion.velocity(self.t_v[k], self.v_n[k])
            k += 1
        return criterion


def close(a: CriterionSums, b: CriterionSums, rel=1e-9):
    scale = np.sqrt(np.outer(np.diag(a.N), np.diag(a.N)))
    return (
        np.all(np.abs(a.N - b.N) <= rel * scale)
        and np.allclose(a.b, b.b, rtol=rel, atol=rel * np.max(np.abs(a.b)))
        and math.isclose(a.s, b.s, rel_tol=rel)
        and math.isclose(a.weight, b.weight, rel_tol=rel)
        and a.rows == b.rows
    )


def brute_force(flights, treatment, weighting):
    """Least squares on all rows stacked; with a V_0 per flight as unknowns where eliminated."""
    A, y = [], []
    for i, flight in enumerate(flights):
        H, values = flight.rows()
        if treatment is InitialVelocity.FIRST_FIX:
            H, values = H - H[0], values - values[0]
        for H_k, y_k, w in zip(H, values, flight.weights(weighting), strict=True):
            own = [np.eye(3) if i == j else np.zeros((3, 3)) for j in range(len(flights))]
            nuisance = own if treatment is InitialVelocity.ELIMINATED else []
            A.append(math.sqrt(w) * np.hstack([H_k, *nuisance]))
            y.append(math.sqrt(w) * y_k)
    A, y = np.concatenate(A), np.concatenate(y)
    theta = np.linalg.lstsq(A, y, rcond=None)[0]
    return theta[:6], np.linalg.norm(A @ theta - y)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("treatment", TREATMENTS)
def test_the_minimum_is_that_of_brute_force_least_squares(treatment, weighting):
    flights = [Flight(1, noise=0.3), Flight(2, noise=0.3, start=500.0)]
    criterion = IntegralCriterion(treatment, weighting)
    for flight in flights:
        flight.feed(criterion)
        criterion.restart()
    solution = criterion.sums.solve()
    theta, residual = brute_force(flights, treatment, weighting)
    assert np.allclose(solution.alpha + solution.beta, theta, atol=1e-8)
    assert solution.residual_l2 == pytest.approx(residual, rel=1e-6)
    assert solution.rank == 6


@given(st.integers(0, 10**6))
@settings(max_examples=10, deadline=None)
def test_exact_data_give_the_truth_back(seed):
    for treatment in (InitialVelocity.FIRST_FIX, InitialVelocity.ELIMINATED):
        solution = Flight(seed).feed(IntegralCriterion(treatment)).sums.solve()
        assert np.allclose(solution.alpha, ALPHA, atol=1e-7)
        assert np.allclose(solution.beta, BETA, atol=1e-6)
        assert solution.residual_l2 < 1e-4
    at_rest = Flight(seed, v0=np.zeros(3)).feed(IntegralCriterion(InitialVelocity.ZERO))
    assert np.allclose(at_rest.sums.solve().alpha, ALPHA, atol=1e-7)


def test_the_papers_silent_zero_initial_velocity_spoils_a_window_in_flight():
    solution = Flight(3).feed(IntegralCriterion(InitialVelocity.ZERO)).sums.solve()
    assert max(np.abs(np.array(solution.beta) - BETA)) > 0.05
    assert solution.residual_l2 > 1


@pytest.mark.parametrize("treatment", TREATMENTS)
def test_the_sums_are_the_integral_of_the_squared_residual(treatment):
    flight = Flight(4, noise=0.2)
    sums = flight.feed(IntegralCriterion(treatment)).sums
    theta = np.array([1.1, 0.9, 1.05, 0.4, -0.3, 0.2])
    H, y = flight.rows()
    u = y - H @ theta
    if treatment is InitialVelocity.FIRST_FIX:
        u = u - u[0]
    if treatment is InitialVelocity.ELIMINATED:  # the best V_0 is the mean residual
        u = u - np.trapezoid(u, flight.t_v, axis=0) / (flight.t_v[-1] - flight.t_v[0])
    by_hand = np.trapezoid(np.sum(u**2, axis=1), flight.t_v)
    assert sums.value(theta) == pytest.approx(by_hand, rel=1e-8)
    assert sums.weight == pytest.approx(flight.t_v[-1] - flight.t_v[0])
    assert sums.rows == len(flight.t_v)


def test_the_solution_is_the_lowest_point():
    sums = Flight(5, noise=0.3).feed(IntegralCriterion()).sums
    solution = sums.solve()
    theta = np.array(solution.alpha + solution.beta)
    rng = np.random.default_rng(0)
    for _ in range(50):
        assert sums.value(theta + 1e-2 * rng.normal(size=6)) > sums.value(theta)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("treatment", TREATMENTS)
def test_merging_is_concatenating(treatment, weighting):
    a, b, c = Flight(6, noise=0.1), Flight(7, noise=0.1, start=200), Flight(8, n=50, epochs=9)
    one = IntegralCriterion(treatment, weighting)
    for flight in (a, b):
        flight.feed(one)
        one.restart()
    c.feed(one)
    parts = [f.feed(IntegralCriterion(treatment, weighting)).sums for f in (a, b, c)]
    assert close(one.sums, parts[0] + parts[1] + parts[2])
    assert close(one.sums, parts[2] + (parts[0] + CriterionSums.zero()) + parts[1])


@pytest.mark.parametrize("treatment", TREATMENTS)
def test_the_order_of_arrival_does_not_matter_as_long_as_velocities_are_not_late(treatment):
    flight = Flight(9, noise=0.1)
    in_time = flight.feed(IntegralCriterion(treatment))
    ahead = flight.feed(IntegralCriterion(treatment), order="velocities first")
    assert in_time.refused == ahead.refused == 0
    assert close(in_time.sums, ahead.sums)


def test_late_and_repeated_samples_are_refused_and_counted():
    flight = Flight(10, noise=0.1)
    clean = flight.feed(IntegralCriterion()).sums
    dirty = IntegralCriterion()
    for k in range(len(flight.t)):
        for v in np.flatnonzero((flight.t_v < flight.t[k]) & (flight.t_v >= flight.t[k - 1])):
            if k:
                dirty.velocity(flight.t_v[v], flight.v_n[v])
                dirty.velocity(flight.t_v[v], flight.v_n[v] + 9)  # a repeat
        dirty.specific_force(flight.t[k], flight.f_hat[k], flight.R_nb[k])
        if k > 10:
            dirty.specific_force(flight.t[k - 5], flight.f_hat[k], flight.R_nb[k])
            dirty.velocity(flight.t[k] - 1e-6, [99, 99, 99])
    assert close(clean, dirty.sums)
    assert dirty.refused >= 60 + 2 * 389


def test_a_velocity_from_before_the_window_is_refused():
    criterion = IntegralCriterion()
    criterion.velocity(1.0, [0, 0, 0])
    criterion.specific_force(2.0, [0, 0, -9.8], np.eye(3))
    assert criterion.refused == 1
    assert criterion.sums.rows == 0


@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(-50, 50))
@settings(max_examples=10, deadline=None)
def test_an_eliminated_initial_velocity_leaves_no_trace(x, y, z):
    here, there = Flight(11, noise=0.1), Flight(11, noise=0.1)
    there.v_n = there.v_n + np.array([x, y, z])
    for treatment in (InitialVelocity.ELIMINATED, InitialVelocity.FIRST_FIX):
        a = here.feed(IntegralCriterion(treatment)).sums
        b = there.feed(IntegralCriterion(treatment)).sums
        assert np.allclose(a.N, b.N)
        assert np.allclose(a.solve().beta, b.solve().beta, atol=1e-8)


def test_turning_the_world_about_the_vertical_changes_nothing():
    here, there = Flight(12, noise=0.1), Flight(12, noise=0.1)
    turn = rotation_from_euler(0, 0, 1.234)
    there.R_nb, there.v_n = turn @ there.R_nb, there.v_n @ turn.T
    for treatment in TREATMENTS:
        a = here.feed(IntegralCriterion(treatment)).sums
        assert close(a, there.feed(IntegralCriterion(treatment)).sums)


def test_without_a_vertical_speed_the_horizontal_still_tells():
    flight = Flight(17)
    flight.v_n[:, 2] = np.nan
    solution = flight.feed(IntegralCriterion(horizontal_only=True)).sums.solve()
    assert np.allclose(solution.alpha, ALPHA, atol=1e-6)
    assert np.allclose(solution.beta, BETA, atol=1e-5)


def test_a_hover_leaves_what_it_does_not_show_at_its_nominal_value():
    criterion = IntegralCriterion()
    for k in range(1000):
        t = 0.02 * k
        criterion.velocity(t, [0.0, 0.0, 0.1 * t])  # 0.1 m/s^2 too little lift
        criterion.specific_force(t, [0.0, 0.0, -STANDARD_GRAVITY], np.eye(3))
    solution = criterion.sums.solve()
    assert solution.rank == 3  # x and y offset, and z scale and offset as one
    assert solution.alpha[:2] == pytest.approx((1, 1))
    assert solution.beta[:2] == pytest.approx((0, 0), abs=1e-9)
    lift = -STANDARD_GRAVITY * solution.alpha[2] + solution.beta[2]
    assert lift == pytest.approx(-STANDARD_GRAVITY + 0.1, abs=1e-9)


def test_no_data_solve_to_the_nominal_values():
    solution = CriterionSums.zero().solve()
    assert solution.alpha == (1, 1, 1)
    assert solution.beta == (0, 0, 0)
    assert solution.rank == 0
    assert solution.residual_l2 == 0


def test_the_result_is_the_autopilots_parameters():
    truth = SixParameters(scale=(1.02, 0.97, 1.01), offset=(0.3, -0.2, 0.1))
    in_force = SixParameters(scale=(0.99, 1.01, 1.03), offset=(0.1, 0.1, -0.1))
    flight = Flight(13)
    f = ALPHA * flight.f_hat + BETA
    seen = in_force.apply(truth.undo(f))
    flight.f_hat = seen
    solution = flight.feed(IntegralCriterion()).sums.solve()
    found = solution.parameters(in_force)
    # Broken lines through f and through what was seen are the same up to the affine map.
    assert found.scale == pytest.approx(truth.scale, abs=1e-7)
    assert found.offset == pytest.approx(truth.offset, abs=1e-6)


@pytest.mark.parametrize("treatment", [InitialVelocity.ZERO, InitialVelocity.FIRST_FIX])
def test_the_certificate_follows_from_the_sums(treatment):
    """The trapezoidal norm is not below that of the broken line, so that the bound holds."""
    flight = Flight(14, noise=0.3)
    sums = flight.feed(IntegralCriterion(treatment)).sums
    solution = sums.solve()
    H, y = flight.rows()
    u = y - H @ np.array(solution.alpha + solution.beta)
    if treatment is InitialVelocity.FIRST_FIX:
        u = u - u[0]
    slope = np.max(np.linalg.norm(np.diff(u, axis=0), axis=1) / np.diff(flight.t_v))
    bound = uniform_bound(solution.residual_l2, slope, sums.weight)
    assert np.max(np.linalg.norm(u, axis=1)) <= bound


def test_sums_survive_bytes_and_damage_is_told():
    sums = Flight(15, noise=0.1).feed(IntegralCriterion()).sums
    data = sums.to_bytes()
    assert len(data) == 240
    back = CriterionSums.from_bytes(data)
    assert np.array_equal(back.N, sums.N)
    assert back.solve() == sums.solve()
    with pytest.raises(ValueError, match="240 bytes"):
        CriterionSums.from_bytes(data[:-1])
    with pytest.raises(ValueError, match="not numbers"):
        CriterionSums.from_bytes(b"\xff" * 240)
