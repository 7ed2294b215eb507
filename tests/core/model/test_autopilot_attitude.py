"""What an EKF makes of errors of its sensors, against the built-in simulator's own EKF."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.inputs.segments import Batch, Fixes, Segment
from onboard.core.maths.earth import STANDARD_GRAVITY as G
from onboard.core.maths.frames import rotation_from_vector, vector_from_rotation
from onboard.core.model import autopilot_attitude
from onboard.core.model.around import around
from onboard.core.model.ekf3_filter import SETTLED_S, SHOWN_S
from onboard.core.model.ekf_sensors import TOLD, EkfSensors
from onboard.core.model.gyro_scale import GyroScale
from onboard.core.model.quadrature import NodeMaker
from onboard.core.model.regressors import Model
from onboard.core.model.sensor_errors import (
    ANTENNA,
    BETA,
    ERRORS,
    GYRO_SCALE,
    LATENESS,
    SCALE,
)
from sitl.builtin import attitude

STEP = attitude.STEP
T = np.arange(0.0, 60.0 + STEP / 2, STEP)
BOARD = rotation_from_vector(np.array([0.3, -0.2, 1.2]))
SMALL = 1e-4


def motion():
    """(n, 2) acceleration north and east, m/s^2: stops and goes, after three seconds of rest."""
    a = np.stack([2.0 * np.sin(0.9 * T), 1.5 * np.cos(0.4 * T) + np.sin(2.0 * T)], axis=-1)
    return a * np.clip((T - 3.0) / 2.0, 0.0, 1.0)[:, None]


def attitudes():
    """(n, 3, 3) of a copter that leans into it and turns its nose."""
    a = motion()
    moving = np.clip((T - 3.0) / 2.0, 0.0, 1.0)
    nose = 0.7 + 0.8 * moving * np.sin(0.3 * T) + 0.2 * np.maximum(T - 10.0, 0.0)
    lean = rotation_from_vector(np.stack([0.1 * a[:, 1], -0.1 * a[:, 0], 0.0 * T], axis=-1))
    return lean @ rotation_from_vector(np.stack([0.0 * T, 0.0 * T, nose], axis=-1))


def felt(R):
    """(n, 3) force, body axes."""
    f_n = np.concatenate([motion(), np.full((len(T), 1), -G)], axis=1)
    return np.einsum("nji,nj->ni", R, f_n)


def rates(R):
    """(n, 3) rad/s; of the step from each to the next."""
    turn = vector_from_rotation(np.swapaxes(R[:-1], -1, -2) @ R[1:]) / STEP
    return np.vstack([turn, turn[-1:]])


def segment_of(start, end, every=2, *, own=True):
    """Samples in the axes of a turned board, and every so many of the attitudes."""
    R = attitudes()
    w = rates(R)
    smooth = np.vstack([w[:1], 0.5 * (w[1:] + w[:-1])])
    cut = slice(round(start / STEP), round(end / STEP) + 1)
    raw = felt(R)[cut] @ BOARD
    few = slice(0, None, every)
    return Segment(T[cut], smooth[cut], raw, T[few], R[few], BOARD, gyro_followed=own)


@pytest.fixture(scope="module")
def theirs():
    """(n, 3, 13) attitude that the simulator's EKF reports, per unit of each error."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(attitude, "SMOOTHING", SHOWN_S)
        return np.stack([their_own(j) for j in range(ERRORS)], axis=-1)


def their_own(j):
    """(n, 3) of one error, after a minute of rest; a fix each fifth step."""
    R, a = attitudes(), np.pad(motion(), [(0, 0), (0, 1)])
    f, w = felt(R), rates(R)
    v = np.cumsum(a, axis=0) * STEP
    scale, beta, turns, arm = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    late = SMALL if j in LATENESS else 0.0
    for array, columns in (
        (scale, SCALE),
        (beta, BETA),
        (turns, GYRO_SCALE),
        (arm, ANTENNA),
    ):
        if j in columns:
            array[columns.index(j)] = SMALL
    ekf = attitude.AttitudeFilter()
    out = np.zeros((len(T), 3))
    for k in range(len(T) - 1):
        wrong = BOARD @ (scale * (BOARD.T @ f[k]) + beta)
        if k == 0:
            ekf.align(R[0], wrong, 0.0)
        ekf.predict(0.5 * (R[k] + R[k + 1]), np.append(a[k, :2], -G), wrong, turns * w[k])
        if k % 5 == 0:
            swing = np.cross(0.5 * (w[k] + w[max(k - 1, 0)]), arm)
            ekf.fuse_gps(R[k] @ swing - late * a[k], (R[k] - R[0]) @ arm - late * v[k])
            ekf.fuse_heading(0.0)
        out[k + 1] = ekf.phi / SMALL
    return out


