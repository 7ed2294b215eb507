"""What looks like noise in the samples is taken for it, or for real, as the velocity says."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.diagnosis.cleared import cleared
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.filter.shaken import walk_s
from onboard.core.inputs import expected_force
from onboard.core.inputs.joined import with_samples as without
from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample
from onboard.core.maths.frames import rotation_from_euler
from onboard.core.model.noise_level import DOUBT, NoiseLevel
from onboard.core.physics.effect import Origin
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec, fly_messages
from tests.core.estimate.test_simulated_flights import TRUE, fed, flown

STEP, LATE = 0.02, 0.12
"""s between samples, s that the receiver is late by."""
SHAKE, NOTHING = np.full(3, 0.6), np.zeros(3)
"""Standard deviations of white shaking, body axes, m/s^2."""


def shaken(
    samples,
    *,
    noise=NOTHING,
    real=NOTHING,
    beat=NOTHING,
    swing=NOTHING,
    calm_s=0.0,
    hz=(1.7, 1.7),
    until=np.inf,
):
    """The flight with noise in its samples, and really shaken so that its receiver has it, too.

    Beside both tones: a beat in the samples, and a swing that is real, each of its own frequency
    ``until`` they change places.  All of it by turns with as long a calm.
    """
    rng, R_nb, v, made = np.random.default_rng(3), np.eye(3), np.zeros(3), []
    times, speeds, heights = [-np.inf], [v], [0.0]
    for s in samples:
        out = s
        if isinstance(s, AttitudeSample):
            R_nb = rotation_from_euler(s.roll, s.pitch, s.yaw)
        elif isinstance(s, ImuSample):
            of = hz if s.t < until else hz[::-1]
            tone, swung = (np.sqrt(2.0) * np.sin(2.0 * np.pi * f * s.t) for f in of)
            calm = calm_s > 0.0 and s.t // calm_s % 2
            a = (real * rng.normal(size=3) + swing * swung) * (not calm)
            n = (noise * rng.normal(size=3) + beat * tone) * (not calm)
            out = replace(s, f_b=tuple((np.array(s.f_b) + a + n).tolist()))
            v = v + STEP * (R_nb @ a)
            times.append(s.t)
            speeds.append(v)
            heights.append(heights[-1] - STEP * v[2])
        elif isinstance(s, GpsFix):
            at = int(np.searchsorted(times, s.t - LATE, side="right")) - 1
            gained = speeds[at]
            down = None if s.v_d is None else s.v_d + gained[2]
            north, east, up = s.v_n + gained[0], s.v_e + gained[1], s.altitude + heights[at]
            out = replace(s, v_n=north, v_e=east, v_d=down, altitude=up)
        made.append(out)
    return made


def changed(samples):
    """(3,) m/s^2, RMS by axis: what was taken for noise and off the samples."""
    return changed_and_walk(samples)[0]


def changed_and_walk(samples):
    """The same, and (3,) by what variance the velocity was found to walk, (m/s)^2/s."""
    made = fed(samples, Calibrator())
    sampled = made.engine(1).batches
    full = cleared(made, made.engine(1), sampled, Origin(made.first_sample)).full
    taken = [a.segment.raw_s - b.segment.raw_s for a, b in zip(full.batches, sampled, strict=True)]
    walk = np.mean([walk_s(full.noise, batch.segment) for batch in sampled], axis=0)
    return np.sqrt(np.mean(np.concatenate(taken) ** 2, axis=0)), walk


def examined(samples):
    """The flight as it is taken, and the accelerometer that it is of."""
    made = fed(samples, Calibrator())
    clear = cleared(made, made.engine(1), made.engine(1).batches, Origin(made.first_sample))
    return clear.full


@pytest.fixture(scope="module")
def flight():
    return flown("copter", 100.0, seed=6)[0]


@pytest.mark.slow
def test_the_velocity_says_what_is_noise(flight):
    assert np.all(changed(shaken(flight, noise=SHAKE)) > 0.5 * SHAKE)
    # Of real shaking no more can go than the walk that is found of the velocity leaves room for:
    # where that is a tie, its density over that of the samples.
    taken, walk = changed_and_walk(shaken(flight, real=SHAKE))
    room = walk / (SHAKE**2 * STEP)
    assert np.all(taken <= 1.1 * room * SHAKE)
    assert np.all(room < 0.1)


@pytest.mark.slow
def test_of_what_is_really_shaken_no_more_is_noise_than_the_velocity_walks_by(flight):
    """Turbulence shakes a wing up and down: taken for noise, it made z scale 13 sigma too large."""
    noise, real = SHAKE * [1.0, 1.0, 0.0], np.array([0.0, 0.0, 2.0])
    taken = changed(shaken(flight, noise=noise, real=real))
    assert np.all(taken[:2] > 0.5 * noise[:2])
    assert taken[2] < 0.15 * real[2]


@pytest.mark.slow
def test_the_velocity_walks_where_the_samples_are_noisy_and_not_where_it_is_shaken(flight):
    """In gusts of noise samples miss all of what they scatter by; of real ones next to nothing."""
    noisy, real = (
        fed(shaken(flight, calm_s=7.0, **kind), Calibrator()).engine(1).noise
        for kind in ({"noise": SHAKE}, {"real": SHAKE})
    )
    gust = SHAKE[0] ** 2 * STEP
    for share, calm in (
        (noisy.shaken_walk, noisy.force_walk),
        (noisy.shaken_lift, noisy.lift_walk),
    ):
        assert share**2 * gust + calm**2 == pytest.approx(gust, rel=0.5)
        assert calm**2 < share**2 * gust  # twice as much in gusts: a short flight tells no more
    for share, calm in ((real.shaken_walk, real.force_walk), (real.shaken_lift, real.lift_walk)):
        assert share**2 * gust + calm**2 < 0.1 * gust


@pytest.mark.slow
def test_of_a_tone_the_velocity_says_whether_it_is_the_vehicles(flight):
    """A rotor's beat, sampled too slowly, looks like a swing: y scale was 14 sigma off with one."""
    beat = np.array([0.4, 0.3, 0.0])
    assert changed(shaken(flight, beat=beat)) == pytest.approx(beat, rel=0.1, abs=0.05)
    assert np.all(changed(shaken(flight, swing=beat)) < 0.05)


