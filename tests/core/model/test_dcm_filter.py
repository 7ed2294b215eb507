"""What DCM makes of errors of its sensors, against one that goes through the flight with them."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.inputs.reported_attitude import ReportedAttitude
from onboard.core.inputs.segments import Segment
from onboard.core.maths.earth import STANDARD_GRAVITY as G
from onboard.core.maths.frames import rotation_from_vector, vector_from_rotation
from onboard.core.model import autopilot_attitude
from onboard.core.model.dcm_filter import Dcm
from onboard.core.model.ekf3_filter import Ekf3
from onboard.core.model.sensor_errors import (
    ANTENNA,
    BETA,
    ERRORS,
    GYRO_SCALE,
    LATENESS,
    SCALE,
    Steps,
)

STEP = 0.02
T = np.arange(0.0, 80.0 + STEP / 2, STEP)
FIX = 5
"""Steps from one fix to the next."""
BOARD = rotation_from_vector(np.array([0.2, 0.4, -0.9]))
GAIN = 0.3
SMALL = 1e-3


def flown():
    """Velocity (n, 3) NED and attitude (n, 3, 3): a copter that leans into it and turns."""
    moving = T**4 / (T**4 + 30.0)
    v = np.stack([3.0 * np.sin(0.5 * T), 2.0 * np.cos(0.35 * T) - 2.0, 0.0 * T], axis=-1)
    v *= moving[:, None]
    a = np.gradient(v, T, axis=0)
    nose = 0.4 + moving * (1.5 * np.sin(0.11 * T) + 0.5 * np.sin(0.9 * T))
    lean = rotation_from_vector(np.stack([a[:, 1] / G, -a[:, 0] / G, 0.0 * T], axis=-1))
    return v, a, lean @ rotation_from_vector(np.stack([0.0 * T, 0.0 * T, nose], axis=-1))


def felt():
    """Force and angular rate, (n, 3), body; the rate is of the step from each to the next."""
    _, a, R = flown()
    f = np.einsum("nji,nj->ni", R, a - [0.0, 0.0, G])
    turn = vector_from_rotation(np.swapaxes(R[:-1], -1, -2) @ R[1:]) / STEP
    return f, np.vstack([turn, turn[-1:]])


def reported(j=None):
    """(n, 3, 3) by a DCM, of which one sensor errs: all of it, sines and lengths included."""
    v, a, R_true = flown()
    f, w = felt()
    size = dict.fromkeys(range(ERRORS), 0.0)
    if j is not None:
        size[j] = SMALL
    vectors = (np.array([size[k] for k in columns]) for columns in (SCALE, BETA, ANTENNA))
    scale, beta, arm = vectors
    w_read = w * (1.0 + np.array([size[k] for k in GYRO_SCALE]))
    f_read = f + ((f @ BOARD) * scale + beta) @ BOARD.T
    swing = np.einsum("nij,nj->ni", R_true, np.cross(w, arm))
    told = v + swing - size[LATENESS[0]] * a
    level = beta @ BOARD.T + ((f[0] @ BOARD) * scale) @ BOARD.T
    start = np.array([-level[1] / G, level[0] / G, 0.0])
    R, w_I, w_P = rotation_from_vector(R_true[0] @ start) @ R_true[0], np.zeros(3), np.zeros(3)
    gained, last, out = np.zeros(3), told[0], [R]
    for k in range(len(T) - 1):
        gained = gained + R @ (0.5 * (f_read[k] + f_read[k + 1])) * STEP
        R = R @ rotation_from_vector((w_read[k] + w_P + w_I) * STEP)
        off = np.arctan2(R_true[k + 1][1, 0], R_true[k + 1][0, 0]) - np.arctan2(R[1, 0], R[0, 0])
        R = rotation_from_vector(np.array([0.0, 0.0, np.sin(off) * 0.2 * STEP])) @ R
        if (k + 1) % FIX == 0:
            asked = (told[k + 1] - last) / (FIX * STEP) - [0.0, 0.0, G]
            apart = np.cross(gained / np.linalg.norm(gained), asked / np.linalg.norm(asked))
            apart[2] *= abs(np.sin(np.arctan2(R[2, 1], R[2, 2])))
            body = R.T @ apart
            spin = np.linalg.norm(w[k])
            w_P = body * GAIN * np.clip(spin / np.deg2rad(50.0), 1.0, 10.0)
            w_I = w_I + body * 0.0087 * FIX * STEP * (spin < np.deg2rad(20.0))
            gained, last = np.zeros(3), told[k + 1]
        out.append(R)
    return np.stack(out)


@pytest.fixture(scope="module")
def right():
    """With sensors that are right."""
    return reported()


def segment_of(R):
    """Its samples, and an attitude ten times a second."""
    f, w = felt()
    w = np.vstack([w[:1], 0.5 * (w[1:] + w[:-1])])
    few = slice(0, None, 5)
    return Segment(T, w, f @ BOARD, T[few], R[few], BOARD)


def ours(steps, first):
    """(n + 1, 3, m)"""
    by = Dcm(GAIN)
    nose = np.arctan2(first[1, 0], first[0, 0])
    states = by.headed(by.at_rest(BOARD), rotation_from_vector(np.array([0.0, 0.0, nose])))
    return by.through(steps, states, [len(steps.h)])[0].reshape(-1, 3, ERRORS)


@pytest.mark.parametrize("j", range(ERRORS))
def test_an_error_tilts_it_as_far_as_it_does_one_that_flies_with_it(right, j):
    segment = segment_of(right)
    t = segment.t_attitude
    got = ours(Steps.between(segment, t, segment.R_attitude), right[0])[..., j]
    off = vector_from_rotation(reported(j) @ np.swapaxes(right, -1, -2)) / SMALL
    want = off[::5]
    size = np.sqrt(np.mean(want[:, :2] ** 2))
    assert size > 1e-3
    assert np.sqrt(np.mean((got - want)[:, :2] ** 2)) < 0.06 * size


def test_an_offset_tilts_it_for_good_where_an_ekf_learns_it():
    """At rest both are tilted; an EKF that turns its nose has learned it after two minutes."""
    n = 1200
    turn = np.zeros((n, 3))
    turn[300:600, 2] = 0.01
    nose = np.concatenate([[0.0], np.cumsum(turn[:, 2])])
    R = rotation_from_vector(np.stack([0.0 * nose, 0.0 * nose, nose], axis=-1))
    force = np.tile([0.0, 0.0, -0.1 * G], (n, 1))
    steps = Steps(np.full(n, 0.1), 0.5 * (R[1:] + R[:-1]), turn, force, np.eye(3))
    left = {}
    for by in (Dcm(0.2), Ekf3()):
        attitude, _ = by.through(steps, by.at_rest(np.eye(3)), [n])
        both = attitude.reshape(n + 1, 3, ERRORS)[..., BETA[0]]
        np.testing.assert_allclose(np.linalg.norm(both[0, :2]), 1.0 / G, rtol=0.05)
        left[type(by)] = np.linalg.norm(both[-1, :2]) * G
    assert left[Dcm] == pytest.approx(1.0, abs=0.1)
    assert left[Ekf3] < 0.5


def test_it_goes_on_from_state_to_state(right):
    segment = segment_of(right)
    steps = Steps.between(segment, segment.t_attitude, segment.R_attitude)
    whole, (half, end) = Dcm(GAIN).through(steps, Dcm(GAIN).at_rest(BOARD), [400, 800])
    parts = [
        Steps(steps.h[cut], steps.R[cut], steps.turn[cut], steps.gained[cut], BOARD)
        for cut in (slice(400), slice(400, None))
    ]
    first, (between,) = Dcm(GAIN).through(parts[0], Dcm(GAIN).at_rest(BOARD), [400])
    second, (last,) = Dcm(GAIN).through(parts[1], between, [400])
    np.testing.assert_allclose(half, between, atol=1e-12)
    np.testing.assert_allclose(end, last, atol=1e-12)
    np.testing.assert_allclose(whole, np.concatenate([first, second[1:]]), atol=1e-12)


def test_it_is_followed_where_dcm_reports_the_attitude(right):
    segment = segment_of(right)
    angles = np.zeros((len(segment.t_attitude), 3))
    of_dcm, of_ekf = (
        replace(segment, R_attitude=ReportedAttitude(angles, (0.0, 0.0, 0.0), dcm_gain=gain))
        for gain in (0.1, None)
    )
    assert autopilot_attitude.filter_of(of_dcm) == Dcm(0.1)
    assert isinstance(autopilot_attitude.filter_of(of_ekf), Ekf3)
    dcm, ekf = (
        autopilot_attitude.followed(s, {})[autopilot_attitude.TILTED][1] for s in (of_dcm, of_ekf)
    )
    assert np.abs(dcm - ekf).max() > 0.01


@pytest.mark.parametrize("order", [(None, 0.2, None), (0.2, None, 0.2)])
def test_one_filter_goes_on_from_no_state_of_another(right, order):
    """AHRS_EKF_TYPE is changed in flight: what follows begins as one of which nothing is known."""
    whole = segment_of(right)
    angles = np.zeros((len(whole.t_attitude), 3))
    before = {}
    for start, gain in zip((0.0, 20.0, 40.0), order, strict=True):
        part = slice(*np.searchsorted(whole.t, [start, start + 25.0]))
        samples = {name: getattr(whole, name)[part] for name in ("t", "w_b", "raw_s")}
        attitude = ReportedAttitude(angles, (0.0, 0.0, 0.0), dcm_gain=gain)
        segment = replace(whole, R_attitude=attitude, **samples)
        told = autopilot_attitude.followed(segment, before)
        alone = autopilot_attitude.followed(segment, {})
        for name in (autopilot_attitude.TILTED, autopilot_attitude.STATES):
            np.testing.assert_array_equal(told[name][1], alone[name][1])
        before = told
