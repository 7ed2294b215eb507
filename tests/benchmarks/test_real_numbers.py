"""What is made of the fits of real flights: known answers on made-up numbers."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.real.concealed import KINDS
from benchmarks.real.flights import Fit, moving_force
from benchmarks.real.levels import gate_table
from benchmarks.real.offer import Offer
from benchmarks.real.offered import apart
from benchmarks.real.offered import summary as offered_summary
from benchmarks.real.offered import table as offered_table
from benchmarks.real.outcomes import Said, compared, table
from benchmarks.real.pair_parts import run as in_parts
from benchmarks.real.pair_parts import table as parts_table
from benchmarks.real.pairs import agreements, mean_force, own_table, run
from benchmarks.real.pairs import table as pair_table
from benchmarks.real.repeats import average, scatter_of, together
from benchmarks.real.whiteness import whiteness_of
from onboard.core.estimate.result import SIX_NAMES, Calibration, Coverage
from onboard.core.inputs.samples import GpsFix, ImuSample, Sample
from onboard.core.inputs.segments import Batch
from onboard.core.maths.accelerometer import (
    SixParameters,
    linear_of,
    parameters_jacobian,
    parameters_of,
)
from onboard.core.maths.arrays import vector3
from tests.core.estimate.two_accelerometers import Motion, batches

RNG = np.random.default_rng(3)
PRIOR_SIGMA = np.repeat([0.03, 0.5], 3)
PRIOR = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


def fit(estimate: np.ndarray, covariance: np.ndarray, *, flight: str = "a", imu: int = 1) -> Fit:
    """A fit of these scale and offset, recorded with nothing in force."""
    linear = linear_of(estimate)
    back = np.linalg.inv(parameters_jacobian(linear))
    return Fit(
        flight,
        "v",
        imu,
        "calibrated",
        True,
        "clean",
        (),
        PRIOR,
        estimate,
        covariance,
        np.zeros(6),
        linear,
        back @ covariance @ back.T,
        PRIOR,
        PRIOR_SIGMA,
        np.array([0.3, -0.2, -9.8]),
        {},
        1.0,
        1.0,
        0.1,
        0.1,
        100,
        100,
        {},
        (),
    )


def drawn(imu: int, sigma: float = 0.02) -> Fit:
    covariance = np.diag([1e-8] * 3 + [sigma**2] * 3)
    offset = sigma * RNG.standard_normal(3)
    return fit(np.concatenate([np.ones(3), offset]), covariance, imu=imu)


def test_white_noise_is_white_and_its_sum_is_not() -> None:
    t = np.arange(4000) * 0.2
    x = RNG.standard_normal(4000)
    white = whiteness_of("height", t, x)
    assert white.variance == pytest.approx(1.0, abs=0.1)
    assert white.lag1 == pytest.approx(0.0, abs=0.05)
    assert white.density == pytest.approx((1.0, 1.0, 1.0), abs=0.2)
    slow = whiteness_of("height", t, np.convolve(x, np.ones(10) / np.sqrt(10), "same"))
    assert slow.lag1 == pytest.approx(0.9, abs=0.05)
    assert slow.density[0] > 5.0
    assert slow.density[2] < 0.5


def test_densities_add_up_to_the_variance() -> None:
    """Parseval: at 5 Hz the bands are 0.04, 0.36 and 0.6 of the whole."""
    t, x = np.arange(1001) * 0.2, RNG.standard_normal(1001)
    white = whiteness_of("height", t, x)
    n = np.abs(np.fft.fftfreq(1001, 0.2))
    shares = [np.mean(n < 0.1), np.mean((n >= 0.1) & (n < 1.0)), np.mean(n >= 1.0)]
    assert np.dot(shares, white.density) == pytest.approx(white.variance)


def test_neighbours_across_a_gap_are_none() -> None:
    t = np.concatenate([np.arange(50) * 0.2, 100.0 + np.arange(50) * 0.2])
    x = np.concatenate([np.ones(50), -np.ones(50)])
    assert whiteness_of("height", t, x).lag1 == pytest.approx(1.0)


def test_the_mean_force_moves_by_an_offset_as_its_covariance_says() -> None:
    covariance = np.diag([1e-6] * 3 + [4e-4] * 3)
    mean = mean_force(fit(np.array([1.0, 1.0, 1.0, 0.1, 0.0, 0.0]), covariance))
    np.testing.assert_allclose(mean.force, [0.2, -0.2, -9.8], atol=1e-12)
    assert mean.covariance[0, 0] == pytest.approx(4e-4 + 1e-6 * 0.2**2)
    assert mean.covariance[2, 2] == pytest.approx(4e-4 + 1e-6 * 9.8**2)


def test_honest_accelerometers_agree_as_often_as_chi_square_says() -> None:
    """Three of one flight have two independent differences of three axes, mean 6, variance 12."""
    chi = []
    for _ in range(300):
        made = [drawn(imu, sigma) for imu, sigma in ((1, 0.01), (2, 0.02), (3, 0.04))]
        (a,) = agreements(made)
        assert a.freedom == 6
        assert len(run(made)) == 3
        chi.append(a.chi_square)
    assert np.mean(chi) == pytest.approx(6.0, abs=4.0 * np.sqrt(12.0 / 300))


def test_two_accelerometers_agree_as_their_pair_does() -> None:
    made = [drawn(1), drawn(2)]
    assert agreements(made)[0].chi_square == pytest.approx(run(made)[0].chi_square)


def test_honest_flights_scatter_by_their_sigmas() -> None:
    some = [replace(drawn(1), flight=str(k)) for k in range(400)]
    scatter = scatter_of(some, 3)
    assert scatter.flights == 400
    assert scatter.reduced == pytest.approx(1.0, abs=0.3)
    assert scatter.spread == pytest.approx(scatter.sigma, rel=0.2)


def test_honest_flights_scatter_as_they_should_along_what_they_know() -> None:
    """Hovers know scale and offset of z together; each alone leans on the prior they share."""
    true = PRIOR + np.array([0.0, 0.0, 0.02, 0.1, -0.1, 0.2])
    H = np.zeros((3, 6))
    H[[0, 1, 2], [3, 4, 5]], H[2, 2] = 1.0, -9.0
    noise, chi, freedom, z_offset = 0.02, 0.0, 0, []
    covariance = np.linalg.inv(np.diag(PRIOR_SIGMA**-2.0) + H.T @ H / noise**2)
    for _ in range(150):
        some = []
        for k in range(5):
            seen = H @ (true - PRIOR) + noise * RNG.standard_normal(3)
            linear = PRIOR + covariance @ H.T @ seen / noise**2
            J = parameters_jacobian(linear)
            some.append(fit(parameters_of(linear), J @ covariance @ J.T, flight=str(k)))
        (found,) = together(some)
        chi, freedom = chi + found.chi_square, freedom + found.freedom
        z_offset.append(scatter_of(some, 5).reduced)
    assert freedom == 150 * 4 * 3
    assert chi / freedom == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / freedom))
    assert np.nanmean(z_offset) < 0.2


def test_a_number_that_only_the_prior_knows_is_not_compared() -> None:
    wide = fit(PRIOR, np.diag(PRIOR_SIGMA**2))
    assert scatter_of([wide, wide, wide], 3).flights == 0


def test_flights_that_say_nothing_leave_the_prior_where_it_is() -> None:
    nothing = fit(PRIOR, np.diag(PRIOR_SIGMA**2))
    np.testing.assert_allclose(average([nothing] * 5), PRIOR, atol=1e-12)


def test_many_flights_outweigh_the_prior_that_each_of_them_leans_on() -> None:
    """A flight as good as the prior goes half of the way; nine of them nine tenths."""
    true = np.array([1.0, 1.0, 1.0, 0.2, 0.0, 0.0])
    half = np.array([1.0, 1.0, 1.0, 0.1, 0.0, 0.0])
    some = [fit(half, np.diag(PRIOR_SIGMA**2) / 2)] * 9
    np.testing.assert_allclose(average(some)[3], 0.9 * true[3], rtol=1e-3)


def said(numbers: dict[str, tuple[float, float]], *names: str) -> Said:
    six = dict.fromkeys(SIX_NAMES, (0.0, 0.01))
    return Said("explained", frozenset(names), six | numbers)


def test_a_change_is_that_to_the_untouched_flight() -> None:
    kind = next(k for k in KINDS if k.name == "GPS later 60 ms")
    before = said({"gps_delay": (0.1, 0.003)})
    after = said({"gps_delay": (0.161, 0.003)}, "gps_latency")
    o = compared("a", kind, before, after, {"gps_delay": 0.16})
    assert o.found
    assert o.recovered
    assert o.seen
    assert o.wrong == ()
    assert o.changes[0].truth == pytest.approx(0.06)
    assert o.changes[0].change == pytest.approx(0.061)
    assert o.moved == 0.0


def test_an_effect_that_is_not_named_is_missed_and_another_name_is_wrong() -> None:
    kind = next(k for k in KINDS if k.name.startswith("step x"))
    before = said({}, "gps_latency")
    after = said({"bias_ramp.x": (0.01, 0.001)}, "gps_latency", "bias_ramp", "empirical")
    o = compared("a", kind, before, after, {"bias_step.x": 0.5})
    assert o.found is False
    assert not o.recovered
    assert o.wrong == ("bias_ramp",)


def test_what_a_flight_does_not_claim_to_know_is_recovered_but_not_seen() -> None:
    kind = next(k for k in KINDS if k.name.startswith("offset x"))
    after = said({"x offset": (0.0, 0.2)})
    o = compared("a", kind, said({}), after, {"x offset": 0.3})
    assert o.found is None
    assert o.recovered
    assert not o.seen


@pytest.mark.parametrize(("smallest", "seen"), [(0.7, False), (0.3, True)])
def test_of_an_effect_that_is_not_named_the_smallest_size_counts_not_a_nuisance(
    smallest: float, seen: bool
) -> None:
    """The antenna's nuisance is within centimetres by its prior, whatever the flight shows."""
    kind = next(k for k in KINDS if k.name.startswith("antenna x"))
    name = "gps_lever_arm.x"
    before, after = said({name: (0.0, 0.04)}), said({name: (0.1, 0.04)})
    o = compared("a", kind, before, replace(after, smallest={name: smallest}), {name: 0.5})
    assert o.seen is seen
    assert not o.recovered


