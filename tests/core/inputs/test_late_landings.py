"""However late an autopilot says that it has landed, standing is no flight; and hovering is."""

import itertools

import numpy as np
import pytest

from onboard.core.inputs.assembly import Assembly, AssemblySettings
from onboard.core.inputs.limits import GROUND_M, LONGEST_ROLL_S, TOUCHED_S
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.reach import NEAR
from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample

RATE, FIXES = 50.0, 5.0
FLYING, HOVERING, DESCENDING, STANDING = (4.0, 0.0), (0.05, 0.0), (0.0, 0.5), (0.0, 0.0)
"""Speed over ground and down, m/s."""


def fix(t, level, down, height):
    return GpsFix(t, 1, 3, 0.8, 0.1, height, level, 0.0, down)


def batches_of(*legs, word_after=None, batch_s=10.0, climbs=True):
    """Batches of legs ``(seconds, (level, down))`` in the air, handed out as they come in.

    Args:
        legs: one after the other.
        word_after: s after the last leg at which the autopilot says that it has landed; until then
            it stands.  None: the recording ends without.
        batch_s: of the assembly.
        climbs: whether the receiver tells vertical speeds.
    """
    ends = np.cumsum([seconds for seconds, _ in legs])
    end = float(ends[-1]) + (word_after or 0.0)
    assembly, parameters = Assembly(AssemblySettings(batch_s=batch_s)), ParametersInForce()
    samples = [(t, 0) for t in np.arange(0.0, end, 1.0 / RATE)]
    fixes = [(t, 1) for t in np.arange(0.1, end, 1.0 / FIXES)]
    out, height = [], 100.0
    for t, kind in sorted(samples + fixes):
        leg = int(np.searchsorted(ends, t, side="right"))
        if kind == 0:
            # Rotors that idle shake it as much on the ground as in the air.
            force, rate = (0.0, 0.0, -9.8 + np.sin(9.0 * t)), (0.2 * np.sin(7.0 * t), 0.0, 0.3)
            assembly.streams.imu(ImuSample(t, 1, force, rate), parameters)
            assembly.streams.attitude(AttitudeSample(t, 0.01, 0.0, 0.3 * t))
        else:
            level, down = legs[leg][1] if leg < len(legs) else STANDING
            height -= down / FIXES
            made = fix(t, level, down if climbs else None, height)
            assembly.streams.fixes.add(made, trusted=True)
            out += assembly.take(parameters, grounded=False).get(1, [])
    touched = np.inf if word_after is None else end - TOUCHED_S
    out += assembly.take(parameters, everything=True, grounded=False, touched=touched).get(1, [])
    return out


def spans(batches):
    return [(float(b.fixes.t[0]), float(b.fixes.t[-1])) for b in batches]


@pytest.mark.parametrize("late", [4.0, 12.5, 40.0, 0.9 * LONGEST_ROLL_S])
def test_how_late_the_word_is_makes_no_flight(late):
    landing = (60.0, FLYING), (8.0, DESCENDING)
    got = spans(batches_of(*landing, word_after=late))
    assert got == spans(batches_of(*landing, word_after=20.0))
    assert got[-1][1] <= 68.0 - NEAR.before - NEAR.ahead
    assert got[-1][1] >= 68.0 - NEAR.before - NEAR.ahead - 2.0 / FIXES


def test_a_word_that_comes_in_time_is_believed():
    got = spans(batches_of((60.0, FLYING), (8.0, DESCENDING), word_after=0.5))
    assert got[-1][1] == pytest.approx(68.5 - TOUCHED_S, abs=1.0 / FIXES)


@pytest.mark.parametrize("hover", [3.0, 25.0, 60.0, 2.0 * LONGEST_ROLL_S])
@pytest.mark.parametrize("after", [(20.0, FLYING), (5.0, DESCENDING)])
def test_a_hover_is_flight(hover, after):
    """What is still and moves again has hovered: all of it is handed out, in ordinary batches."""
    batch_s = 10.0
    got = spans(batches_of((60.0, FLYING), (hover, HOVERING), after, word_after=15.0))
    assert all(a[1] == b[0] for a, b in itertools.pairwise(got))
    landed = 60.0 + hover + after[0]
    assert got[-1][1] >= landed - NEAR.before - NEAR.ahead - 2.0 / FIXES
    assert got[-1][1] <= landed
    assert max(b - a for a, b in got) < 2.0 * batch_s + 1.0 / FIXES


def test_a_recording_that_ends_in_a_hover_has_all_of_it():
    got = spans(batches_of((60.0, FLYING), (50.0, HOVERING)))
    assert got[-1][1] > 110.0 - NEAR.ahead - 2.0 / FIXES
    assert max(b - a for a, b in got) < 20.0 + 1.0 / FIXES


def test_what_nobody_saw_moving_is_not_said_to_have_come_to_a_stand():
    got = spans(batches_of((60.0, HOVERING), word_after=5.0))
    assert got[-1][1] == pytest.approx(65.0 - TOUCHED_S, abs=1.0 / FIXES)


@pytest.mark.parametrize(("sinking", "climbs"), [(0.2, True), (0.5, False)])
def test_a_slow_descent_is_flight_until_it_is_near_the_ground(sinking, climbs):
    """Its speed says nothing, or is too small to say it; its height does."""
    landing = (60.0, FLYING), (40.0, HOVERING), (40.0, (0.0, sinking))
    got = spans(batches_of(*landing, word_after=20.0, climbs=climbs))
    assert all(a[1] == b[0] for a, b in itertools.pairwise(got))
    low = GROUND_M / sinking
    assert 140.0 - low - NEAR.before - NEAR.ahead - 2.0 / FIXES <= got[-1][1] <= 140.0 - NEAR.ahead