@pytest.mark.slow
def test_of_each_tone_by_itself_the_velocity_says_whether_it_is_the_vehicles(flight):
    """A motor changes its speed in the middle of the flight, and a swing is then where it was."""
    beat, swing = np.array([0.4, 0.0, 0.0]), np.array([0.0, 0.4, 0.0])
    half = float(np.mean([s.t for s in flight if isinstance(s, ImuSample)]))
    taken = changed(shaken(flight, beat=beat, swing=swing, hz=(1.7, 2.6), until=half))
    assert taken[0] == pytest.approx(beat[0], rel=0.2)
    assert taken[1] < 0.1 * swing[1]


@pytest.mark.slow
def test_noise_that_no_velocity_shows_is_asked_about_in_a_hover(flight, monkeypatch):
    """There it is most of what tells a latency, an average and an antenna: one was 5 sigma off."""
    asked, little = [], np.full(3, 0.05)

    def expecting(*given):
        asked.append(given)
        return without(*given)

    monkeypatch.setattr(expected_force, "with_samples", expecting)
    spec = FlightSpec(vehicle="copter", seed=6, duration=200.0, imus=random_imus(6), dull=True)
    decoder = Decoder()
    hover = [s for _, message in fly_messages(spec) for s in decoder.decode(message)]
    changed(shaken(hover, noise=little))
    assert asked
    # Of brisk flight that noise is nothing: another examination would cost, and say the same.
    asked.clear()
    changed(shaken(flight, noise=little))
    assert not asked


@pytest.mark.slow
def test_levels_of_noise_are_found_beside_the_scales_with_what_is_open_of_both(flight):
    """Where noise drowns the force of an axis, its walk is what an average has left of it."""
    sigma = np.array([1.5, 0.6, 0.9])
    full = examined(shaken(flight, noise=sigma))
    (level,) = [f for f in full.carried if isinstance(f, NoiseLevel)]
    found, at = full.found(), full.model.slices[NoiseLevel.name]
    off = np.log(level.about / (sigma**2 * STEP)) + found.theta[at]
    assert np.all(np.abs(off) < 3.0 * np.sqrt(np.diag(found.covariance)[at]))
    assert np.all(np.abs(off) < DOUBT), "an octave is what is known before"
    scale, sigma = found.theta[:3], np.sqrt(np.diag(found.covariance)[:3])
    assert np.all(np.abs(scale - TRUE.scale) < 3.0 * sigma)
