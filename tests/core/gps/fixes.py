"""Fixes of a receiver, and what a trust window makes of many."""

from dataclasses import replace

from onboard.core.gps.distrust import WindowOpened
from onboard.core.inputs.samples import GpsFix

STEP = 0.2


def fix(t, **changes):
    """A receiver that flies north at 10 m/s from 47 N 8 E, five times a second."""
    good = GpsFix(
        t=t,
        receiver=1,
        fix_type=3,
        latitude=0.82 + 10 * t / 6.371e6,
        longitude=0.14,
        altitude=400.0,
        v_n=10.0,
        v_e=0.0,
        satellites=11,
        hdop=0.9,
    )
    return replace(good, **changes)


def fly(window, start, end, **changes):
    """Feed fixes every STEP from start up to and including end; all events."""
    events = []
    for k in range(round((end - start) / STEP) + 1):
        events += window.feed(fix(start + k * STEP, **changes))
    return events


def opened(window, events):
    """Time of the only opening in ``events``, which must be of an open window."""
    assert window.is_open
    (event,) = [e for e in events if isinstance(e, WindowOpened)]
    return event.t
