"""What the autopilot turns its heading by and its gyroscope does not is taken out of it."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.core.inputs.reported_attitude import ReportedAttitude
from onboard.core.inputs.segments import STEADY_THROTTLE, Batch, Fixes, Segment
from onboard.core.inputs.steady_heading import SteadyHeading, Turns
from onboard.core.maths.frames import euler_from_rotation, rotation_from_euler

LENGTH_S, MARGIN_S, IMU_HZ, ATTITUDE_HZ = 60.0, 0.7, 50.0, 10.0


def yaw(t):
    """True heading, rad: turns both ways, at up to 1 rad/s."""
    return 0.8 * np.sin(0.5 * t) + np.sin(0.6 * t + 1.0)


def roll(t):
    return 0.3 + 0.15 * np.sin(1.7 * t)


def rolling(t):
    return 0.255 * np.cos(1.7 * t)


def turning(t):
    return 0.4 * np.cos(0.5 * t) + 0.6 * np.cos(0.6 * t + 1.0)


def cut(error, borders, *, bias=0.0, reported=True, late=0.0, throttle=None):
    """Batches of a flight whose recorded heading errs by ``error(t)``, rad, as recorded.

    All of the attitude is ``late``, s.  Of ``throttle(t)`` there are four samples a second.
    """
    out = []
    for first, last in itertools.pairwise(borders):
        t = np.arange(first - MARGIN_S, last + MARGIN_S, 1.0 / IMU_HZ)
        at = np.arange(np.ceil((first - MARGIN_S) * ATTITUDE_HZ), (last + MARGIN_S) * ATTITUDE_HZ)
        at = at / ATTITUDE_HZ
        then = at - late
        angles = np.stack([roll(then), np.zeros(len(at)), yaw(then) + error(at)], axis=1)
        recorded = ReportedAttitude(angles, (0.0, 0.0, 0.0))
        # About a vertical that is rolled in the body.
        by = turning(t) + bias
        w_b = np.stack([rolling(t), by * np.sin(roll(t)), by * np.cos(roll(t))], axis=1)
        fixes = np.round(np.arange(first, last + 0.01, 0.2), 6)
        n = len(fixes)
        segment = Segment(
            t, w_b, np.zeros((len(t), 3)), at, recorded if reported else recorded[:], np.eye(3)
        )
        if throttle is not None:
            sampled = np.arange(np.ceil(4.0 * at[0]), 4.0 * at[-1] + 1.0) / 4.0
            segment = segment.with_slow({"throttle": (sampled, throttle(sampled))})
        none = np.zeros(n)
        out.append(
            Batch(
                segment,
                Fixes(fixes, np.zeros((n, 3)), none, none),
                np.ones(n, dtype=bool),
                fresh=not out,
            )
        )
    return out


def joined(batches):
    heading, run = SteadyHeading(), []
    for batch in batches:
        run = heading.joined([] if batch.fresh else run, batch)
    return run


def left(run):
    """Error of every heading of a flight, rad, with its time."""
    t = np.concatenate([b.segment.t_attitude for b in run])
    found = np.concatenate([euler_from_rotation(b.segment.R_attitude[:])[2] for b in run])
    return t, (found - yaw(t) + np.pi) % (2.0 * np.pi) - np.pi


TENS = tuple(np.arange(0.0, LENGTH_S + 1.0, 10.0))
EVENTS = {
    "set right soon": lambda t: np.where(t < 12.0, 1.2, 0.0),
    "set right past half a turn": lambda t: np.where(t < 17.0, -2.9, 0.0),
    "set wrong and right": lambda t: np.where((t > 24.0) & (t < 41.0), 0.7, 0.0),
    "pulled over for two seconds": lambda t: np.clip(0.5 * (t - 40.0), 0.0, 1.0),
    "pulled over and back": lambda t: (
        np.clip(0.4 * (t - 20.0), 0.0, 1.0) - np.clip(0.4 * (t - 28.0), 0.0, 1.0)
    ),
    "set anew between two batches": lambda t: np.where(t < 20.05, 0.6, 0.0),
}


@pytest.mark.parametrize("name", EVENTS)
@pytest.mark.parametrize("reported", [True, False], ids=["angles", "matrices"])
def test_the_heading_that_was_held_for_longest_is_the_right_one(name, reported):
    run = joined(cut(EVENTS[name], TENS, reported=reported))
    _, error = left(run)
    # What is seen of a pull is what is faster than a gyroscope's errors, sample for sample.
    assert np.abs(error).max() < 0.01


def throttle(t):
    """Goes up and down at all rates; what is pulled by it only part of the time is quick."""
    return 0.5 + 0.2 * np.sin(0.9 * t) + 0.15 * np.sin(1.3 * t * (1.0 + t / 100.0))


@pytest.mark.parametrize("pull", [-0.35, 0.3, 0.7])
@pytest.mark.parametrize("borders", [TENS, (0.0, 13.4, 20.2, 33.6, LENGTH_S)], ids=["tens", "odd"])
def test_what_is_taken_out_of_the_throttle_is_what_pulled_the_heading(pull, borders):
    run = joined(cut(lambda t: pull * throttle(t), borders, throttle=throttle))
    off = []
    for batch in run:
        slow = batch.segment.slow
        at, steady = slow.get(STEADY_THROTTLE, slow["throttle"])
        t, error = left([batch])
        off.append((error - pull * np.interp(t, at, steady))[(t > at[0]) & (t < at[-1])])
    # Between four samples a second the throttle is not quite straight.
    assert bool(np.concatenate(off).std() < 0.01 * abs(pull))
    assert bool(np.abs(np.diff([each.mean() for each in off])).max() < 0.02 * abs(pull))


@pytest.mark.parametrize("late", [-0.12, 0.06, 0.21])
def test_an_attitude_that_is_late_is_not_pulled(late):
    run = joined(cut(lambda t: 0.0 * t, TENS, late=late))
    t, error = left(run)
    assert float(np.abs(error - yaw(t - late) + yaw(t)).max()) < 0.02


@pytest.mark.parametrize("late", [0.1, 0.2])
def test_what_is_pulled_besides_being_late_is_taken_out(late):
    run = joined(cut(EVENTS["set wrong and right"], TENS, late=late))
    t, error = left(run)
    assert float(np.abs(error - yaw(t - late) + yaw(t)).max()) < 0.02


def test_a_heading_that_errs_slowly_is_left_as_it_was():
    slowly = cut(lambda t: 0.2 * np.sin(0.3 * t), TENS, bias=0.02)
    run = joined(slowly)
    assert all(after is before for after, before in zip(run, slowly, strict=True))


def test_quick_turns_of_a_gyroscope_that_is_off_are_no_pulls():
    """A scale of 2 %, stamps off by two milliseconds, and a tenth of the samples: all at once."""

    def rolled(t, late):
        return 6.0 * np.sin(2.0 * np.pi * 0.7 * (t - late)) / (2.0 * np.pi * 0.7)

    rng = np.random.default_rng(3)
    t = np.arange(0.0, 30.0, 0.01)
    at = np.arange(1.0, 29.0, 0.04)
    zero, ahead = np.zeros(len(at)), np.full(len(at), 0.5)
    angles = np.stack([rolled(at, 1e-3 * rng.uniform(-1.0, 1.0, len(at))), ahead, zero], axis=1)
    rate = 1.02 * 6.0 * np.cos(2.0 * np.pi * 0.7 * t)
    w_b = np.stack([rate, np.zeros(len(t)), np.zeros(len(t))], axis=1)
    for each in (1, 10):
        segment = Segment(
            t[::each],
            w_b[::each],
            np.zeros((len(t[::each]), 3)),
            at,
            ReportedAttitude(angles, (0.0, 0.0, 0.0)),
            np.eye(3),
        )
        assert not Turns(segment).steps(0.0).pulled.any()


@given(st.lists(st.floats(2.0, 58.0), min_size=1, max_size=5, unique=True))
@settings(max_examples=20, deadline=None)
def test_how_flight_is_cut_does_not_matter(borders):
    """Fixes are 0.2 s apart, so are borders."""
    places = sorted({round(5.0 * b) / 5.0 for b in borders})
    places = [b for a, b in zip([0.0, *places], places, strict=False) if b - a > 1.0]
    error = EVENTS["pulled over and back"]
    whole = joined(cut(error, (0.0, LENGTH_S)))[0].segment
    for batch in joined(cut(error, (0.0, *places, LENGTH_S))):
        t = batch.segment.t_attitude
        there = np.searchsorted(whole.t_attitude, t - 1e-6)
        np.testing.assert_allclose(
            batch.segment.R_attitude[:], whole.R_attitude[:][there], atol=1e-4
        )


def test_another_flight_begins_anew():
    first = cut(EVENTS["set right soon"], TENS)
    heading = SteadyHeading()
    run = []
    for batch in first:
        run = heading.joined(run, batch)
    alone = replace(first[-1], fresh=True)
    assert heading.joined([], alone) == [alone]


def test_axes_are_turned_about_the_vertical_alone():
    recorded = cut(EVENTS["set right soon"], TENS)
    for before, after in zip(recorded, joined(recorded), strict=True):
        R, turned = before.segment.R_attitude[:], after.segment.R_attitude[:]
        by = turned @ np.swapaxes(R, -1, -2)
        about = rotation_from_euler(0.0, 0.0, np.arctan2(by[:, 1, 0], by[:, 0, 0]))
        np.testing.assert_allclose(by, about, atol=1e-12)
        assert after.fixes is before.fixes
        assert after.segment.w_b is before.segment.w_b
