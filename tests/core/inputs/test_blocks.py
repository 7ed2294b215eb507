"""Samples that go through together leave what they leave one by one, whatever is among them."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.answers.recorded import Recorded
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.events import Advanced, Restarted
from onboard.core.inputs.samples import (
    AirData,
    AttitudeSample,
    EkfHealth,
    GpsFix,
    GpsIntegrity,
    ImuSample,
    ImuSource,
    ParameterValue,
    Sample,
    Throttle,
    VehicleState,
    Vibration,
)
from onboard.core.maths.accelerometer import parameter_names
from tests.core.inputs.in_blocks import block_of, differing, fed, in_blocks

NAN, INF = math.nan, math.inf
RADIUS = 6371000.0


def fix(t: float, receiver: int = 1) -> GpsFix:
    """Straight to the north, 10 m/s."""
    latitude = 0.8 + 10.0 * t / RADIUS
    return GpsFix(t, receiver, 3, latitude, 0.2, 100.0, 10.0, 0.0, satellites=12, hdop=0.8,
                  speed_accuracy=0.3, speed_step=0.01)  # fmt: skip


def flight(seconds: float = 36.0) -> list[Sample]:
    """Two accelerometers at 50 Hz, attitude at 25 Hz, fixes at 5 Hz and twice each, and others."""
    r = random.Random(4)
    out: list[Sample] = [VehicleState(20.0, armed=True, kind="copter")]
    for k in range(round(seconds * 50)):
        t = 20.0 + 0.02 * k
        for imu, source, late in ((1, ImuSource.RAW_IMU, 0.0), (2, ImuSource.SCALED_IMU, 0.0004)):
            f_b = (r.gauss(0.0, 2.0), r.gauss(0.0, 2.0), r.gauss(-9.8, 2.0))
            w_b = (r.gauss(0.0, 0.1), r.gauss(0.0, 0.1), r.gauss(0.0, 0.1))
            heat = 41.0 if imu == 1 else None
            out.append(ImuSample(t - late, imu, f_b, w_b, heat, 9.8e-3, 1e-3, source))
        if k % 2 == 0:
            angles = (r.gauss(0.0, 0.05), r.gauss(0.0, 0.05), 0.1)
            out.append(AttitudeSample(t - 0.001, *angles))
        if k % 5 == 0:
            out.append(fix(20.0 + 0.2 * (k // 10)))
        if k % 7 == 0:
            out += [Throttle(t, 0.5), AirData(t, airspeed=12.0)]
        if k % 20 == 0:
            out += [Vibration(t, (0.1, 0.2, 0.3), (0, 0, k)), EkfHealth(t, 0x33F)]
        if k % 50 == 0:
            out.append(VehicleState(t, armed=True, landed=False))
    return out


FLIGHT = flight()
SIX = dict(zip(parameter_names(1).six, (1.02, 0.98, 1.01, 0.1, -0.2, 0.3), strict=True))


def one_changed(samples: list[Sample], at: int, kind: type, **fields: object) -> list[Sample]:
    k = next((k for k in range(at, len(samples)) if isinstance(samples[k], kind)), None)
    if k is None:
        return samples
    return [*samples[:k], replace(samples[k], **fields), *samples[k + 1 :]]


def inserted(samples: list[Sample], at: int, *new: Sample) -> list[Sample]:
    return [*samples[:at], *new, *samples[at:]]


def later(samples: list[Sample], at: int, by: float, kinds: type = object) -> list[Sample]:
    return samples[:at] + [
        replace(s, t=s.t + by) if isinstance(s, kinds) and s.t is not None else s
        for s in samples[at:]
    ]


def time_at(samples: list[Sample], at: int) -> float:
    return next((s.t for s in samples[at:] if s.t is not None and math.isfinite(s.t)), 30.0)


def without(samples: list[Sample], at: int, kinds: type, seconds: float) -> list[Sample]:
    begin = time_at(samples, at)
    return [
        s
        for k, s in enumerate(samples)
        if not (k >= at and isinstance(s, kinds) and s.t <= begin + seconds)
    ]


def highres(
    samples: list[Sample], at: int, *, every: int = 1, seconds: float = 6.0, imu: int = 1
) -> list[Sample]:
    """The finer stream beside the coarser one, at the same times, for a while."""
    out, begin, count = samples[:at], time_at(samples, at), 0
    for s in samples[at:]:
        out.append(s)
        if isinstance(s, ImuSample) and s.imu == imu and s.t <= begin + seconds:
            count += 1
            if count % every == 0:
                fine = {"source": ImuSource.HIGHRES_IMU, "f_step": 0.0, "w_step": 0.0}
                out.append(replace(s, temperature=None, **fine))
    return out


def pulled(samples: list[Sample], at: int, force: float) -> list[Sample]:
    """An accelerometer feels so much for half a second, and then it goes to the east, too."""
    begin, out = time_at(samples, at), []
    for s in samples:
        if isinstance(s, ImuSample) and begin <= s.t < begin + 0.5:
            out.append(replace(s, f_b=(0.0, 0.0, -force)))
        elif isinstance(s, GpsFix) and s.t >= begin + 0.4:
            east = 12.0 * (s.t - begin - 0.3) / RADIUS / math.cos(s.latitude)
            out.append(replace(s, v_e=12.0, longitude=s.longitude + east))
        else:
            out.append(s)
    return out


CHANGES = {
    "reboot": lambda s, k: later(s, k, -time_at(s, k) + 1.0),
    "short reboot": lambda s, k: later(s, k, -4.0),
    "a step ahead": lambda s, k: later(s, k, 7.0),
    "held back": lambda s, k: later(s, k, -2.0),
    "one late": lambda s, k: one_changed(s, k, ImuSample, t=time_at(s, k) - 1.0),
    "one of another boot": lambda s, k: one_changed(s, k, ImuSample, t=2.0),
    "one far ahead": lambda s, k: one_changed(s, k, ImuSample, t=1e6),
    "one impossibly late": lambda s, k: one_changed(s, k, ImuSample, t=1e10),
    "no time": lambda s, k: one_changed(s, k, ImuSample, t=NAN),
    "repeated": lambda s, k: [*s[: k + 3], *s[k:]],
    "swapped": lambda s, k: [*s[:k], *s[k : k + 12][::-1], *s[k + 12 :]],
    "no force": lambda s, k: one_changed(s, k, ImuSample, f_b=(0.0, NAN, 1.0)),
    "no rate": lambda s, k: one_changed(s, k, ImuSample, w_b=(0.0, INF, 1.0)),
    "no gyroscope": lambda s, k: one_changed(s, k, ImuSample, w_b=None),
    "much force": lambda s, k: one_changed(s, k, ImuSample, f_b=(1e5, 0.0, 0.0)),
    "sixth": lambda s, k: one_changed(s, k, ImuSample, imu=6),
    "third": lambda s, k: one_changed(s, k, ImuSample, imu=3),
    "another source": lambda s, k: one_changed(s, k, ImuSample, source=ImuSource.SCALED_IMU),
    "another step": lambda s, k: one_changed(s, k, ImuSample, f_step=0.5),
    "no attitude": lambda s, k: one_changed(s, k, AttitudeSample, roll=NAN),
    "impossible attitude": lambda s, k: one_changed(s, k, AttitudeSample, roll=400.0),
    "zero attitude": lambda s, k: one_changed(s, k, AttitudeSample, roll=0.0, pitch=0.0, yaw=0.0),
    "attitude ahead": lambda s, k: one_changed(s, k, AttitudeSample, t=time_at(s, k) + 5.5),
    "attitude a bit ahead": lambda s, k: one_changed(s, k, AttitudeSample, t=time_at(s, k) + 4.5),
    "attitudes ahead": lambda s, k: later(s, k, 5.5, AttitudeSample),
    "late attitude": lambda s, k: one_changed(s, k, AttitudeSample, t=time_at(s, k) - 1.0),
    "fix of another clock": lambda s, k: one_changed(s, k, GpsFix, t=1e5),
    "late fix": lambda s, k: one_changed(s, k, GpsFix, t=time_at(s, k) - 3.0),
    "fix ahead": lambda s, k: one_changed(s, k, GpsFix, t=time_at(s, k) + 8.0),
    "bad fix": lambda s, k: one_changed(s, k, GpsFix, fix_type=1),
    "impossible fix": lambda s, k: one_changed(s, k, GpsFix, v_n=NAN),
    "no GPS": lambda s, k: without(s, k, GpsFix, 4.0),
    "GPS lost": lambda s, k: without(s, k, GpsFix, 100.0),
    "second receiver": lambda s, k: inserted(s, k, fix(time_at(s, k), 2)),
    "another receiver": lambda s, k: [
        replace(x, receiver=2) if isinstance(x, GpsFix) and i >= k else x for i, x in enumerate(s)
    ],
    "inertial gap": lambda s, k: without(s, k, ImuSample, 1.0),
    "attitude gap": lambda s, k: without(s, k, AttitudeSample, 7.0),
    "silence": lambda s, k: without(s, k, (ImuSample, AttitudeSample, GpsFix), 3.5),
    "one ends": lambda s, k: [
        x for i, x in enumerate(s) if not (i > k and isinstance(x, ImuSample) and x.imu == 2)
    ],
    "scale": lambda s, k: inserted(s, k, ParameterValue("INS_ACCSCAL_X", 1.05)),
    "no number": lambda s, k: inserted(s, k, ParameterValue("INS_ACCSCAL_X", NAN)),
    "all six": lambda s, k: inserted(s, k, *(ParameterValue(n, x) for n, x in SIX.items())),
    "orientation": lambda s, k: inserted(s, k, ParameterValue("AHRS_ORIENTATION", 2.0)),
    "to and fro": lambda s, k: inserted(
        s, k, *(ParameterValue("AHRS_ORIENTATION", x) for x in (2.0, 4.0, 0.0, 6.0, 0.0))
    ),
    "filter": lambda s, k: inserted(s, k, ParameterValue("INS_ACCEL_FILTER", 10.0)),
    "disarmed": lambda s, k: inserted(s, k, VehicleState(time_at(s, k), armed=False)),
    "landed": lambda s, k: inserted(s, k, VehicleState(time_at(s, k), landed=True)),
    "EKF": lambda s, k: inserted(s, k, EkfHealth(time_at(s, k), 1 << 15 | 1)),
    "spoofed": lambda s, k: inserted(s, k, GpsIntegrity(time_at(s, k), False, True)),
    "pulled": lambda s, k: pulled(s, k, 70.0),
    "thrown": lambda s, k: pulled(s, k, 12.0),
    "highres": highres,
    "highres of the second": lambda s, k: highres(s, k, imu=2),
    "slow highres": lambda s, k: highres(s, k, every=40),
    "some highres": lambda s, k: highres(s, k, every=20, seconds=0.5),
}


def assert_same(samples: list[Sample], size: int) -> int:
    """Fed both ways; how many samples went together."""
    alone, together = Recorded(watched=True), Recorded(watched=True)
    one_by_one, _ = fed(samples, alone)
    events, taken = fed(in_blocks(samples, size), together)
    assert not differing(alone, together)
    assert [repr(e) for e in events] == [repr(e) for e in one_by_one]
    return taken


def test_a_block_is_what_it_was_made_of():
    block = block_of(FLIGHT)
    assert list(block.samples()) == FLIGHT
    assert len(block) == len(FLIGHT)
    assert block.latest == max(s.t for s in FLIGHT)


@pytest.mark.parametrize("size", [7, 400, 10_000])
def test_an_ordinary_flight_goes_together(size):
    taken = assert_same(FLIGHT, size)
    # What begins a boot is looked at one by one.
    assert taken == (0 if size > len(FLIGHT) else pytest.approx(len(FLIGHT), abs=2 * size))
    recorded = Recorded()
    events, _ = fed(in_blocks(FLIGHT, size), recorded)
    assert sum(isinstance(event, Advanced) for event in events) >= 2
    assert recorded.calibrator.imus == (1, 2)


@pytest.mark.parametrize(("force", "glitches"), [(70.0, False), (12.0, True)])
def test_a_velocity_jumps_if_nothing_was_felt(force, glitches):
    recorded = Recorded()
    fed(in_blocks(pulled(FLIGHT, len(FLIGHT) // 2, force), 300), recorded)
    assert ("gps_glitch" in recorded.calibrator.trust.rejected) is glitches


@pytest.mark.parametrize("change", CHANGES)
def test_each_thing_by_itself(change):
    assert_same(CHANGES[change](FLIGHT, round(0.71 * len(FLIGHT))), 300)


@given(
    changes=st.lists(
        st.tuples(st.sampled_from(sorted(CHANGES)), st.floats(0.0, 0.99)), min_size=2, max_size=6
    ),
    size=st.integers(20, 1500),
)
def test_whatever_comes_together(changes, size):
    samples = FLIGHT[: len(FLIGHT) * 2 // 3]
    for change, share in changes:
        samples = CHANGES[change](samples, round(share * len(samples)))
    assert_same(samples, size)


@pytest.mark.parametrize("change", ["highres", "no GPS", "scale", "another receiver", "disarmed"])
def test_what_happens_often_goes_together(change):
    taken = assert_same(CHANGES[change](FLIGHT, len(FLIGHT) // 2), 250)
    assert taken > 0.75 * len(FLIGHT)


def lagging(t: float) -> ImuSample:
    return ImuSample(t, 3, (0.0, 0.0, -9.8), (0.0, 0.0, 0.1))


def test_one_that_lags_begins_a_boot():
    """Against what came before the block, and within it."""
    for at in (3000, 3007, 3299):
        assert_same(inserted(FLIGHT, at, lagging(time_at(FLIGHT, at) - 3.5)), 300)


def test_a_receiver_that_never_had_a_fix_is_given_up():
    long: list[Sample] = []
    for s in flight(90.0):
        long += [replace(s, fix_type=1), replace(s, receiver=2)] if isinstance(s, GpsFix) else [s]
    assert assert_same(long, 500) > 0.9 * len(long)
    recorded = Recorded()
    fed(in_blocks(long, 500), recorded)
    assert recorded.calibrator.trust.receiver == 2
    assert recorded.calibrator.imus == (1, 2)
    assert_same(highres(long, len(long) // 2, seconds=30.0), 500)


def test_a_gap_is_seen_by_what_comes_after_the_fix():
    """An older inertial sample behind a late fix says less than the newest one before it."""
    newest = FLIGHT[-1].t + 2.51
    late = fix(newest - 2.495)  # by a whole gap it would open no window
    first, second = (next(s for s in FLIGHT if getattr(s, "imu", 0) == imu) for imu in (1, 2))
    ending = [replace(first, t=newest), late, replace(second, t=newest - 0.02)]
    size = len(FLIGHT) // 4 + 3
    alone, together = Recorded(), Recorded()
    for sample in FLIGHT + ending:
        alone.feed(sample)
    for piece in in_blocks(FLIGHT + ending, size):
        if together.feed_block(piece) is None:
            for sample in piece.samples():
                together.feed(sample)
    assert alone.calibrator.trust.is_open
    assert not differing(alone, together)


def test_what_is_learned_at_once_is_the_same():
    """The live calibrator's settings, which refine while they learn."""
    samples = CHANGES["all six"](CHANGES["highres"](FLIGHT, 700), 1200)
    alone, together = Calibrator(), Calibrator()
    one_by_one, _ = fed(samples, alone)
    events, taken = fed(in_blocks(samples, 200), together)
    assert taken > len(samples) // 2
    assert events == one_by_one
    assert together.to_bytes() == alone.to_bytes()
    assert [repr(together.calibration(i)) for i in (1, 2)] == [
        repr(alone.calibration(i)) for i in (1, 2)
    ]


def test_a_recording_that_follows_another_is_moved_behind_it():
    alone, together = Recorded(watched=True), Recorded(watched=True)
    for _ in range(2):
        for sample in FLIGHT:
            alone.feed(sample)
        for piece in in_blocks(FLIGHT, 300):
            if together.feed_block(piece) is None:
                for sample in piece.samples():
                    together.feed(sample)
        assert any(isinstance(event, Restarted) for event in alone.restart())
        together.restart()
    assert not differing(alone, together)