def test_the_mean_force_is_of_the_flight_before_its_end() -> None:
    """Standing it reads 1, flying 2, after the crash 9."""
    samples: list[Sample] = []
    for k in range(300):
        t = 0.1 * k
        x = 1.0 if t < 10.0 else 2.0 if t < 20.0 else 9.0
        samples.append(ImuSample(t, 1, (x, 0.0, -9.8), (0.0, 0.0, 0.0)))
        samples.append(GpsFix(t, 1, 3, 0.0, 0.0, 0.0, 0.0 if t < 10.0 else 5.0, 0.0))
    assert moving_force(samples, 1, 20.0)[0] == pytest.approx(2.0, abs=0.02)
    assert moving_force(samples, 1)[0] > 5.0
    assert np.all(np.isnan(moving_force(samples, 2)))


def test_an_effect_that_the_flight_is_said_not_to_show_was_not_to_be_seen() -> None:
    kind = next(k for k in KINDS if k.name.startswith("step x"))
    blind = replace(said({}), blind=frozenset({"bias_step"}))
    assert not compared("a", kind, said({}), blind, {"bias_step.x": 0.5}).seen
    assert compared("a", kind, said({}), said({}), {"bias_step.x": 0.5}).seen


def offering(f: Fit, six: np.ndarray, *objections: str) -> Fit:
    """The fit with these to be set, if nothing speaks against it."""
    set_to = f.in_force if objections else six
    return replace(f, offer=Offer(set_to, 3, 0.2, 0.21, 0.02, 0.999, 31.0, objections))


