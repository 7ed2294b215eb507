"""Streams as they really come: late, repeated, interrupted, restarted, and changed in between."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.events import Restarted
from onboard.core.estimate.saving import VERSION
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.assembly import AssemblySettings
from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample, ImuSource, ParameterValue
from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.core.maths.blocks import total
from onboard.errors import StateError
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, fly_messages

SCALE, OFFSET = (1.02, 0.985, 1.015), (0.2, -0.15, 0.3)
ONCE = CalibratorSettings(refine=False)
IN_FORCE = dict(zip(parameter_names(1).six, (1.0,) * 3 + (0.1,) * 3, strict=True))


@pytest.fixture(scope="module")
def flight():
    """Samples of a flight, inertial ones as floats (truncation is another matter)."""
    spec = FlightSpec(
        vehicle="copter",
        duration=110.0,
        imus=(ImuTruth(scale=SCALE, offset=OFFSET),),
        parameters=IN_FORCE,
    )
    decoder, out = Decoder(1, 1), []
    for _, message in fly_messages(spec):
        for sample in decoder.decode(message):
            exact = isinstance(sample, ImuSample)
            out.append(replace(sample, f_step=0.0, w_step=0.0) if exact else sample)
    # The list of parameters is read first.
    told = [s for s in out if isinstance(s, ParameterValue) and s.name != "INS_ACC_ID"]
    return told + [s for s in out if not isinstance(s, ParameterValue)]


def fed(samples, settings=ONCE):
    calibrator, events = Calibrator(settings), []
    for sample in samples:
        events.extend(calibrator.feed(sample))
    events.extend(calibrator.finish())
    return calibrator, events


def six(calibrator, imu=1):
    c = calibrator.calibration(imu)
    return np.array(c.scale + c.offset), np.array(c.scale_sigma + c.offset_sigma)


@pytest.fixture(scope="module")
def plain(flight):
    return fed(flight)[0]


def near_truth(calibrator, sigmas=4.0):
    value, sigma = six(calibrator)
    assert np.all(np.abs(value - np.array(SCALE + OFFSET)) < sigmas * sigma)


@pytest.mark.slow
def test_the_flight_by_itself(plain):
    near_truth(plain)


@pytest.mark.slow
def test_parameters_changed_in_flight_leave_the_estimate_alone(flight, plain):
    before, after = SixParameters((1.0,) * 3, (0.1,) * 3), SixParameters(SCALE, OFFSET)
    names = parameter_names(1).six
    changed, done = [], False
    for sample in flight:
        if isinstance(sample, ImuSample) and sample.t > 55.0:
            if not done:
                reports = zip(names, after.as_vector(), strict=True)
                changed.extend(ParameterValue(n, float(v), sample.t) for n, v in reports)
                done = True
            raw = before.undo(np.array(sample.f_b))
            changed.append(replace(sample, f_b=tuple(after.apply(raw))))
        else:
            changed.append(sample)
    got = fed(changed)[0]
    np.testing.assert_allclose(six(got)[0], six(plain)[0], atol=1e-9)
    np.testing.assert_allclose(six(got)[1], six(plain)[1], rtol=1e-6)
    assert got.calibration(1).in_force_scale == SCALE


def test_repeats_and_overtaken_messages_change_nothing_and_are_counted(flight, plain):
    rng = np.random.default_rng(0)
    out, held = [], None
    for sample in flight:
        out.append(sample)
        if isinstance(sample, ImuSample):
            if held is not None:
                out.append(held)
                held = None
            draw = rng.uniform()
            if draw < 0.02:
                out.append(sample)
            elif draw < 0.04:
                held = sample  # comes a second time, after the next
        elif isinstance(sample, GpsFix | AttitudeSample) and rng.uniform() < 0.1:
            out.append(sample)
    got = fed(out)[0]
    assert np.array_equal(six(got)[0], six(plain)[0])
    rejected = got.calibration(1).rejected
    assert rejected["imu_repeated"] > 20
    assert rejected["imu_late"] > 20


def test_what_is_not_finite_changes_nothing(flight, plain):
    out = []
    for i, sample in enumerate(flight):
        out.append(sample)
        if isinstance(sample, ImuSample) and i % 50 == 0:
            out.append(replace(sample, t=sample.t + 1e-3, f_b=(float("nan"), 0.0, -9.8)))
            out.append(replace(sample, t=float("nan")))
    assert np.array_equal(six(fed(out)[0])[0], six(plain)[0])


@pytest.mark.parametrize("ahead", [20.0, 3600.0])
def test_a_stamp_of_the_future_does_not_stop_the_rest(flight, plain, ahead):
    out, kinds = [], Counter()
    for sample in flight:
        out.append(sample)
        if isinstance(sample, AttitudeSample | GpsFix):
            kinds[type(sample)] += 1
            if kinds[type(sample)] == 200:
                out.append(replace(sample, t=sample.t + ahead))
    got = fed(out)[0]
    assert np.array_equal(six(got)[0], six(plain)[0])


def test_a_reboot_keeps_the_sums(flight, plain):
    again = []
    for sample in flight:
        if isinstance(sample, ParameterValue) or sample.t < 60.0:
            again.append(sample)
        else:
            again.append(replace(sample, t=sample.t - 59.0))
    got, events = fed(again)
    restarted = [e for e in events if isinstance(e, Restarted)]
    assert [e.reason for e in restarted] == ["reboot"]
    assert got.calibration(1).rejected["reboots"] == 1
    near_truth(got)
    lost = plain.calibration(1).trusted_s - got.calibration(1).trusted_s
    assert 0.0 < lost < 15.0
    assert np.all(six(got)[1] < 2.0 * six(plain)[1])


@pytest.mark.parametrize("outage", ["silent", "no fix"])
@pytest.mark.parametrize("seconds", [20.0, 45.0])
def test_an_outage_is_bridged_or_begun_anew_and_is_not_trusted(flight, plain, outage, seconds):
    """Fixes without a fix carry garbage: a filter that took it for a start would be misled."""
    out = []
    for sample in flight:
        if isinstance(sample, GpsFix) and 50.0 < sample.t < 50.0 + seconds:
            if outage == "no fix":
                out.append(replace(sample, fix_type=1, v_n=sample.v_n + 1.5, v_e=0.0))
        else:
            out.append(sample)
    got = fed(out)[0]
    near_truth(got)
    lost = plain.calibration(1).trusted_s - got.calibration(1).trusted_s
    # What is on the ground before fixes are back was no trusted flight in the first place.
    missing = min(seconds, plain.engine(1).batches[-1].fixes.t[-1] - 50.0)
    assert missing - 1.0 < lost < missing + 12.0
    # Less than half of the flight may be left: it says less, but far more than the prior.
    assert np.all(six(got)[1] < 3.0 * six(plain)[1])


def test_a_gap_in_the_inertial_stream(flight, plain):
    out = [
        s for s in flight if not (isinstance(s, ImuSample | AttitudeSample) and 50.0 < s.t < 58.0)
    ]
    got = fed(out)[0]
    near_truth(got)
    assert 8.0 < plain.calibration(1).trusted_s - got.calibration(1).trusted_s < 16.0


def test_the_result_does_not_depend_on_looking_at_it(flight, plain):
    watched = Calibrator(ONCE)
    for i, sample in enumerate(flight):
        watched.feed(sample)
        if i % 2000 == 0:
            watched.to_bytes()
            for imu in watched.imus:
                watched.calibration(imu)
    watched.finish()
    assert np.array_equal(six(watched)[0], six(plain)[0])


@pytest.mark.parametrize("source", [ImuSource.RAW_IMU, ImuSource.SCALED_IMU])
def test_high_resolution_is_preferred_where_it_comes(flight, plain, source):
    """Also beside SCALED_IMU2: it is of the first that is used, and INS_USE may be 0."""
    coarse = []
    for sample in flight:
        if isinstance(sample, ImuSample):
            fine = replace(sample, source=ImuSource.HIGHRES_IMU)
            wrong = tuple(x + 1.0 for x in sample.f_b)
            coarse += [
                fine,
                replace(sample, t=sample.t + 4e-3, f_b=wrong, source=source),
            ]
        else:
            coarse.append(sample)
    np.testing.assert_allclose(six(fed(coarse)[0])[0], six(plain)[0], atol=1e-12)


@pytest.fixture(scope="module")
def identified(flight):
    return [ParameterValue("INS_ACC_ID", 2753028.0), *flight]


def test_one_stray_stamp_from_long_ago_begins_no_boot(flight, plain):
    """A packet that was very long on its way; in a log, damage."""
    strays = [k for k, s in enumerate(flight) if isinstance(s, ImuSample)][2000:6000:1500]
    odd = [replace(s, t=s.t - 20.0) if k in strays else s for k, s in enumerate(flight)]
    got, events = fed(odd)
    assert [e for e in events if isinstance(e, Restarted)] == []
    assert got.calibration(1).rejected["imu_late"] == len(strays)
    assert np.all(np.abs(six(got)[0] - six(plain)[0]) < 0.2 * six(plain)[1])


@pytest.mark.slow
def test_saved_sums_are_taken_in_by_the_flight_that_agrees_with_them(identified):
    first = fed(identified)[0]
    saved = first.to_bytes()
    assert Calibrator.from_bytes(saved, ONCE).to_bytes() == saved
    second = Calibrator.from_bytes(saved, ONCE)
    half = len(identified) // 2
    for sample in identified[:half]:
        second.feed(sample)
    alone = fed(identified[:half])[0].engine(1)
    taken, own = total(second.engine(1).all_blocks), total(alone.all_blocks)
    assert taken.rows <= own.rows, "not before the flight is over"
    for sample in identified[half:]:
        second.feed(sample)
    second.finish()
    near_truth(second)
    twice = second.calibration(1)
    assert twice.rejected["restored"] == 1
    assert twice.trusted_s == pytest.approx(2.0 * first.calibration(1).trusted_s, rel=0.01)
    # The same flight counted twice: variances halve, down to the floor of the model.
    assert np.all(six(second)[1] < six(first)[1])


def test_an_identifier_of_none_forgets_nothing_and_hides_no_exchange(identified, plain):
    half = len(identified) // 2
    none = ParameterValue("INS_ACC_ID", 0.0)
    back = fed([*identified[:half], none, identified[0], *identified[half:]])[0]
    assert np.array_equal(six(back)[0], six(plain)[0])
    other = ParameterValue("INS_ACC_ID", 99.0)
    swapped = fed([*identified[:half], none, other, *identified[half:]])[0]
    assert swapped.calibration(1).trusted_s < 0.7 * plain.calibration(1).trusted_s


def test_sums_of_another_sensor_are_refused(identified, plain):
    saved = fed(identified)[0].to_bytes()
    other = Calibrator.from_bytes(saved, ONCE)
    swapped = [ParameterValue("INS_ACC_ID", 99.0), *identified[1:]]
    for sample in swapped:
        other.feed(sample)
    other.finish()
    assert other.calibration(1).rejected["saved_of_another_sensor"] == 1
    assert np.array_equal(six(other)[0], six(plain)[0])


def test_damaged_state_is_refused(identified):
    text = fed(identified[: len(identified) // 3])[0].to_bytes().decode()
    damages = [
        text[:-40],
        "[]",
        f'{{"version": {VERSION}}}',
        text.replace(f'"version": {VERSION}', '"version": 2'),
        text.replace(f'"version": {VERSION}', '"version": 99'),
        text.replace('"velocity": ', '"velocity": -'),
        text.replace('"delay": ', '"delay": NaN, "was": '),
        text.replace('"prior": [', '"prior": [1.0, '),
        text.replace('"noise": {', '"noise": [], "was": {'),
        text.replace('"portions": [', '"portions": [], "were": ['),
    ]
    for damaged in damages:
        assert damaged != text
        with pytest.raises(StateError):
            Calibrator.from_bytes(damaged.encode(), ONCE)


@pytest.mark.slow
def test_flight_that_left_the_buffer_stays_in_the_sums(flight):
    every = replace(ONCE, assembly=AssemblySettings(batch_s=2.0), memory_s=1e12)
    short = fed(flight, replace(every, buffer_s=10.0))[0].engine(1)
    long = fed(flight, every)[0].engine(1)
    assert len(short.aged) > 12
    assert total(short.all_blocks).rows == pytest.approx(total(long.all_blocks).rows, rel=5e-3)
