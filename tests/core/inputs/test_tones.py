"""Tones in the samples: found while they last, and gone without what is beside them."""

from itertools import pairwise

import numpy as np
import pytest

from onboard.core.inputs.expected_force import spectrum
from onboard.core.inputs.tones import (
    PARTS,
    Kind,
    density_of,
    stretches_of,
    tones,
    tones_of,
    with_parts,
    without,
)
from tests.core.inputs.test_expected_force import STEP, T, batches, felt, manoeuvre

FAINT = 0.01 * np.random.default_rng(7).normal(size=(len(T), 3))
SETTLED = slice(500, -500)
"""Samples that no end of the flight is near to."""


def beat(hz, size=0.3):
    """(n,) m/s^2, of a frequency at each moment."""
    return size * np.sin(np.cumsum(2.0 * np.pi * hz * STEP * np.ones(len(T))) + 0.4)


def of_kind(found, kind):
    """Those of one kind."""
    return [tone for tone in found if tone.kind is kind]


@pytest.mark.parametrize("hz", [1.4, 2.65, 11.0])
def test_a_tone_that_is_asked_for_goes_and_the_manoeuvre_stays(hz):
    """A beat of 52 Hz is one of 2 Hz in samples at 25 Hz, where a vehicle swings as well."""
    f = manoeuvre()
    wave = beat(hz)[:, None] * [1.0, 0.0, -0.5]
    flight = batches(f + wave + FAINT)
    density = spectrum(flight)
    line = tones(density)
    lines = np.flatnonzero(line[:, 0]) * 0.5 / STEP / (len(density) - 1)
    assert len(lines)
    assert lines == pytest.approx(hz, abs=0.25)
    assert not line[:, 1].any()
    for kind in (Kind.PART, Kind.WHOLE):
        found = of_kind(tones_of(flight), kind)
        assert {tone.axis for tone in found} == {0, 2}
        x = max((tone for tone in found if tone.axis == 0), key=lambda tone: len(tone.lines))
        # What is in the window's skirts is left.
        velocity = wave[:, 0].std() / (2.0 * np.pi * hz)
        assert np.sqrt(x.variance) == pytest.approx(velocity, rel=0.1)
        left = (felt(without(flight, found)) - f)[SETTLED]
        assert np.all(left.std(axis=0)[[0, 2]] < 0.2 * wave[SETTLED].std(axis=0)[[0, 2]])
        assert left[:, 1].std() < 0.02
        told = density_of(found, density, stretches_of(flight)).sum(axis=0)
        assert told == pytest.approx(line.sum(axis=0), rel=0.1)


def test_a_motor_that_changes_its_speed_has_one_tone_after_the_other():
    """Half a minute at each: over the flight the lines hide each other."""
    f, hz = manoeuvre(), np.array([1.5, 1.75, 2.0, 2.3, 1.6, 1.85, 2.15, 1.4])
    wave = beat(np.repeat(hz, len(T) // len(hz)))[:, None] * [1.0, 0.0, 0.0]
    flight = batches(f + wave + FAINT)
    found = tones_of(flight)
    left, whole = (
        (felt(without(flight, of_kind(found, kind))) - f)[SETTLED, 0].std()
        for kind in (Kind.PART, Kind.WHOLE)
    )
    assert left < 0.5 * wave[SETTLED, 0].std()
    assert whole > 0.8 * wave[SETTLED, 0].std()


def test_a_restless_motor_has_a_wide_tone():
    """Its frequency wanders by a tenth within seconds: no narrow line holds the most of it."""
    f, rng = manoeuvre(), np.random.default_rng(5)
    slow = np.convolve(rng.normal(size=len(T)), np.ones(250) / 250.0, "same")
    wave = beat(1.6 + 0.12 * slow / slow.std())[:, None] * [0.0, 1.0, 0.0]
    flight = batches(f + wave + FAINT)
    found = tones_of(flight)
    narrow, wide = (
        (felt(without(flight, of_kind(found, kind))) - f)[SETTLED, 1].std()
        for kind in (Kind.PART, Kind.RESTLESS)
    )
    assert wide < 0.5 * wave[SETTLED, 1].std()
    assert wide < 0.8 * narrow


def test_samples_while_no_tone_lasts_are_as_they_were():
    f, there = manoeuvre() + FAINT, (T > 100.0) & (T < 150.0)
    flight = batches(f + (beat(2.65) * there)[:, None])
    found = of_kind(tones_of(flight), Kind.PART)
    got = felt(without(flight, found))
    assert len(found) == 3
    # A spectrum is of three stretches of twenty seconds, each half over the next.
    far = (T < 60.0) | (T > 190.0)
    np.testing.assert_array_equal(got[far], f[far])
    inside = (T > 110.0) & (T < 140.0)
    assert np.all((got - f)[inside].std(axis=0) < 0.2 * beat(2.65)[inside].std())


def test_without_a_tone_nothing_is_changed():
    flight = batches(manoeuvre())
    assert all(a is b for a, b in zip(without(flight, []), flight, strict=True))


def test_what_swings_with_a_damping_of_its_own_is_no_tone():
    """A pitch mode, damped by a fifth of the critical, shaken by white noise; and a manoeuvre."""
    for seed in range(20):
        assert not tones(spectrum(batches(manoeuvre(seed)))).any()
    shaking = np.random.default_rng(8).normal(size=(len(T), 3))
    r = np.fft.rfftfreq(len(T), STEP)[:, None] / 1.2
    mode = np.fft.irfft(np.fft.rfft(shaking, axis=0) / (1.0 - r**2 + 0.4j * r), len(T), axis=0)
    assert not tones(spectrum(batches(manoeuvre() + 0.2 * mode))).any()


@pytest.mark.parametrize("gap", [(), (3,), (3, 4)])
def test_segments_that_overlap_have_the_same_force_where_they_do(gap):
    flight = batches(manoeuvre() + beat(1.9)[:, None] + FAINT, gap=gap)
    made = without(flight, tones_of(flight))
    for a, b in pairwise(made):
        both, i, j = np.intersect1d(a.segment.t, b.segment.t, return_indices=True)
        np.testing.assert_array_equal(a.segment.raw_s[i], b.segment.raw_s[j])
        assert len(both) or b.fresh


def test_flight_too_short_for_a_stretch_is_none():
    """Eight seconds before a gap: what follows has its tones where it had them without these."""
    lasts = (T > 60.0) & (T < 160.0)
    flight = batches(manoeuvre() + beat(2.3)[:, None] * lasts[:, None] + FAINT, 30, gap=(1,))
    found = tones_of(flight)
    assert found
    assert [x.lines.keys() for x in found] == [x.lines.keys() for x in tones_of(flight[1:])]
    for changed in (with_parts, without):
        for a, b in zip(changed(flight, found)[1:], changed(flight[1:], found), strict=True):
            assert np.array_equal(a.segment.raw_s, b.segment.raw_s)
            if changed is with_parts:
                assert np.array_equal(a.segment.slow[PARTS][1], b.segment.slow[PARTS][1])


def test_a_flight_too_short_for_a_spectrum_has_no_tones():
    flight = batches(manoeuvre() + beat(1.9)[:, None], pieces=24)[:1]
    assert tones_of(flight) == []
    assert tones_of([]) == []
    assert without(flight, []) == flight