def ours(segment, t, before=None):
    """(k, 3, 13)"""
    times, told = autopilot_attitude.followed(segment, before or {})[autopilot_attitude.TILTED]
    return np.stack([np.interp(t, times, x) for x in told.T], axis=-1).reshape(-1, 3, ERRORS)


@pytest.mark.parametrize("every", [2, 6])
@pytest.mark.parametrize("j", range(ERRORS))
def test_an_error_tilts_it_as_far_as_another_ekf(theirs, j, every):
    at = np.arange(5.0, 58.0, 0.5)
    got = ours(segment_of(0.0, 60.0, every), at)[..., j]
    want = np.stack([np.interp(at, T, x) for x in theirs[..., j].T], axis=-1)
    size = np.abs(want).max()
    assert size > 1e-3
    assert np.sqrt(np.mean((got - want) ** 2)) < 0.06 * np.sqrt(np.mean(want**2)) + 1e-4


def test_it_goes_on_from_segment_to_segment():
    at = np.array([22.0, 25.0, 30.0, 38.0])
    whole = ours(segment_of(0.0, 60.0), at)
    before = autopilot_attitude.followed(segment_of(0.0, 22.0), {})
    after = segment_of(20.0, 40.0)
    np.testing.assert_allclose(ours(after, at, before), whole, atol=2e-3)
    assert np.abs(ours(after, at) - whole).max() > 0.02


def test_over_a_pause_it_goes_on_with_what_it_has_learned():
    """Levelled at rest it would be tilted by an offset, which it has learned in the air."""
    before = autopilot_attitude.followed(segment_of(0.0, 15.0), {})
    at = np.arange(20.5, 34.0, 0.5)
    want = ours(segment_of(0.0, 60.0), at)
    on, anew = ours(segment_of(20.0, 40.0), at, before), ours(segment_of(20.0, 40.0), at)
    force = [*SCALE, *BETA]
    left, all_of_it = (np.abs(x - want)[..., force].max(axis=(0, 1)) for x in (on, anew))
    assert np.all(left < 0.2 * all_of_it)


@pytest.mark.parametrize(("flying", "pause"), [(True, 5.0), (False, 5.0), (True, 90.0)])
def test_a_pause_in_the_air_is_none_of_the_ekf(flying, pause):
    """On the ground, or for long, it has been levelled anew."""
    speed = 8.0 if flying else 1.0
    first, second = batch_of(0.0, 20.0), batch_of(20.0, 40.0)
    fixes = [replace(b.fixes, v_n=b.fixes.v_n + speed) for b in (first, second)]
    (flown,) = autopilot_attitude.along([], [replace(first, fixes=fixes[0])])
    t = second.segment.t
    later = replace(second.segment, t=t + pause, t_attitude=second.segment.t_attitude + pause)
    after = replace(second, segment=later, fixes=fixes[1], fresh=True)
    (goes_on,), (rested,) = (autopilot_attitude.along([], [after], x) for x in ([flown], []))
    got, anew = (b.segment.slow[autopilot_attitude.TILTED][1] for b in (goes_on, rested))
    assert np.array_equal(got, anew) is not (flying and pause < SETTLED_S)


def test_a_gap_in_the_attitudes_is_forgotten():
    """Its samples go on: some seconds later all is as if there had been none."""
    segment, at = segment_of(0.0, 60.0), np.array([45.0, 50.0, 55.0])
    kept = (segment.t_attitude < 20.0) | (segment.t_attitude > 25.0)
    gone = replace(
        segment, t_attitude=segment.t_attitude[kept], R_attitude=segment.R_attitude[kept]
    )
    want = ours(segment, at)
    assert np.abs(ours(gone, at) - want).max() < 0.1 * np.abs(want).max()


