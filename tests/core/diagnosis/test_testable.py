"""Which effects a recording can be asked for: those whose signals are there, and change."""

import numpy as np
import pytest

from onboard.core.diagnosis import testability
from onboard.core.physics.catalogue import catalogue
from onboard.core.physics.effect import Origin
from tests.core.diagnosis.flights import batches, resting

SIGNALS = {
    "temperature": lambda t: 30.0 + t / 10.0,
    "throttle": lambda t: 0.4 + 0.2 * np.sin(t),
    "vibration": lambda t: np.stack([1.0 + 0.5 * np.sin(t + i) for i in range(3)], axis=-1),
    "airspeed": lambda t: 15.0 + 3.0 * np.sin(t / 5.0),
    "clipping": lambda t: np.zeros(len(t)),
}
EVERYTHING = catalogue(Origin(100.0))


def flight(**signals):
    t = 100.0 + np.arange(0.0, 61.0, 0.5)
    slow = {name: (t, signal(t)) for name, signal in signals.items()}
    return batches(resting(np.random.default_rng(0), 60.0), slow=slow)


def asked(flown):
    present, absent = testability.testable_of(EVERYTHING, flown)
    return {e.effect for e in present}, {a.name: a.why for a in absent}


def needing(*names):
    """Effects with unknowns of their own that need these signals and perhaps more."""
    return {e.effect for e in EVERYTHING if e.unknowns and set(names) <= set(e.needs)}


def test_with_all_signals_every_effect_that_is_looked_for_is_asked_for():
    present, absent = asked(flight(**SIGNALS))
    assert present == {e.effect for e in EVERYTHING if e.unknowns}
    assert set(absent) == {e.effect for e in EVERYTHING if e.untestable}
    assert all(absent.values())


@pytest.mark.parametrize("name", ["temperature", "throttle", "vibration", "airspeed"])
def test_a_signal_that_is_missing_takes_its_effects_away_and_no_other(name):
    whole, _ = asked(flight(**SIGNALS))
    present, absent = asked(flight(**{k: v for k, v in SIGNALS.items() if k != name}))
    assert whole - present == needing(name)
    assert all(name in absent[e] and "recording" in absent[e] for e in needing(name))


@pytest.mark.parametrize("name", ["temperature", "throttle", "vibration"])
def test_a_signal_that_does_not_change_is_as_good_as_none(name):
    wide = 3 if name == "vibration" else 1

    def moving(spread):
        def signal(t):
            x = 20.0 + spread * (np.arange(len(t)) % 41) / 40.0
            return x if wide == 1 else np.stack([x, np.full_like(x, 20.0), x], axis=-1)

        return flight(**SIGNALS | {name: signal})

    still, why = asked(moving(0.0))
    enough, _ = asked(moving(0.01))
    assert needing(name)
    assert enough - still == needing(name)
    assert all("did not change" in why[e] for e in needing(name))


def test_a_single_wild_sample_is_no_change():
    def spike(t):
        x = np.full(len(t), 30.0)
        x[40] = 90.0
        return x

    present, _ = asked(flight(**SIGNALS | {"temperature": spike}))
    assert not needing("temperature") & present


def test_change_from_one_batch_to_the_next_counts():
    """Each batch is too short to show it: it is the flight that has to."""
    slowly = flight(**SIGNALS)
    for i, batch in enumerate(slowly):
        t, _ = batch.segment.slow["temperature"]
        batch.segment.slow["temperature"] = (t, np.full(len(t), 30.0 + 0.1 * i))
    assert needing("temperature") <= asked(slowly)[0]


def test_a_signal_that_is_there_half_of_the_time_cannot_be_followed():
    flown = flight(**SIGNALS)
    del flown[2].segment.slow["throttle"]
    present, absent = asked(flown)
    assert not needing("throttle") & present
    assert all("throttle" in absent[e] for e in needing("throttle"))


def test_without_a_flight_nothing_that_needs_a_signal_can_be_asked():
    present, _ = asked([])
    assert present == {e.effect for e in EVERYTHING if e.unknowns and not e.needs}
