"""What is low next to a stand is rolling, where nobody says what is flight."""

import numpy as np
import pytest

from onboard.core.inputs.limits import GROUND_M, LONGEST_ROLL_S
from onboard.core.inputs.rolling import Rolling
from onboard.core.inputs.segments import Fixes

HZ = 5.0


class Flown:
    """Legs one after the other: how long, to which height, how fast."""

    def __init__(self, *legs, noise=0.3, seed=0):
        rng, heights, speeds, at = np.random.default_rng(seed), [], [], 100.0
        for seconds, to, speed in legs:
            n = round(seconds * HZ)
            heights.append(np.linspace(at, 100.0 + to, n, endpoint=False))
            speeds.append(np.full(n, float(speed)))
            at = 100.0 + to
        self.height = np.concatenate(heights)
        self.height = self.height + noise * rng.uniform(-1.0, 1.0, len(self.height))
        self.speed = np.concatenate(speeds)
        self.t = np.arange(len(self.height)) / HZ

    def portions(self, batch_s=10.0):
        """(first, end) of all that is handed out as flight, s, as a stream has it."""
        rolling, out, first = Rolling(), [], 0
        for now in range(len(self.t)):
            seen = slice(first, now + 1)
            t, height, speed = self.t[seen], self.height[seen], self.speed[seen]
            last = now == len(self.t) - 1
            ready = np.inf if last else rolling.held(t, height, speed)
            n = int(np.searchsorted(t, ready, side="right"))
            if not last and (n < 2 or t[n - 1] - t[0] < batch_s):
                continue
            v_n = np.stack([speed[:n], 0.0 * speed[:n], 0.0 * speed[:n]], axis=-1)
            fixes = Fixes(t[:n], v_n, height[:n], 0.0 * t[:n])
            if np.percentile(speed[:n], 95) < 0.3:
                rolling.stands(fixes.t, fixes.height)
            else:
                i, j = rolling.flight(fixes)
                if j > i:
                    out.append((float(t[i]), float(t[j - 1])))
            first += n - 1
        return out


def spanned(portions):
    """First and last moment of flight, and how much of it there was."""
    return portions[0][0], portions[-1][1], sum(b - a for a, b in portions)


@pytest.mark.parametrize("batch_s", [5.0, 10.0, 17.0])
def test_the_way_to_the_runway_and_back_is_none(batch_s):
    flown = Flown(
        (30, 0, 0), (40, 0, 5), (10, 0, 15), (20, 60, 18), (100, 60, 18), (20, 0, 18),
        (12, 0, 8), (30, 0, 4), (20, 0, 0),
    )  # fmt: skip
    first, last, total = spanned(flown.portions(batch_s))
    assert first == pytest.approx(80.0, abs=2.0)
    assert last == pytest.approx(220.0, abs=2.0)
    assert total == pytest.approx(140.0, abs=4.0)


def test_a_low_pass_is_flight():
    flown = Flown((30, 0, 0), (20, 60, 18), (60, 0, 18), (15, 0, 18), (20, 60, 18), (20, 60, 18))
    first, last, total = spanned(flown.portions())
    assert last - first - total < 1.0
    assert last == pytest.approx(flown.t[-1], abs=0.3)


def test_a_hover_is_no_ground():
    """At its height the vehicle goes on: nothing of that is rolling."""
    flown = Flown((20, 0, 0), (10, 40, 0.2), (30, 40, 0), (60, 40, 8), (20, 40, 0), (60, 40, 8))
    got = flown.portions()
    moving = sum(b - a for a, b in got if b > 60.0)
    assert moving > 115.0


def test_close_to_the_ground_for_minutes_is_flown_there():
    flown = Flown((30, 0, 0), (5, 1, 3), (300, 1, 3))
    _, last, total = spanned(flown.portions())
    assert total > 300.0 - LONGEST_ROLL_S
    assert last == pytest.approx(flown.t[-1], abs=0.3)


def test_before_the_first_stand_all_is_flight():
    flown = Flown((60, 0, 12), (60, 30, 12))
    assert spanned(flown.portions()) == pytest.approx((0.0, flown.t[-1], flown.t[-1]))


def test_a_height_that_is_not_measured_says_nothing():
    flown = Flown((30, 0, 0), (100, 0, 12), noise=0.0)
    _, last, total = spanned(flown.portions())
    assert total > 95.0
    assert last == pytest.approx(flown.t[-1], abs=0.3)


def test_what_is_held_back_is_not_held_for_ever():
    rolling = Rolling()
    rolling.stands(np.arange(10.0), np.full(10, 100.0))
    t = np.arange(0.0, 300.0)
    height = np.where(t < 100.0, 130.0, 100.0 + 0.5 * GROUND_M)
    rolling.flies()
    speed = np.full(len(t), 10.0)
    assert rolling.held(t[:150], height[:150], speed[:150]) == 100.0
    assert rolling.held(t, height, speed) == np.inf
    speed[290:] = 0.0
    assert rolling.held(t[150:], height[150:], speed[150:]) == np.inf
