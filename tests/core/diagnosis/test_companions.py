"""A jump of one accelerometer shows in its differences from the others; a common one does not."""

import numpy as np
import pytest

from onboard.core.diagnosis.companions import Companion, Companions
from onboard.core.diagnosis.limits import CLEARLY, CONTACT_S
from onboard.core.estimate.limits import SHARED_WINDOW_S
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.bias_step import BiasStep
from tests.core.diagnosis.flights import batches, flown

SECONDS, RATE = 90.0, 50.0
IN_FORCE = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
PRIOR = np.repeat([0.01, 0.3], 3)
AT = 46.3
"""s after the first sample: inside of a window."""
T0 = 100.0


def vehicle(jumps, *, count=3, noise=0.05, seed=1, shaken=()):
    """Accelerometers on one trajectory, each with its own offset; ``jumps`` by number.

    The first one is off while it is ``shaken``: from when to when (s), and by how much.
    """
    rng = np.random.default_rng(seed)
    shared = flown(rng, SECONDS, rate=RATE)
    since = np.arange(len(shared)) / RATE
    made = {}
    for imu in range(1, count + 1):
        raw = shared + noise * rng.normal(size=shared.shape) + 0.1 * rng.normal(size=3)
        at, size = jumps.get(imu, (AT, np.zeros(3)))
        raw[since >= at] += size
        for start, end, by in shaken if imu == 1 else ():
            raw[(since >= start) & (since < end)] += by
        made[imu] = Companion(batches(raw, rate=RATE, t0=T0), IN_FORCE, PRIOR)
    return Companions(made)


SIZE = np.array([0.3, -0.1, 0.0])


def test_of_three_the_one_that_jumped_is_blamed():
    found = vehicle({2: (AT, SIZE)})
    jump = found.jump(2, Origin(T0))
    assert jump.moment == pytest.approx(T0 + AT, abs=0.3)
    off = (jump.witness.size - SIZE) / jump.witness.sigma
    assert np.all(np.abs(off) < 4.0)
    assert np.all(jump.witness.sigma < 0.02)
    assert jump.witness.blame > CLEARLY
    for other in (1, 3):
        seen = found.jump(other, Origin(T0))
        assert seen is None or seen.witness.blame < -CLEARLY


def test_of_two_nobody_is_blamed_and_the_sizes_are_opposite():
    found = vehicle({1: (AT, SIZE)}, count=2)
    one, other = found.jump(1, Origin(T0)), found.jump(2, Origin(T0))
    assert one.witness.blame == pytest.approx(0.0, abs=1e-9)
    assert one.witness.size == pytest.approx(-other.witness.size)
    assert one.unknowns[0].prior == pytest.approx(SIZE[0], abs=0.03)


def test_what_all_do_alike_is_in_no_difference():
    found = vehicle(dict.fromkeys((1, 2, 3), (AT, SIZE)))
    assert found.jump(1, Origin(T0)) is None


def test_of_a_jump_that_was_found_otherwise_they_say_what_they_know():
    found = vehicle(dict.fromkeys((1, 2, 3), (AT, SIZE)))
    alone = vehicle({1: (AT, SIZE)}).jump(1, Origin(T0))
    told = found.of(alone, 1)
    assert told.witness.gain < 15.0
    assert told.witness.size == pytest.approx(np.zeros(3), abs=0.03)


@pytest.mark.parametrize("within", [0.02, 0.2, 0.35, 0.5, 0.65, 0.8, 0.98])
def test_where_in_a_window_it_jumps_does_not_matter(within):
    """The window in which it jumps has a part of it, and was all that they were asked."""
    at = 46.0 + within * SHARED_WINDOW_S
    found = vehicle({1: (at, SIZE)})
    by_themselves = found.jump(1, Origin(T0))
    told = found.of(BiasStep(Origin(T0)).at(T0 + at), 1).witness
    assert told.gain > 0.8 * by_themselves.witness.gain
    assert np.all(np.abs(told.size - SIZE) < 4.0 * told.sigma)


def test_a_landing_is_not_asked():
    found = vehicle({1: (SECONDS - 0.5 * CONTACT_S, SIZE)})
    assert found.jump(1, Origin(T0)) is None


def test_one_alone_says_nothing():
    found = vehicle({1: (AT, SIZE)}, count=1)
    assert found.jump(1, Origin(T0)) is None
    assert found.shown_from(1, np.ones(3), 1.0) is None


@pytest.mark.parametrize("count", [2, 3])
def test_the_size_that_would_have_shown_is_that_which_shows(count):
    """Of two, GPS has to say which; of three the others do."""
    known = np.full(3, 2.0 * CLEARLY / 0.2**2)
    size = vehicle({}, count=count).shown_from(1, known, 1.0)
    if count == 2:
        assert size == pytest.approx(np.full(3, 0.2 / np.sqrt(2.0)), rel=0.05)
        return
    assert np.all(size < 0.1)
    for factor, shown in ((2.0, True), (0.4, False)):
        jump = vehicle({1: (AT, factor * size * [1, 0, 0])}, seed=3).jump(1, Origin(T0))
        told = jump is not None and abs(jump.moment - T0 - AT) < 1.0
        assert told is shown


def test_quiet_flights_show_no_jump():
    """One in ten is looked into; none is blamed on anyone clearly and large."""
    looked = [vehicle({}, seed=s).jump(1, Origin(T0)) for s in range(12)]
    assert sum(j is not None for j in looked) <= 4  # of 12 at one in ten, exceeded once in 200


@pytest.mark.parametrize("seed", range(1, 5))
@pytest.mark.parametrize("at", [(0.0, 1.0), (1.0, 2.0), (60.0, 61.0)])
def test_what_shakes_a_vehicle_for_a_second_is_no_jump(at, seed):
    """At the begin of a flight, too, where few windows are before it."""
    launch = (*at, np.array([0.0, 0.08, 0.1]))
    for imu in (1, 2):
        jump = vehicle({}, count=2, seed=seed, shaken=[launch]).jump(imu, Origin(T0))
        assert jump is None or jump.witness.gain < 25.0  # as in a quiet flight, by chance


@pytest.mark.parametrize("size", [SIZE, 0.3 * SIZE, 0.15 * SIZE])
def test_a_jump_shows_beside_what_shakes_the_vehicle(size):
    launch, bump = (0.0, 1.0, np.array([0.0, 0.08, 0.1])), (70.0, 71.0, np.array([0.3, 0.0, 0.4]))
    jump = vehicle({2: (AT, size)}, shaken=[launch, bump]).jump(2, Origin(T0))
    assert jump.moment == pytest.approx(T0 + AT, abs=2.0)
    assert np.all(np.abs(jump.witness.size - size) < 4.0 * jump.witness.sigma)


def test_two_streams_of_one_sensor_tell_nothing_and_break_nothing():
    """Some logs have the same accelerometer twice."""
    raw = flown(np.random.default_rng(1), SECONDS, rate=RATE)
    made = {i: Companion(batches(raw, rate=RATE, t0=T0), IN_FORCE, PRIOR) for i in (1, 2)}
    found = Companions(made)
    assert found.jump(1, Origin(T0)) is None
    told = found.of(BiasStep(Origin(T0)).at(T0 + AT), 1)
    assert np.all(np.isfinite(told.witness.size))
    assert np.all(told.witness.sigma > 0.0)
