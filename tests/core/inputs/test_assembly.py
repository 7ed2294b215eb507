"""The cutting of batches, against a search through every sample and every fix."""

import itertools

import numpy as np
import pytest

from onboard.core.inputs.assembly import Assembly, AssemblySettings
from onboard.core.inputs.gaps import beside_gaps, mean_step
from onboard.core.inputs.limits import (
    ATTITUDE_MARGIN_S,
    EVEN_MARGIN_S,
    IMU_GAP_S,
)
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.reach import FAR, NEAR
from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample

RATE, FIXES = 50.0, 5.0


def times(seed, end, rate, holes):
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, end, 1.0 / rate) + 0.2 / rate * rng.uniform(size=int(end * rate))
    return t[~np.any([(t > a) & (t < b) for a, b in holes], axis=0)] if holes else t


def fix(t):
    return GpsFix(
        t=t,
        receiver=1,
        fix_type=3,
        latitude=0.8,
        longitude=0.1,
        altitude=100.0,
        v_n=10.0,
        v_e=0.0,
        v_d=0.0,
    )


def flown(end=60.0, holes=(), doubted=(), batch_s=10.0, rate=FIXES):
    """Batches of one accelerometer, in order, and the times of samples and of fixes."""
    assembly, parameters = Assembly(AssemblySettings(batch_s=batch_s)), ParametersInForce()
    imu, gps = times(1, end, RATE, holes), np.arange(0.1, end, 1.0 / rate)
    merged = sorted([(t, 0) for t in imu] + [(t, 1) for t in imu] + [(t, 2) for t in gps])
    out = []
    for t, kind in merged:
        if kind == 0:
            force, rate = (0.0, 0.0, -9.8 + 0.01 * np.sin(t)), (0.1 * np.sin(t), 0.0, 0.3)
            assembly.streams.imu(ImuSample(t, 1, force, rate), parameters)
        elif kind == 1:
            assembly.streams.attitude(AttitudeSample(t, 0.01, 0.0, 0.3 * t))
        else:
            trusted = not any(a <= t <= b for a, b in doubted)
            assembly.streams.fixes.add(fix(t), trusted=trusted)
            out += assembly.take(parameters).get(1, [])
    out += assembly.take(parameters, everything=True).get(1, [])
    return out, imu, gps, parameters.imu_delay


CASES = [
    {},
    {"holes": ((20.0, 21.0),)},
    {"holes": ((9.9, 10.4), (30.0, 34.0), (34.3, 34.6))},
    {"doubted": ((0.0, 5.0), (25.0, 40.0))},
    {"holes": ((22.0, 23.0),), "doubted": ((20.0, 30.0),)},
    {"batch_s": 3.0, "holes": ((20.0, 21.0),)},
    {"rate": 1.0},
    {"rate": 0.7, "holes": ((20.0, 21.0),)},
    {"rate": 1.0, "doubted": ((0.0, 5.0), (25.0, 40.0))},
]


def reach(rate=FIXES, **_):
    """Slow fixes have their neighbours looked at."""
    return FAR if 1.0 / rate > NEAR.around else NEAR


@pytest.mark.parametrize("case", CASES)
def test_a_batch_has_every_sample_that_its_fixes_need(case):
    batches, imu, _, delay = flown(**case)
    need = reach(**case)
    assert batches
    for batch in batches:
        t = batch.segment.t
        assert np.diff(t).max() <= IMU_GAP_S
        needed = imu - delay
        first, last = batch.fixes.t[0] - need.before, batch.fixes.t[-1] + need.ahead
        wanted = needed[(needed >= first) & (needed < last)]
        assert np.all(np.isin(wanted[wanted <= t[-1]], t))
        assert t[0] <= batch.fixes.t[0] - need.before + 0.1 + 1.0 / RATE


@pytest.mark.parametrize("case", CASES)
def test_a_batch_has_the_attitudes_around_its_samples_and_hardly_more(case):
    batches, imu, _, _ = flown(**case)
    for batch in batches:
        t, t_attitude = batch.segment.t, batch.segment.t_attitude
        asked = imu[(imu >= t[0] - ATTITUDE_MARGIN_S) & (imu <= t[-1] + ATTITUDE_MARGIN_S)]
        assert np.all(np.isin(asked, t_attitude))
        assert len(t_attitude) <= len(asked) + 2
        assert len(batch.segment.R_attitude) == len(t_attitude)


