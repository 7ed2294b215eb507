"""What an EKF makes of false velocities and of a jump, against the simulator's own EKF."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from onboard.core.inputs.reported_attitude import ReportedAttitude
from onboard.core.maths.earth import STANDARD_GRAVITY as G
from onboard.core.maths.frames import euler_from_rotation
from onboard.core.model.around import around
from onboard.core.model.ekf3_filter import SHOWN_S
from onboard.core.model.ekf_misled import EkfJumped, EkfMisled
from onboard.core.model.quadrature import NodeMaker
from sitl.builtin import attitude
from tests.core.model.test_autopilot_attitude import (
    BOARD,
    SMALL,
    T,
    attitudes,
    batch_of,
    motion,
)

FALSE = (20.0, 38.0)
AT = np.arange(5.0, 58.0, 0.5)


def their_own(axis, jumps=None):
    """(n, 3) attitude per m/s that the north or east velocity is too large by; places are right.

    Or per m/s^2 that an axis of the accelerometer has jumped by after a moment.
    """
    R, a = attitudes(), np.pad(motion(), [(0, 0), (0, 1)])
    off, nothing = np.zeros(3), np.zeros(3)
    ekf = attitude.AttitudeFilter()
    ekf.align(R[0], nothing, 0.0)
    out = np.zeros((len(T), 3))
    for k in range(len(T) - 1):
        wrong = nothing if jumps is None else BOARD[:, axis] * SMALL * (T[k + 1] > jumps)
        ekf.predict(0.5 * (R[k] + R[k + 1]), np.append(a[k, :2], -G), wrong, nothing)
        if jumps is None:
            off[axis] = SMALL * (FALSE[0] <= T[k + 1] <= FALSE[1])
        if k % 5 == 0:
            assert ekf.fuse_gps(off, nothing)
            ekf.fuse_heading(0.0)
        out[k + 1] = ekf.phi / SMALL
    return out


@pytest.fixture(scope="module")
def theirs():
    """(k, 3, 2) of both axes."""
    return shown(2)


def shown(axes, **jump):
    """(k, 3, axes) at the moments that are looked at."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(attitude, "SMOOTHING", SHOWN_S)
        every = np.stack([their_own(axis, **jump) for axis in range(axes)], axis=-1)
    flat = every.reshape(len(T), -1)
    return np.stack([np.interp(AT, T, x) for x in flat.T], axis=-1).reshape(-1, 3, axes)


def ours(edges, columns=None):
    """(k, 3, m) of a flight that is cut into batches at ``edges``."""
    parts = [batch_of(max(a - 2.0, 0.0), z) for a, z in pairwise(edges)]
    columns = columns or EkfMisled([FALSE], 1.0)
    m = len(columns.unknowns)
    out = np.zeros((len(AT), 3, m))
    for batch, (begin, end) in zip(columns.along(parts), pairwise(edges), strict=True):
        t, x = batch.segment.slow[columns.name]
        first, last = np.searchsorted(AT, [begin, end])
        told = np.stack([np.interp(AT[first:last], t, column) for column in x.T], axis=-1)
        out[first:last] = told.reshape(-1, 3, m)
    return out


def test_it_tilts_as_far_as_another_ekf(theirs):
    got = ours((0.0, 60.0))
    assert np.abs(theirs).max() > 0.01
    assert np.sqrt(np.mean((got - theirs) ** 2)) < 0.1 * np.sqrt(np.mean(theirs**2))


@pytest.mark.parametrize("edges", [(0.0, 60.0), (0.0, 22.0, 30.0, 44.0, 60.0)])
def test_a_jump_tilts_it_as_far_as_another_ekf(edges):
    moment = 25.0
    want, got = shown(3, jumps=moment), ours(edges, EkfJumped(moment, np.full(3, 0.5)))
    assert not got[: np.searchsorted(AT, moment)].any()
    assert np.all(np.abs(want).max(axis=(0, 1)) > 0.01)
    off, size = (np.sqrt(np.mean(x**2, axis=(0, 1))) for x in (got - want, want))
    assert np.all(off < 0.1 * size)


def test_nothing_is_wrong_before_and_most_is_forgotten_after():
    got = np.abs(ours((0.0, 60.0)))
    begun, forgotten = np.searchsorted(AT, [FALSE[0], FALSE[1] + 15.0])
    assert not got[:begun].any()
    assert got[forgotten:].max() < 0.3 * got.max()


def test_of_a_flight_in_batches_it_is_the_same():
    whole = ours((0.0, 60.0))
    np.testing.assert_allclose(ours((0.0, 22.0, 30.0, 44.0, 60.0)), whole, atol=2e-3)


def test_dcm_is_asked_nothing():
    """A steady velocity tilts it by nothing, however false."""
    part = batch_of(0.0, 40.0)
    angles = np.array([euler_from_rotation(R) for R in part.segment.R_attitude])
    reported = ReportedAttitude(angles, (0.0, 0.0, 0.0), dcm_gain=0.2)
    columns = EkfMisled([FALSE], 1.0)
    (told,) = columns.along([replace(part, segment=replace(part.segment, R_attitude=reported))])
    assert EkfMisled.name not in told.segment.slow
    maker = NodeMaker(told.segment, np.zeros(3), np.repeat([1.0, 0.0], 3))
    assert columns.attitude(around(maker, np.array([25.0]))).ned is None
