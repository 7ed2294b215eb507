"""A receiver that says how accurate its velocity is: what it says weighs, as far as it is true."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.inputs.samples import GpsFix
from sitl.builtin.truth import GpsTruth
from tests.core.estimate.test_simulated_flights import TRUE, fed, flown

QUIET = GpsTruth(velocity_noise=0.01, velocity_coloured=0.01)
SKY_S = 20.0
"""For so long the sky is good, and for as long it is not."""
STATED_M_S = (0.3, 2.4)
"""By turns."""
ERROR = 0.15
"""Of what is stated, one sigma along each axis."""
KEPT = np.exp(-0.2 / 2.0)
"""From fix to fix of errors that last two seconds, half of the variance; the rest is white."""


@pytest.fixture(scope="module")
def quiet():
    return flown("copter", 170.0, gps=QUIET)[0]


def overlaid(samples, *, honest, told=True, seed=0):
    """The flight with errors of the velocity; honest: as large as is stated, else alike."""
    rng = np.random.default_rng(seed)
    slow, out = rng.normal(size=3), []
    for sample in samples:
        made = sample
        if isinstance(sample, GpsFix):
            stated = STATED_M_S[int(sample.t // SKY_S) % 2]
            slow = KEPT * slow + np.sqrt(1.0 - KEPT**2) * rng.normal(size=3)
            unit = (slow + rng.normal(size=3)) / np.sqrt(2.0)
            n, e, d = ERROR * (stated if honest else STATED_M_S[0]) * unit
            made = replace(
                sample,
                v_n=sample.v_n + n,
                v_e=sample.v_e + e,
                v_d=None if sample.v_d is None else sample.v_d + d,
                speed_accuracy=stated if told else None,
            )
        out.append(made)
    return out


def powers_of(levels):
    return np.array([levels.stated, levels.stated_colour])


def answered(samples):
    """Six errors in sigmas, their sigmas, and the powers with which noise goes."""
    made = fed(samples)
    got = made.calibration(1)
    error = np.array(got.scale + got.offset) - np.array(TRUE.scale + TRUE.offset)
    sigma = np.array(got.scale_sigma + got.offset_sigma)
    return error / got.sigma_with_its_gyroscope, sigma, powers_of(made.engine(1).noise)


@pytest.mark.slow
def test_fixes_weigh_as_much_as_they_are_worth(quiet):
    """None is refused that says two metres a second, and the good ones count for more."""
    samples = overlaid(quiet, honest=True)
    off, sigma, powers = answered(samples)
    untold, widest, _ = answered(overlaid(quiet, honest=True, told=False))
    assert np.all((powers > 0.8) & (powers < 1.25))
    assert np.abs(off).max() < 3.5
    assert np.abs(untold).max() < 3.5
    # Half of the fixes are eight times as good as the others.
    assert np.all(sigma[:3] < 0.75 * widest[:3])
    assert "speed_accuracy" not in fed(samples).trust.rejected


@pytest.mark.slow
def test_a_word_that_says_nothing_is_not_believed(quiet):
    off, sigma, powers = answered(overlaid(quiet, honest=False))
    _, without, _ = answered(overlaid(quiet, honest=False, told=False))
    assert np.all(powers < 0.15)
    assert np.abs(off).max() < 3.5
    # Two of the others have a share in how much the parts of the flight contradict each other.
    np.testing.assert_allclose(sigma[:2], without[:2], rtol=0.15)


@pytest.mark.slow
def test_fixes_that_are_worth_little_do_no_harm(quiet):
    """For forty seconds ten times the error of the rest, as stated: no less is known for them."""
    rng, slow, with_them, without = np.random.default_rng(4), np.zeros(3), [], []
    first = next(s.t for s in quiet if isinstance(s, GpsFix))
    for sample in quiet:
        good = bad = sample
        if isinstance(sample, GpsFix):
            good = replace(sample, speed_accuracy=0.3)
            slow = KEPT * slow + np.sqrt(1.0 - KEPT**2) * rng.normal(size=3)
            if 80.0 < sample.t - first < 120.0:
                n, e, d = 0.3 * slow
                v_d = None if sample.v_d is None else sample.v_d + d
                bad = replace(sample, v_n=sample.v_n + n, v_e=sample.v_e + e, v_d=v_d)
                bad, good = replace(bad, speed_accuracy=3.0), replace(bad, speed_accuracy=9.0)
            else:
                bad = good
        with_them.append(bad)
        without.append(good)
    off, sigma, _ = answered(with_them)
    _, refused, _ = answered(without)
    assert "speed_accuracy" in fed(without).trust.rejected
    assert np.abs(off).max() < 3.5
    assert np.all(sigma < 1.1 * refused)


@pytest.mark.slow
def test_what_is_stated_without_satellites_is_forgotten_with_them(quiet):
    """Ten seconds without a fix, and whatever is stated meanwhile."""
    first = next(s.t for s in quiet if isinstance(s, GpsFix))

    def poor(sample, accuracy):
        if isinstance(sample, GpsFix) and 80.0 < sample.t - first < 90.0:
            return replace(sample, fix_type=1, satellites=2, speed_accuracy=accuracy)
        return sample

    def varied(sample):
        if not isinstance(sample, GpsFix):
            return sample
        return replace(sample, speed_accuracy=0.3 if int(sample.t) % 2 else 0.31)

    _, usual, _ = answered([poor(varied(s), 0.3) for s in quiet])
    for nonsense in (4e9, -1.0, 1e-9):
        off, sigma, _ = answered([poor(varied(s), nonsense) for s in quiet])
        assert np.abs(off).max() < 3.5, nonsense
        np.testing.assert_allclose(sigma, usual, rtol=1e-3, err_msg=str(nonsense))