@pytest.mark.parametrize("case", CASES)
def test_each_interval_between_fixes_is_handed_out_once(case):
    batches, *_ = flown(**case)
    edges = [
        (float(a), float(b))
        for x in batches
        for a, b in zip(x.fixes.t, x.fixes.t[1:], strict=False)
    ]
    assert len(edges) == len(set(edges))
    assert all(a[1] <= b[0] + 1e-9 for a, b in itertools.pairwise(edges))


@pytest.mark.parametrize("case", CASES)
def test_a_batch_is_fresh_exactly_where_it_does_not_continue(case):
    batches, *_ = flown(**case)
    end = None
    for batch in batches:
        assert batch.fresh is (end is None or float(batch.fixes.t[0]) != end)
        if batch.fresh:
            assert batch.trusted[0], "a filter starts at a fix that is believed"
        end = float(batch.fixes.t[-1])


@pytest.mark.parametrize("holes", [(), ((20.0, 21.0),), ((30.0, 34.0), (44.0, 44.2))])
@pytest.mark.parametrize("rate", [FIXES, 1.0])
def test_a_fix_is_used_exactly_if_samples_without_a_gap_are_around_it(holes, rate):
    """Brute force: walk from each fix to either side until a gap or the need is met."""
    batches, imu, gps, delay = flown(holes=holes, batch_s=1e9, rate=rate)
    need = reach(rate)
    used = np.concatenate([x.fixes.t for x in batches])
    t = imu - delay
    for at in gps:
        before, after = t[t <= at][::-1], t[t > at]
        reached = covered(at, before, -1.0), covered(at, after, 1.0)
        # The first fixes wait for an attitude that is old enough.
        known = at >= imu[0] + need.before
        enough = reached[0] >= need.before - 0.1 and reached[1] >= need.after + 0.02 and known
        clear = reached[0] < need.before - 0.15 or reached[1] < need.after - 0.02 or not known
        if enough and at <= t[-1] - need.ahead - 0.1:
            assert np.any(np.abs(used - at) < 1e-6), at
        elif clear:
            assert not np.any(np.abs(used - at) < 1e-6), at


def covered(at, samples, sign):
    """How far samples reach from ``at`` without a gap, s."""
    last = at
    for s in samples:
        if abs(s - last) > IMU_GAP_S:
            break
        last = s
    return sign * (last - at)


def test_nothing_of_standing_is_handed_out():
    assembly, parameters = Assembly(AssemblySettings()), ParametersInForce()
    for t in np.arange(0.0, 30.0, 0.02):
        assembly.streams.imu(ImuSample(t, 1, (0.0, 0.0, -9.8), (0.0, 0.0, 0.0)), parameters)
        assembly.streams.attitude(AttitudeSample(t, 0.01, 0.0, 0.0))
    for t in np.arange(0.1, 29.0, 0.2):
        assembly.streams.fixes.add(fix(t), trusted=True)
    assert assembly.take(parameters, everything=True, grounded=True) == {}
    assert assembly.standing_s == pytest.approx(28.8, abs=0.21)


@pytest.mark.parametrize(("step", "mean"), [(0.02, 0.02), (1.0, np.inf)])
def test_a_clock_that_begins_anew_makes_no_stream_fast(step, mean):
    """Telemetry at 1 Hz of a vehicle that was rebooted was told as one on the ground."""
    boots = [np.arange(begin, begin + 50.0, step) for begin in (100.0, 3.0, 40.0)]
    assert mean_step(np.concatenate(boots)) == pytest.approx(mean)


def test_fixes_beside_gaps_are_those_that_lack_a_sample():
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 60.0, 0.02)
    t = t[~np.any([(t > a) & (t < a + 0.6) for a in (7.3, 20.0, 20.9, 41.5)], axis=0)]
    epochs = np.sort(rng.uniform(3.0, 57.0, 400))
    gaps = [(a, b) for a, b in itertools.pairwise(t.tolist()) if b - a > IMU_GAP_S]
    for reach in (NEAR, FAR):
        lost = [
            any(a < x + reach.after and b > x - reach.before + EVEN_MARGIN_S for a, b in gaps)
            for x in epochs
        ]
        assert beside_gaps(t, epochs, reach).tolist() == lost
        assert any(lost)
        assert not all(lost)
    assert not beside_gaps(t[:300], epochs, NEAR).any()  # of what comes later it is not known
