"""A recording as a flight: where it was on the ground, and where the clock began anew."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from onboard.answers import flown as flown_module
from onboard.answers.flown import Flown
from onboard.answers.recorded import Recorded, unanswered
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.limits import TOUCHED_S
from onboard.core.inputs.samples import (
    AttitudeSample,
    GpsFix,
    ImuSample,
    Outputs,
    ParameterValue,
    VehicleState,
)

MOTORS = [ParameterValue(f"SERVO{n}_FUNCTION", 32.0 + n) for n in (1, 2, 3, 4)]


def hop(*, cruise=1500.0, motors=True, begin=0.0, end=60.0, height=1.2, turns=0.05):
    """A copter in a room: stands for 10 s, hovers for 5, flies to and fro, hovers, stands.

    Held by its controller it turns by ``turns``, rad/s RMS, about each axis.
    """
    out = [VehicleState(begin, kind="copter"), *MOTORS]
    rng = np.random.default_rng(3)
    for t in np.arange(begin, end, 0.1).tolist():
        aloft = 10.0 <= t < 50.0
        v = 0.7 * np.sin(t) if 15.0 <= t < 45.0 else 0.0
        up = height * float(np.interp(t, [9.0, 10.0, 50.0, 51.0], [0.0, 1.0, 1.0, 0.0]))
        w_b = tuple(turns * aloft * rng.standard_normal(3))
        out.append(ImuSample(t, 1, (0.0, 0.0, -9.81), w_b))
        if motors:
            pulse = cruise + 20.0 * rng.standard_normal() if aloft else 1100.0
            out.append(Outputs(t, (pulse,) * 4))
        out.append(GpsFix(t, 1, 3, 0.5, 0.5, 100.0 + up, v, 0.0, 0.0))
    return out


def bounced(*, shaken=4.0, lowest=0.3):
    """A copter that comes down from 20 m, touches the ground at 60 s and goes up again at once."""
    out = [VehicleState(0.0, kind="copter"), *MOTORS]
    rng = np.random.default_rng(5)
    for t in np.arange(0.0, 120.0, 0.1).tolist():
        up = float(np.interp(t, [15.0, 35.0, 60.0, 80.0, 105.0], [0.0, 20.0, lowest, 20.0, 0.0]))
        later = float(
            np.interp(t + 0.1, [15.0, 35.0, 60.0, 80.0, 105.0], [0.0, 20.0, lowest, 20.0, 0.0])
        )
        f_b = 0.1 * rng.standard_normal(3) + (0.0, shaken * (round(10 * t) == 600), -9.81)
        w_b = tuple(0.05 * (later != up) * rng.standard_normal(3))
        out.append(ImuSample(t, 1, tuple(f_b), w_b))
        out.append(AttitudeSample(t, 0.0, 0.0, 0.001 * t))
        out.append(Outputs(t, (1500.0 if 15.0 <= t < 105.0 else 1100.0,) * 4))
        out.append(GpsFix(t, 1, 3, 0.5, 0.5, 100.0 + up, 0.0, 0.0, 10.0 * (up - later)))
    return out


def found(samples):
    made = Flown()
    for sample in samples:
        made.feed(sample)
    made.finish()
    return made


def standing(made, t):
    return any(a <= t <= b for a, b in made.grounded)


@pytest.mark.parametrize("cruise", [1350.0, 1500.0, 1800.0])
def test_a_recording_that_begins_and_ends_in_a_hover_has_no_ground(cruise):
    made = found(hop(cruise=cruise, begin=11.0, end=49.0))
    assert made.grounded == []


def test_without_outputs_nobody_knows_that_it_hovers():
    assert standing(found(hop(motors=False, begin=11.0, end=49.0)), 12.0)


def test_what_does_not_turn_stands_whatever_its_motors_do():
    """Its battery is empty, or it lies on its back."""
    assert standing(found(hop(turns=0.0, begin=11.0, end=49.0)), 12.0)


def test_what_is_still_and_as_low_as_a_stand_is_left_out_with_it():
    """The air is another one there, and heights wander."""
    made = found(hop())
    assert all(standing(made, t) for t in (3.0, 12.0, 48.0, 57.0))
    assert not any(standing(made, t) for t in np.arange(18.5, 41.5, 0.5))


def test_a_bounce_is_no_flight_to_either_level():
    """What the ground pushed with no sample has, and whoever learns from it makes up for that."""
    made = found(bounced())
    assert standing(made, 60.0)
    assert not any(standing(made, t) for t in np.r_[25.0:56.0, 64.0:95.0])
    fixes = np.concatenate([b.fixes.t for b in made.recorded.sampled(1)])
    assert np.any((fixes > 40.0) & (fixes < 55.0))
    assert not np.any(np.abs(fixes - 60.0) < 1.0)


def test_only_an_autopilots_word_of_a_landing_is_late():
    """What heights tell of a landing has its margin before it, and flight lasts until then."""
    flight = bounced(shaken=0.0)
    made = found(flight)
    stand = made.grounded[-1][0]
    handed_out = max(b.fixes.t[-1] for b in made.recorded.sampled(1))
    assert stand - 1.2 < handed_out <= stand
    calibrator = Calibrator(CalibratorSettings(refine=False))
    word = [VehicleState(0.0, landed=False), VehicleState(stand, landed=True)]
    for sample in sorted([*flight, *word], key=lambda s: s.t or 0.0):
        calibrator.feed(sample)
    calibrator.finish()
    handed_out = max(b.fixes.t[-1] for b in calibrator.engine(1).batches)
    assert stand - TOUCHED_S - 0.3 < handed_out <= stand - TOUCHED_S


def test_the_vehicle_level_goes_on_without_what_the_sensor_level_calls_false(monkeypatch):
    """Spikes in the samples and fixes that nobody believes would be gusts and drag."""
    source = SimpleNamespace(recordings=[SimpleNamespace(derived=False)], vehicle=None)

    def read(paths, reader, **_):
        for sample in bounced():
            reader.feed(sample)
        reader.finish()
        return source

    def asked(recorded, imu):
        recorded._sampled[imu] = recorded.sampled(imu)[:1]
        return unanswered(recorded.calibrator.calibration(imu))

    monkeypatch.setattr(flown_module, "read", read)
    monkeypatch.setattr(Recorded, "answer", asked)
    assert len(flown_module.flown("bounced.tlog").batches) == 1


@pytest.mark.parametrize("but", [{"shaken": 0.0}, {"lowest": 8.0}])
def test_a_descent_that_touches_nothing_is_flight(but):
    assert not standing(found(bounced(**but)), 60.0)


def skipped(*, shaken=6.0, lowest=0.0):
    """A plane that hops over a field on its wheels at 20 m/s from 60 to 90 s, and goes up again."""
    rng = np.random.default_rng(6)
    t = np.arange(0.0, 140.0, 0.1)
    heights = [0.0, 40.0, lowest, lowest, 40.0, 0.0]
    hops = (t >= 60.0) & (t < 90.0)
    up = np.interp(t, [10.0, 40.0, 60.0, 90.0, 110.0, 130.0], heights)
    up = up + 0.4 * hops * np.abs(np.sin(1.5 * t))
    hits = shaken * (hops & (np.diff(np.sin(1.5 * t) > 0.0, prepend=False)))
    speed = np.interp(t, [5.0, 10.0, 130.0, 135.0], [0.0, 20.0, 20.0, 0.0])
    sinking = -np.gradient(up, 0.1)
    out = [VehicleState(0.0, kind="plane")]
    for k, at in enumerate(t.tolist()):
        f_b = 0.1 * rng.standard_normal(3) + (0.0, hits[k], -9.81)
        out.append(ImuSample(at, 1, tuple(f_b), (0.0, 0.0, 0.0)))
        out.append(AttitudeSample(at, 0.0, 0.0, 0.0))
        out.append(GpsFix(at, 1, 3, 0.5, 0.5, 100.0 + up[k], speed[k], 0.0, sinking[k]))
    return out


def test_wheels_that_hop_over_a_field_carry_no_wing():
    """What they push with would be a side force of the airframe, and lift."""
    made = found(skipped())
    assert all(standing(made, t) for t in np.arange(61.0, 89.0, 0.5))
    assert not any(standing(made, t) for t in np.r_[20.0:54.0, 96.0:124.0])


@pytest.mark.parametrize("but", [{"shaken": 0.0}, {"lowest": 8.0}])
def test_a_plane_that_flies_low_and_touches_nothing_flies(but):
    made = found(skipped(**but))
    assert not any(standing(made, t) for t in np.arange(61.0, 89.0, 0.5))


def plane_flight():
    """A plane that stands, flies a minute and stands again; its receiver tells no climb."""
    out = [VehicleState(0.0, kind="plane")]
    rng = np.random.default_rng(8)
    for t in np.arange(0.0, 100.0, 0.1).tolist():
        up = float(np.interp(t, [15.0, 30.0, 70.0, 85.0], [0.0, 60.0, 60.0, 0.0]))
        v = 18.0 if 12.0 <= t < 87.0 else 0.0
        out.append(ImuSample(t, 1, (0.0, 0.0, -9.81), (0.0, 0.0, 0.0)))
        if round(10 * t) % 2 == 0:
            height = 100.0 + up + 0.1 * rng.standard_normal()
            out.append(GpsFix(t, 1, 3, 0.5, 0.5, height, v, 0.0, None))
    return out


def test_fixes_that_telemetry_repeats_and_another_receivers_hide_no_stand():
    """A stream at twice the receiver's rate has each fix twice: between most no time goes by."""
    once, often = plane_flight(), []
    for sample in once:
        often.append(sample)
        if isinstance(sample, GpsFix):
            often += [sample, replace(sample, receiver=2, altitude=sample.altitude + 7.0)]
    one, other = found(once), found(often)
    assert len(one.grounded) >= 2
    assert standing(one, 5.0)
    assert standing(one, 95.0)
    assert not any(standing(one, t) for t in np.arange(20.0, 80.0, 1.0))
    assert other.grounded == one.grounded
    assert other.ground == one.ground