def test_what_is_offered_brings_accelerometers_together_or_not() -> None:
    """The second reads 0.3 m/s^2 too much in x: its own offset says so, or the first one's does."""
    force = np.array([0.3, -0.2, -9.8])
    one = replace(drawn(1), force=force)
    other = replace(drawn(2), force=force + np.array([0.3, 0.0, 0.0]))
    x = np.array([0.0, 0.0, 0.0, 0.3, 0.0, 0.0])
    right = apart([one, offering(other, PRIOR + x)])
    assert (right[0].in_force, right[0].offered) == pytest.approx((0.3, 0.0))
    wrong = apart([offering(one, PRIOR + x), other])
    assert (wrong[0].in_force, wrong[0].offered) == pytest.approx((0.3, 0.6))
    assert apart([one, offering(other, PRIOR + x, "not_sure")]) == []
    assert "closer in 1 of 1" in offered_summary([one, other], [], right)[-1]


def test_tables_fit_eighty_columns() -> None:
    kind = next(k for k in KINDS if k.name.startswith("GPS averaged"))
    truth = {"gps_delay": 0.2, "window_squared": 0.123456}
    before = said({"gps_delay": (0.1, 0.0031), "window_squared": (0.00123, 0.00456)})
    after = replace(before, verdict="insufficient", names=frozenset({"gps_fault"}))
    lines = table([compared("real-quad-22-chibios", kind, before, after, truth)]).splitlines()
    a = replace(fit(PRIOR, np.eye(6)), flight="real-quad-22-chibios", verdict="partly_explained")
    lines += gate_table([replace(a, believed=4235, epochs=4234)]).splitlines()
    made = [drawn(1), drawn(2), drawn(3)]
    lines += pair_table(run(made), agreements(made)).splitlines()
    lines += own_table(run(made)).splitlines()
    lines += offered_table([offering(a, PRIOR, "no_improvement", "not_sure")]).splitlines()
    assert max(map(len, lines)) <= 80


