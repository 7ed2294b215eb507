"""Which of two receivers is watched, and when one is given up for the other."""

import pytest

from onboard.core.gps.distrust import WindowOpened
from onboard.core.gps.limits import GIVEN_UP_S
from onboard.core.gps.trust import TrustWindow
from onboard.core.inputs.samples import ImuSample
from tests.core.gps.fixes import STEP, fix, fly, opened


def test_only_one_receiver_is_watched():
    window = TrustWindow(receiver=2)
    assert fly(window, 0.0, 1.0) == []
    assert fly(window, 1.2, 2.0, receiver=2) == [WindowOpened(1.2)]
    first = TrustWindow()
    fly(first, 0.0, 1.0)
    assert first.feed(fix(1.1, receiver=2, fix_type=0)) == ()
    assert first.receiver == 1


def both(window, start, end, *, first, second):
    """Two receivers side by side; ``first`` and ``second`` are changes, None: silent."""
    events = []
    for k in range(round((end - start) / STEP) + 1):
        t = start + k * STEP
        for number, changes in ((1, first), (2, second)):
            if changes is not None:
                events += window.feed(fix(t, receiver=number, **changes))
        events += window.feed(ImuSample(t, 1, (0.0, 0.0, -9.8), (0.0, 0.0, 0.0)))
    return events


@pytest.mark.parametrize("after", [{"fix_type": 0}, None])
def test_a_receiver_that_has_never_had_a_fix_is_given_up_for_one_that_has(after):
    window = TrustWindow()
    window.feed(fix(0.0, fix_type=0))
    assert both(window, 0.2, GIVEN_UP_S - 1.0, first=after, second={}) == []
    assert window.receiver == 1
    events = both(window, GIVEN_UP_S - 0.8, GIVEN_UP_S + 5.0, first=after, second={})
    assert window.receiver == 2
    assert opened(window, events) == pytest.approx(GIVEN_UP_S, abs=1.0)


@pytest.mark.parametrize("named", [None, 1])
def test_a_receiver_that_was_trusted_is_not_exchanged_before_the_next_flight(named):
    window = TrustWindow(receiver=named)
    both(window, 0.0, 5.0, first={}, second={})
    both(window, 5.2, 5.0 + 2 * GIVEN_UP_S, first={"fix_type": 0}, second={})
    assert window.receiver == 1
    assert not window.is_open
    window.restart(5.0 + 2 * GIVEN_UP_S)
    both(window, 1.0, 2 * GIVEN_UP_S, first=None, second={})
    assert window.receiver == 1, "sums may go on over a boot"
    window.begin_flight()
    both(window, 2 * GIVEN_UP_S + 1.0, 4 * GIVEN_UP_S, first=None, second={})
    assert (window.receiver, window.is_open) == ((2, True) if named is None else (1, False))


def test_a_slow_start_is_waited_for():
    window = TrustWindow()
    both(window, 0.0, GIVEN_UP_S - 5.0, first={"fix_type": 0}, second={})
    both(window, GIVEN_UP_S - 4.8, 2 * GIVEN_UP_S, first={}, second={})
    assert window.receiver == 1
    assert window.is_open
