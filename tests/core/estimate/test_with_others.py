"""What a vehicle's other accelerometers add to one of them: more is known, and not too much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.comparison import compare
from onboard.core.estimate.determined import force_moments
from onboard.core.estimate.relative import relative_of
from onboard.core.estimate.result import Status
from onboard.core.estimate.shared_windows import shared_windows
from onboard.core.estimate.with_others import with_others
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import vector3
from onboard.core.maths.earth import STANDARD_GRAVITY
from tests.cli.results import CALIBRATED
from tests.core.estimate.two_accelerometers import Motion, batches

PRIOR = np.repeat([0.03, 0.5], 3)
SHARED = np.repeat([0.004, 0.04], 3)
"""Error that GPS and attitude put into every solution of a flight."""
GYRO = np.array([0.0, 0.0, 0.0, 0.03, 0.03, 0.0])
"""What the axes of a gyroscope put into the offsets that fit it, m/s^2."""


def claimed(own):
    """Covariance of a solution with an error of its own, in units of the shared one."""
    return np.diag(1.0 / (1.0 / (SHARED * np.hypot(1.0, own)) ** 2 + PRIOR**-2.0))


def calibration(imu, six, P, in_force):
    """A record of ``six`` that fit their gyroscope, with the covariance ``P``."""
    bench = P + np.diag(GYRO**2)
    return replace(
        CALIBRATED,
        imu=imu,
        status=Status.INSUFFICIENT,
        believed=True,
        scale=vector3(six[:3]),
        offset=vector3(six[3:]),
        covariance=tuple(map(tuple, bench)),
        in_force_scale=vector3(in_force[:3]),
        in_force_offset=vector3(in_force[3:]),
        prior_sigma=tuple(PRIOR),
        gyro_sigma=tuple(GYRO),
    )


def vehicle(rng, own, seconds=60.0):
    """What should be set of accelerometers, and their calibrations and batches.

    Args:
        own: by accelerometer, its own error in units of the one that all share.
    """
    motion, common = Motion(rng, seconds), SHARED * rng.standard_normal(6)
    wanted, records, flown = {}, [], {}
    for imu, its in enumerate(own, 1):
        in_force = np.repeat([1.0, 0.0], 3)
        true = in_force + np.repeat([0.02, 0.3], 3) * rng.standard_normal(6)
        six = SixParameters(vector3(true[:3]), vector3(true[3:]))
        noise = 0.05 * rng.standard_normal((len(motion.t), 3))
        flown[imu] = batches(motion, six, np.zeros(3), noise)
        # The axes of its gyroscope are as if its offset were another one.
        wanted[imu] = true + GYRO * rng.standard_normal(6)
        found = wanted[imu] + common + its * SHARED * rng.standard_normal(6)
        P, data = claimed(its), (SHARED * np.hypot(1.0, its)) ** -2.0
        posterior = P @ (data * found + PRIOR**-2.0 * in_force)
        records.append(calibration(imu, posterior, P, in_force))
    return wanted, records, flown


def known(records, flown):
    return with_others(records, compare(records, (flown,)))


@pytest.mark.parametrize("own", [(0.2, 0.2), (0.1, 5.0), (0.2, 1.0, 3.0)])
def test_nothing_is_lost_much_is_gained_and_sigmas_are_honest(own):
    rng = np.random.default_rng(7)
    off, gained, runs = [], [], 150
    for _ in range(runs):
        wanted, records, flown = vehicle(rng, own)
        found = known(records, flown)
        if found.keys() != wanted.keys():  # a chance of one in a thousand for each pair
            continue
        for c in records:
            x, P = found[c.imu].best
            M = force_moments(c.load_mean, c.load_square, c.in_force_scale + c.in_force_offset)
            gained.append(np.sum(M * P) / np.sum(M * c.with_its_gyroscope))
            off.append((x - wanted[c.imu]) / np.sqrt(np.diag(P)))
    gained, off = np.reshape(gained, (-1, len(own))), np.reshape(off, (-1, len(own), 6))
    assert len(off) > 0.97 * runs
    assert np.all(gained <= 1.0 + 1e-9)
    # Root mean squares of 150 normal numbers: four of their sigmas.
    assert np.all(np.sqrt(np.mean(np.square(off), axis=0)) < 1.0 + 4.0 / np.sqrt(2.0 * runs))
    if max(own) > 2.0:
        # What it lacks the others have: as far as the axes of the gyroscopes let them say.
        assert np.median(gained[:, -1]) < 0.35


def test_right_ones_need_not_agree_where_gyroscopes_differ():
    """Two that are known by themselves to a fifth of their gyroscopes' axes stay as they are."""
    rng = np.random.default_rng(8)
    wanted, records, flown = vehicle(rng, (0.1, 0.1))
    sharp = [
        calibration(c.imu, wanted[c.imu], 0.02 * np.array(c.with_its_gyroscope), (1, 1, 1, 0, 0, 0))
        for c in records
    ]
    found = known(sharp, flown)
    for c in sharp:
        x, P = found[c.imu].best
        assert np.max(np.abs((x - wanted[c.imu]) / np.sqrt(np.diag(P)))[3:5]) < 1.0
    made = found[1].best[0] - found[2].best[0]
    np.testing.assert_allclose(made[3:5], (wanted[1] - wanted[2])[3:5], atol=0.01)


def test_one_that_the_pair_contradicts_is_left_as_it_is():
    _, records, flown = vehicle(np.random.default_rng(9), (0.1, 0.1, 0.1))
    wrong = replace(records[2], offset=(3.0, -2.0, 1.0))
    found = known([*records[:2], wrong], flown)
    assert sorted(found) == [1, 2]
    assert found[1].together.imus == (1, 2)
    assert known([records[0], wrong], {1: flown[1], 3: flown[3]}) == {}


def test_one_that_takes_no_part_is_not_asked():
    _, records, flown = vehicle(np.random.default_rng(10), (0.1, 0.1))
    assert with_others(records[:1], compare(records, (flown,))) == {}


def test_a_pair_is_loosened_by_the_covariances_of_what_spoils_it():
    rng = np.random.default_rng(11)
    _, _, flown = vehicle(rng, (0.1, 0.1))
    pair = relative_of(
        (1, 2),
        shared_windows(flown[1], flown[2]),
        np.tile(SixParameters().as_linear(), 2),
        np.tile(PRIOR, 2),
    )
    same = pair.loosened(np.zeros(12))
    np.testing.assert_allclose(same.information, pair.information, rtol=1e-9, atol=1e-6)
    # With information in every direction covariances add, and the estimate stays.
    whole = replace(
        pair,
        information=pair.information + np.diag(np.tile(PRIOR, 2) ** -2.0),
        vector=pair.vector,
    )
    sigma = np.tile(np.array([1e-3, 1e-3, 1e-3, 0.1, 0.1, 0.0]) * STANDARD_GRAVITY, 2)
    loose = whole.loosened(sigma)
    np.testing.assert_allclose(
        np.linalg.inv(loose.information),
        np.linalg.inv(whole.information) + np.diag(sigma**2),
        rtol=1e-6,
        atol=1e-12,
    )
    np.testing.assert_allclose(
        np.linalg.solve(loose.information, loose.vector),
        np.linalg.solve(whole.information, whole.vector),
        rtol=1e-6,
        atol=1e-12,
    )