def test_levelled_at_rest_it_tilts_by_the_offset_and_learns_the_one_along_gravity():
    R = np.broadcast_to(np.eye(3), (len(T), 3, 3))
    still = Segment(
        T, np.zeros((len(T), 3)), np.tile([0.0, 0.0, -G], (len(T), 1)), T[::2], R[::2], np.eye(3)
    )
    got = ours(still, np.array([1.0, 30.0]))
    x, y, z = (got[..., j] for j in BETA)
    np.testing.assert_allclose(x[:, 1], 1.0 / G, rtol=0.05)
    np.testing.assert_allclose(y[:, 0], -1.0 / G, rtol=0.05)
    assert np.abs(z).max() < 1e-9
    others = [
        *LATENESS,
        *GYRO_SCALE,
        *ANTENNA,
        SCALE[0],
        SCALE[1],
    ]
    assert np.abs(got[..., others]).max() < 1e-9


def test_a_segment_without_attitudes_shows_nothing():
    few = segment_of(10.0, 10.2, every=10)
    assert autopilot_attitude.followed(few, {}) == {}
    maker = NodeMaker(segment_of(0.0, 20.0), np.zeros(3), np.repeat([1.0, 0.0], 3))
    assert EkfSensors().attitude(around(maker, np.array([5.0]))).ned is None


@pytest.mark.parametrize("own", [True, False])
def test_families_have_their_columns_of_it(own):
    """The gyroscope's only where the attitude is turned by it."""
    model = Model([GyroScale(), EkfSensors()])
    segment = segment_of(0.0, 40.0, own=own)
    made = replace(segment, slow=autopilot_attitude.followed(segment, {}))
    epochs = np.array([15.0, 15.2, 15.4])
    maker = NodeMaker(made, np.zeros(3), np.repeat([1.0, 0.0], 3))
    got = model.regressors(maker.intervals(epochs[:-1], epochs[1:]), around(maker, epochs))
    want = ours(segment, epochs)
    np.testing.assert_allclose(got.attitude_ned[..., :3], own * want[..., GYRO_SCALE], atol=1e-6)
    np.testing.assert_allclose(got.attitude_ned[..., 3:], want[..., TOLD], atol=1e-6)
    assert not got.attitude_body.any()


def batch_of(start, end):
    """A batch of flight with a fix each second; its samples reach over them."""
    t = np.arange(start + 1.2, end - 0.8, 1.0)
    fixes = Fixes(t, np.zeros((len(t), 3)), np.zeros(len(t)), np.zeros(len(t)))
    return Batch(segment_of(start, end), fixes, np.ones(len(t), dtype=bool), fresh=start == 0.0)


def test_a_flight_is_followed_batch_by_batch():
    """As one segment would be; a batch is not gone through again unless its attitudes change."""
    parts = [batch_of(0.0, 22.0), batch_of(20.0, 42.0), batch_of(40.0, 60.0)]
    run: list[Batch] = []
    for k, part in enumerate(parts):
        known = run
        run = autopilot_attitude.along(known, [*known, part])
        assert all(a is b for a, b in zip(run[: k - 1], known[: k - 1], strict=True))
    at = np.array([5.0, 15.0])
    for batch, start in zip(run, (0.0, 20.0, 40.0), strict=True):
        told = batch.segment.slow[autopilot_attitude.TILTED]
        got = np.stack([np.interp(start + at, told[0], x) for x in told[1].T], axis=-1)
        want = ours(segment_of(0.0, 60.0), start + at).reshape(2, -1)
        np.testing.assert_allclose(got, want, atol=2e-3)
    assert [autopilot_attitude.STATES in b.segment.slow for b in run] == [False, False, True]
    turned = replace(run[0], segment=replace(run[0].segment, R_attitude=attitudes()[::2] @ BOARD))
    again = autopilot_attitude.along(run, [turned, *run[1:]])
    assert (
        again[0].segment.slow[autopilot_attitude.TILTED][1].shape
        == run[0].segment.slow[autopilot_attitude.TILTED][1].shape
    )
    assert (
        np.abs(
            again[0].segment.slow[autopilot_attitude.TILTED][1]
            - run[0].segment.slow[autopilot_attitude.TILTED][1]
        ).max()
        > 0.01
    )