def test_streams_of_two_boots_are_apart():
    first, second = hop(cruise=1400.0, begin=20.0), hop(cruise=1600.0, begin=5.0)
    made = found([*first, *second])
    outputs = made.signals().outputs
    assert len(outputs) == 400 + 550
    late = outputs.t > 65.0
    assert np.mean(outputs.x[~late, 0][:250]) == pytest.approx(1400.0, abs=5.0)
    assert np.all(np.diff(outputs.t) < 11.0)
    assert outputs.t[late][0] == pytest.approx(60.0 - 0.1 + 10.0, abs=0.2)
    assert np.count_nonzero(late) == 550


def test_a_receiver_whose_fix_is_old_is_no_other_boot():
    """Its messages carry the moment of its last fix, again and again."""
    samples, plain = [], hop()
    for sample in plain:
        samples.append(sample)
        if isinstance(sample, GpsFix):
            samples.append(GpsFix(2.5, 2, 1, 0.0, 0.0, 0.0, 0.0, 0.0))
    made, alone = found(samples), found(plain)
    np.testing.assert_array_equal(made.signals().outputs.t, alone.signals().outputs.t)
    assert made.grounded == alone.grounded


@pytest.mark.parametrize("wrong", [5000.0, 2e6, 3e9, 1.0])
@pytest.mark.parametrize("kind", [ImuSample, Outputs])
def test_one_damaged_stamp_costs_itself(wrong, kind):
    plain = hop()
    at = next(k for k, s in enumerate(plain) if isinstance(s, kind) and s.t > 30.0)
    damaged = [*plain[:at], replace(plain[at], t=wrong), *plain[at + 1 :]]
    alone, made = found(plain), found(damaged)
    lost = set(alone.signals().outputs.t) - set(made.signals().outputs.t)
    assert lost <= {plain[at].t}
    assert made.grounded == alone.grounded