def kept(f: Fit, estimate: np.ndarray, flight: list[Batch]) -> Fit:
    """The fit with its flight, and a calibration of that."""
    nothing = Calibration.unanswered(
        f.imu,
        SixParameters(),
        "",
        parameters_known=True,
        coverage=Coverage(0.0, (0.0,) * 6, "", ()),
    )
    whole = replace(
        nothing,
        scale=vector3(estimate[:3]),
        offset=vector3(estimate[3:]),
        covariance=tuple(tuple(float(x) for x in row) for row in f.covariance),
        prior_sigma=(0.03, 0.03, 0.03, 0.5, 0.5, 0.5),
    )
    return replace(f, flight="b", estimate=estimate, batches=tuple(flight), whole=whole)


def test_a_pair_that_kept_its_flight_knows_its_difference_itself() -> None:
    """And all together, whose difference is nothing, agree to what the pair knows."""
    rng = np.random.default_rng(5)
    motion = Motion(rng)
    six = SixParameters((1.0, 1.0, 1.0), (0.1, 0.0, 0.0))
    noise = 0.05 * rng.standard_normal((2, len(motion.t), 3))
    flown = [heard(motion, x, n) for x, n in zip((six, SixParameters()), noise, strict=True)]
    first, second = drawn(1), kept(drawn(2), PRIOR, flown[1])
    first = replace(first, force=second.force + np.array([0.1, 0.0, 0.0]))
    (pair,) = run([kept(first, six.as_vector(), flown[0]), second])
    assert np.all(pair.own_sigma < 0.2 * pair.sigma)
    assert pair.own_chi_square < 16.3
    (apart,) = run([kept(first, PRIOR, flown[0]), second])
    assert apart.own_chi_square > 16.3
    assert np.abs(apart.after).max() == pytest.approx(0.1)
    assert np.abs(apart.together).max() < 0.02


def test_parts_of_a_pair_differ_as_it_says_and_show_when_it_jumps() -> None:
    rng = np.random.default_rng(6)
    chi = {2: 0.0, 3: 0.0, 4: 0.0}
    six = SixParameters((1.0, 1.0, 1.0), (0.1, 0.0, 0.0))
    for _ in range(6):
        motion = Motion(rng)
        noise = 0.05 * rng.standard_normal((2, len(motion.t), 3))
        first, second = (replace(drawn(imu), flight="b") for imu in (1, 2))
        right = replace(first, batches=tuple(heard(motion, six, noise[0])))
        other = replace(second, batches=tuple(heard(motion, SixParameters(), noise[1])))
        for part in in_parts([right, other]):
            chi[part.count] += part.chi_square / part.freedom / 6
    # White noise shows no drift, of which there may have been some: rather too wide.
    assert all(0.05 < x < 1.5 for x in chi.values()), chi
    noise[0, len(motion.t) // 2 :, 0] += 0.3
    jumped = replace(first, batches=tuple(heard(motion, six, noise[0])))
    halves = next(p for p in in_parts([jumped, other]) if p.count == 2)
    assert halves.chi_square > 16.3
    lines = parts_table([halves]).splitlines()
    assert max(map(len, lines)) <= 80
    assert "halves" in lines[-1]


def heard(motion: Motion, six: SixParameters, noise: np.ndarray) -> list[Batch]:
    return batches(motion, six, np.zeros(3), noise)
