"""A moving receiver that says again what it has said has measured nothing; one at rest may."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from onboard.core.diagnosis.refusals import believed
from onboard.core.gps.distrust import Distrust, RefusedFixes, WindowClosed
from onboard.core.gps.trust import TrustWindow
from onboard.core.inputs.samples import GpsFix

RADIUS_M = 6.371e6


def flown(period=0.2, seconds=60.0, speed=20.0, turning=0.3):
    """Fixes of a plane that circles, noise of a centimetre a second on its velocity."""
    rng = np.random.default_rng(3)
    t = np.arange(0.0, seconds, period)
    course = turning * t
    north, east = speed / turning * np.sin(course), -speed / turning * np.cos(course)
    v = speed * np.column_stack([np.cos(course), np.sin(course)])
    v += rng.normal(0.0, 0.01, v.shape) * (speed > 0.0)
    return [
        GpsFix(
            t=a,
            receiver=1,
            fix_type=3,
            latitude=n / RADIUS_M,
            longitude=e / RADIUS_M,
            altitude=400.0,
            v_n=x,
            v_e=y,
            v_d=0.0,
            satellites=12,
            hdop=0.8,
        )
        for a, n, e, (x, y) in zip(*(z.tolist() for z in (t, north, east, v)), strict=True)
    ]


def held(fixes, share=0.1, what=("latitude", "longitude", "altitude", "v_n", "v_e", "v_d")):
    """Now and then what the receiver said before, with a new stamp."""
    rng = np.random.default_rng(8)
    out = fixes[:1]
    for fix in fixes[1:]:
        again = rng.random() < share
        out.append(replace(fix, **{k: getattr(out[-1], k) for k in what}) if again else fix)
    return out


def fed(fixes):
    """Through a window: events, how many were no fixes, and the window."""
    window, events, repeats = TrustWindow(), [], 0
    for fix in fixes:
        events += window.feed(fix)
        repeats += window.repeats
    return events, repeats, window


@pytest.mark.parametrize("period", [0.1, 0.2, 1.0])
def test_repeated_fixes_in_motion_are_no_fixes_and_close_nothing(period):
    fixes = held(flown(period, seconds=300.0 * period))
    same = [(a.v_n, a.v_e, a.latitude) == (b.v_n, b.v_e, b.latitude) for a, b in pairwise(fixes)]
    in_a_row = sum(a and b for a, b in pairwise(same))
    events, repeats, window = fed(fixes)
    closed = [e.reason for e in events if isinstance(e, WindowClosed)]
    # At one a second two in a row are two seconds of nothing.
    most = in_a_row if period == 1.0 else 0
    assert set(closed) <= {Distrust.STALE}
    assert len(closed) <= most
    assert sum(same) - most <= repeats <= sum(same)
    assert repeats > 10
    assert "gps_glitch" not in window.rejected


def test_a_repeat_at_once_a_second_is_a_fix_that_is_missing():
    fixes = flown(1.0)
    fixes[20] = replace(fixes[19], t=fixes[20].t)
    events, repeats, window = fed(fixes)
    assert (len(events), repeats, window.rejected) == (1, 1, {})
    assert window.trusted_s == pytest.approx(fixes[-1].t)


def test_a_receiver_at_rest_may_say_the_same_for_ever():
    fixes = [replace(fix, v_n=0.3, v_e=0.0, latitude=0.8, longitude=0.1) for fix in flown()]
    events, repeats, window = fed(fixes)
    assert (len(events), repeats, window.rejected) == (1, 0, {})


def test_where_only_the_position_repeats_the_velocity_is_a_measurement():
    places = ("latitude", "longitude", "altitude")
    _, repeats, _ = fed(held(flown(), what=places))
    assert repeats == 0


def test_where_there_is_no_position_steady_velocity_is_no_repeat():
    fixes = [replace(fix, latitude=0.0, longitude=0.0, v_n=20.0, v_e=0.0) for fix in flown()[:4]]
    assert fed(fixes)[1] == 0


def test_one_that_goes_on_repeating_itself_is_stale_and_recovers():
    fixes = flown(seconds=20.0)
    stuck = [replace(fixes[40], t=fix.t) for fix in fixes[40:60]]
    events, repeats, window = fed([*fixes[:40], *stuck, *fixes[60:]])
    assert [e.reason for e in events if isinstance(e, WindowClosed)] == [Distrust.STALE]
    assert repeats == 4
    assert window.is_open


class Part:
    """A batch as far as fixes are asked for."""

    fresh = False

    def __init__(self, t, trusted):
        self.fixes = type("Fixes", (), {"t": np.array(t)})
        self.trusted = np.array(trusted)


def test_fixes_that_contradict_each_other_were_to_be_used_and_others_were_not():
    parts = [
        Part([0.0, 1.0, 2.0], [True, False, False]),
        Part([2.0, 3.0, 4.0], [False, False, True]),
    ]
    jumped = RefusedFixes(1.0, 2.0, Distrust.GPS_GLITCH)
    jammed = RefusedFixes(3.0, 3.0, Distrust.JAMMED)
    assert believed(parts, [jumped, jammed]) == 4
    assert believed(parts, []) == 2