def test_parameters_that_are_no_numbers_are_none():
    made = found([ParameterValue("SERVO9_FUNCTION", float("nan")), *hop()])
    assert "SERVO9_FUNCTION" not in made.signals().parameters
    assert made.signals().motors == (0, 1, 2, 3)


def plane(kind, *, wander_m):
    """Stands, takes off, flies, lands and stands for longer; a receiver's height wanders."""
    out = [VehicleState(0.0, kind=kind)] if kind else []
    for t in np.arange(0.0, 300.0, 0.1).tolist():
        speed = float(np.interp(t, [30.0, 36.0, 150.0, 156.0], [0.0, 18.0, 18.0, 0.0]))
        up = float(np.interp(t, [36.0, 60.0, 120.0, 150.0], [0.0, 60.0, 60.0, 0.0]))
        down = -(up - float(np.interp(t - 0.1, [36.0, 60.0, 120.0, 150.0], [0.0, 60.0, 60.0, 0.0])))
        out.append(ImuSample(t, 1, (0.0, 0.0, -9.81), (0.0, 0.0, 0.0)))
        height = 100.0 + up + wander_m * t / 300.0
        out.append(GpsFix(t, 1, 3, 0.5, 0.5, height, speed, 0.0, 10.0 * down))
    return out


@pytest.mark.parametrize("kind", ["", "plane"])
@pytest.mark.parametrize("wander_m", [-7.0, 7.0])
def test_a_plane_stands_where_it_stands_whoever_says_that_it_is_one(kind, wander_m):
    """In a wind what stands is a wing with little slope, flown slowly, and gusts of 5 m/s."""
    made = found(plane(kind, wander_m=wander_m))
    assert all(standing(made, t) for t in (5.0, 25.0, 165.0, 230.0, 295.0))
    assert not any(standing(made, t) for t in (45.0, 90.0, 140.0))
