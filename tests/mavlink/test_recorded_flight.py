"""Codec and decoder on a flight recorded from ArduPilot SITL, which knows better than we do."""

from __future__ import annotations

import bisect

import pytest

from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample, ImuSource
from onboard.mavlink.codec import Codec
from onboard.mavlink.decode import Decoder


@pytest.fixture(scope="module")
def samples(recordings):
    data = (recordings / "sitl" / "c01.tlog").read_bytes()[: 1 << 21]
    codec, decoder, out, at = Codec(), Decoder(), [], 0
    while at + 10 < len(data):
        length = data[at + 9] + 12
        for frame in codec.feed(data[at + 8 : at + 8 + length]):
            out.extend(decoder.decode(frame.message))
        at += 8 + length
    assert codec.statistics.bad_bytes == 0
    assert decoder.clock.reboots == 0
    return out


def imu(samples, source):
    return {s.t: s for s in samples if isinstance(s, ImuSample) and s.source is source}


def test_raw_imu_is_highres_imu_truncated_toward_zero(samples):
    exact, coarse = imu(samples, ImuSource.HIGHRES_IMU), imu(samples, ImuSource.RAW_IMU)
    together = exact.keys() & coarse.keys()
    assert len(together) > 1000
    for t in together:
        for a, b in zip(exact[t].f_b, coarse[t].f_b, strict=True):
            assert abs(b) <= abs(a) + 1e-4
            assert abs(a - b) < coarse[t].f_step + 1e-4
        for a, b in zip(exact[t].w_b, coarse[t].w_b, strict=True):
            assert abs(a - b) < coarse[t].w_step + 1e-6


def test_both_accelerometers_feel_one_gravity(samples):
    """On the ground, to the errors that the simulated sensors have (a few percent)."""
    for source in (ImuSource.RAW_IMU, ImuSource.SCALED_IMU):
        early = [s for s in imu(samples, source).values() if s.t < 15.0]
        mean = [sum(s.f_b[axis] for s in early) / len(early) for axis in range(3)]
        assert mean[2] == pytest.approx(-9.80665, rel=0.06)
        assert all(abs(x) < 0.6 for x in mean[:2])


def test_fixes_are_older_than_the_attitude_that_arrives_with_them(samples):
    latest, ages = 0.0, []
    for sample in samples:
        if isinstance(sample, AttitudeSample):
            latest = sample.t
        elif isinstance(sample, GpsFix) and sample.fix_type >= 3 and latest:
            ages.append(latest - sample.t)
    ages.sort()
    assert 0.0 < ages[len(ages) // 2] < 0.5
    assert bisect.bisect(ages, 1.0) == len(ages)
