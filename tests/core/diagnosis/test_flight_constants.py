"""A latency or an antenna that changes in flight is told with what it was, and not set."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.explaining import CalibratorSettings
from onboard.answers.advice import advise
from onboard.answers.answer import judged
from onboard.answers.verdict import cures, missing, remarks
from onboard.core.diagnosis.procedure import diagnose
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.result import Status
from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample
from onboard.core.maths.frames import rotation_from_euler
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import GpsTruth, random_imus
from sitl.recording import FlightSpec, fly_messages
from tests.report.diagnoses_by_hand import IN_FORCE

pytestmark = pytest.mark.slow

RECEIVER = GpsTruth(delay=0.22, antenna=(0.4, -0.3, -0.2))
PERIOD_S = 20.0


@pytest.fixture(scope="module")
def flown():
    """Samples of a copter's flight of 200 s: a late receiver, and an antenna that nobody told."""
    spec = FlightSpec(vehicle="copter", seed=31, duration=200.0, imus=random_imus(31), gps=RECEIVER)
    decoder = Decoder()
    return [s for _, message in fly_messages(spec) for s in decoder.decode(message)]


def alternating(t):
    return (t // PERIOD_S) % 2.0


def later(samples, by):
    """Fixes that are later by ``by`` of their time (s), in the order in which they then arrive."""
    out, newest = [], -np.inf
    waiting = []
    for s in samples:
        if isinstance(s, GpsFix):
            waiting.append(replace(s, t=s.t + by(s.t)))
            continue
        if isinstance(s, ImuSample):
            newest = max(newest, s.t)
        out += [w for w in waiting if w.t <= newest]
        waiting = [w for w in waiting if w.t > newest]
        out.append(s)
    return out


def moving(samples, place):
    """An antenna that is further off by ``place`` (3,) of the time, m."""
    attitude = [s for s in samples if isinstance(s, AttitudeSample)]
    imu = [s for s in samples if isinstance(s, ImuSample) and s.imu == 1]
    ta, ti = (np.array([s.t for s in every]) for every in (attitude, imu))
    angles = np.unwrap([(s.roll, s.pitch, s.yaw) for s in attitude], axis=0)
    rates = np.array([s.w_b for s in imu])
    out = []
    for s in samples:
        if isinstance(s, GpsFix):
            t = s.t - RECEIVER.net_delay
            R = rotation_from_euler(*(np.interp(t, ta, angles[:, k]) for k in range(3)))
            r = np.array(place(t))
            v = R @ np.cross([np.interp(t, ti, rates[:, k]) for k in range(3)], r)
            s = replace(  # noqa: PLW2901 - the same fix from another place
                s, v_n=s.v_n + v[0], v_e=s.v_e + v[1], altitude=s.altitude - (R @ r)[2]
            )
        out.append(s)
    return out


def asked(samples):
    """The answer, and what may be set."""
    calibrator = Calibrator(CalibratorSettings(refine=False, buffer_s=3600.0))
    for s in samples:
        calibrator.feed(s)
    calibrator.finish()
    given = judged(diagnose(calibrator, 1))
    parameters = {**IN_FORCE, **dict(calibrator.parameters.values)}
    return given, advise((given,), parameters)[0]


def test_what_is_constant_is_told_and_may_be_set(flown):
    given, advice = asked(flown)
    assert given.diagnosis.verdict is Verdict.EXPLAINED
    assert given.diagnosis.inconstant == ()
    names = {"GPS1_DELAY_MS", "GPS1_POS_X", "GPS1_POS_Y", "GPS1_POS_Z", "INS_ACCOFFS_X"}
    assert names <= advice.to_set(given.diagnosis.effects).keys()


CONCEALED = {
    "latency alternates": ("gps_latency", lambda s: later(s, lambda t: 0.15 * alternating(t))),
    "antenna steps": ("gps_lever_arm", lambda s: moving(s, lambda t: (0.0, 0.4 * (t > 110), 0.0))),
}


@pytest.mark.parametrize("case", CONCEALED)
def test_what_changes_in_flight_is_told_and_nothing_of_it_is_set(flown, case):
    effect, conceal = CONCEALED[case]
    given, advice = asked(conceal(flown))
    made = given.diagnosis
    assert effect in [c.effect for c in made.inconstant if c.contradicts]
    assert made.verdict in {Verdict.PARTLY_EXPLAINED, Verdict.UNEXPLAINED}
    assert given.calibration.status is not Status.CALIBRATED
    assert advice.to_set(made.effects) == {}
    (words,) = [c.words for c in made.inconstant if c.effect == effect]
    assert "is not the same in parts of the flight" in words
    assert any(words[1:] in s for s in missing(made))
    assert not any(words[1:] in s for s in remarks(made))  # once is enough
    if effect in [e.name for e in made.effects]:
        assert advice.against[effect] == words
        assert any(s.startswith("Do not set") and words in s for s in cures(made, advice))


def test_a_latency_that_grows_with_a_clock_is_explained_and_not_set(flown):
    given, advice = asked(later(flown, lambda t: 6e-4 * t))
    (said,) = given.diagnosis.inconstant
    assert not said.contradicts
    assert said.effect == "gps_latency"
    assert "grows from" in said.words
    assert given.diagnosis.verdict is Verdict.EXPLAINED
    names = advice.to_set(given.diagnosis.effects)
    assert "GPS1_DELAY_MS" not in names
    assert "GPS1_POS_X" in names
