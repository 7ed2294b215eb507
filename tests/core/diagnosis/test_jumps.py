"""A jump is placed from the flight around it and the sums of the rest; a shock is no jump."""

import weakref
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.explaining import heard
from onboard.core.diagnosis import jumps, onsets, stepped, testability
from onboard.core.diagnosis.effort import FORGOTTEN_S, MOST_AT_ONCE
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.limits import SCAN_S
from onboard.core.diagnosis.procedure import diagnose
from onboard.core.diagnosis.score import Peak, surprise, time_sigma
from onboard.core.diagnosis.selection import Fitter
from onboard.core.diagnosis.stepped import JumpingPass, Places, Stepped
from onboard.core.estimate.calibration_model import calibration_model
from onboard.core.estimate.engine import through
from onboard.core.physics.catalogue import catalogue
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.bias_step import BiasStep
from sitl.builtin import effects as concealed
from sitl.builtin.effects.accelerometer import ByAxis
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec

AT = 70.0
LANDED = 89.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Shock(ByAxis):
    """A blow of 0.2 s that no sample shows: it kicks the vehicle and turns it.

    The recorded attitude does not know of the turn, so the force has turned against it.
    """

    time: float
    turn: tuple[float, float]

    def reads_too_much(self, scene):
        since = scene.elapsed - self.time
        kick = np.outer((since >= 0.0) & (since < 0.2), self.sizes)
        turn = np.array([*self.turn, 0.0])
        return kick + np.where(since[:, None] >= 0.1, np.cross(scene.f_b, turn), 0.0)


@pytest.mark.parametrize("sigma", [0.4, 1.0, 2.5])
def test_a_moment_is_known_as_its_likelihood_bends(sigma):
    t = np.arange(-12.0, 12.0, 0.5)
    gain = 40.0 - ((t - 0.2) / sigma) ** 2
    assert time_sigma(t, gain, 0.5) == pytest.approx(np.hypot(sigma, 0.5 / np.sqrt(12.0)), rel=0.02)


def test_one_moment_is_known_to_the_spacing_of_those_looked_at():
    assert time_sigma(np.array([3.0]), np.array([9.0]), 0.6) == pytest.approx(0.6 / np.sqrt(12.0))


SAMPLE_S = 0.02
SAMPLED = SimpleNamespace(
    batches=[SimpleNamespace(segment=SimpleNamespace(t=SAMPLE_S * np.arange(500)))]
)


@pytest.mark.parametrize(("sigma", "known"), [(3.0, 3.0), (0.2, 0.2), (0.03, 0.03), (1e-4, 0.0)])
def test_a_moment_is_looked_at_as_closely_as_its_likelihood_bends(sigma, known):
    def like(t):
        asked.append(t)
        return 9000.0 - 500.0 * np.log1p(((t - 50.37) / sigma) ** 2 / 500.0)

    asked = []
    t = np.arange(42.0, 59.0, 0.5)
    peak = jumps._resolved(SAMPLED, like, Peak(t, like(t), 0.5))
    assert peak.best == pytest.approx(50.37, abs=max(0.2 * sigma, SAMPLE_S))
    assert peak.sigma == pytest.approx(known, rel=0.3, abs=0.5 * SAMPLE_S)
    assert len(asked) == (1 if sigma > 0.5 else len(asked)) <= 4


def test_a_moment_that_no_fix_tells_is_as_unsure_as_the_gap_is_long():
    t = np.arange(40.0, 80.0, 2.0)
    peak = Peak(t, np.where((t > 50.0) & (t < 70.0), 300.0, 0.0), 2.0)
    near = peak.best + 0.5 * np.arange(-6.0, 7.0)
    # The next pass over the flight counts all of them otherwise.
    closer = peak.closer(near, np.where((near > 50.0) & (near < 70.0), 310.0, 10.0), 0.5)
    assert closer.sigma == pytest.approx(20.0 / np.sqrt(12.0), rel=0.1)


@pytest.fixture(scope="module", params=["copter", "plane"])
def full(request):
    """A flight of 160 s whose offsets jump at :data:`AT`, with the columns of the catalogue.

    The plane's board is turned by 90 degrees: its sensor's axes are not the body's.
    """
    spec = FlightSpec(
        vehicle=request.param,
        seed=5,
        duration=140.0,
        imus=random_imus(5),
        orientation=2 if request.param == "plane" else 0,
        effects=(concealed.BiasStep(time=AT, x=0.15, y=-0.1, z=0.08),),
    )
    calibrator = heard(spec)
    t0 = calibrator.first_sample
    engine = calibrator.engine(1)
    testable, _ = testability.testable_of(catalogue(Origin(t0)), engine.batches)
    return Examination(engine, testable, t0=t0, batches=engine.batches).with_noise()


def test_another_examination_of_a_flight_begins_with_what_this_one_knows(full):
    known = full.found()
    jump = BiasStep(Origin(0.0)).at(full.point.skew_from + AT)
    other = full.beside([jump])
    at = [other.model.index[u.name] for u in full.model.unknowns]
    np.testing.assert_array_equal(other.known.theta[at], known.theta)
    np.testing.assert_array_equal(other.known.covariance[np.ix_(at, at)], known.covariance)
    # Of the jump it knows what is known of any.
    mine = other.indices(jump)
    own = np.diag(other.known.covariance)[mine]
    np.testing.assert_allclose(own, other.model.prior_sigma[mine] ** 2)


def test_an_examination_goes_with_its_last_reference(full):
    """What it keeps of a flight are megabytes, which must not wait for cycles to be collected."""
    other = full.beside(())
    gone = weakref.ref(other)
    del other
    assert gone() is None


def gains(full, times):
    return np.array(onsets.gains(full, (), [BiasStep(Origin(0.0)).at(float(t)) for t in times]))


@pytest.mark.slow
def test_the_rest_of_the_flight_counts_as_if_it_were_flown_through(full, monkeypatch):
    times = full.point.skew_from + AT + np.arange(-8.0, 9.0, 4.0)
    near = gains(full, times)
    monkeypatch.setattr(onsets, "FORGOTTEN_S", 1e6)
    whole = gains(full, times)
    assert whole.max() > 200.0
    assert near == pytest.approx(whole, rel=0.15)


@pytest.mark.slow
def test_jumps_at_all_moments_gain_what_each_gains_by_itself(full, monkeypatch):
    """Up to what a jump bends a flight that is gone through as one without."""
    times = np.arange(full.point.skew_from + 42.0, full.blocks[-1].end - 8.0, 4.0)
    looked, alone = Stepped(full, times), gains(full, times)
    assert times[np.argmax(looked.gain)] == pytest.approx(AT, abs=3.0)
    assert looked.gain == pytest.approx(alone, rel=0.15, abs=0.05 * alone.max())
    monkeypatch.setattr(stepped, "FORGOTTEN_S", 1e6)
    whole = Stepped(full, times)
    assert looked.gain == pytest.approx(whole.gain, rel=0.15, abs=0.02 * alone.max())


@pytest.mark.slow
def test_what_a_jump_explains_is_that_of_normal_equations_with_it(full):
    moment = full.blocks[-1].end - 20.0
    looked = Stepped(full, [moment])
    model = calibration_model(full.point, full.prior, full.settings.needs, (Places(1),))
    m = model.slices[Places.name].start
    going = JumpingPass(full, model)
    going.jumps = [(m, moment)]
    blocks = [through(going, batch, full.settings.coast_s).block for batch in full.batches]
    fitter = Fitter(blocks, model)
    before, after = (fitter.fit(range(n), held_out=False) for n in (m, m + 3))
    assert looked.gain == pytest.approx([fitter.gain(before, after)], rel=1e-6, abs=1e-6)
    known = np.diag(fitter.informed(after, range(m, m + 3)))
    assert looked.known[0] == pytest.approx(known, rel=1e-6)


def reach_of_blocks(full):
    """s: at the start of a block, a jump shows that is anywhere in those beside it."""
    return 1.5 * float(np.median([b.end - b.start for b in full.blocks]))


@pytest.mark.slow
@pytest.mark.parametrize(("off", "reach"), [(25.0, reach_of_blocks), (-3.0, lambda _: 4.0)])
def test_it_is_found_to_the_second(full, off, reach):
    # Moments are on the boot clock, as the effect's is; samples begin a second later.  The first is
    # past the reach of 15 s: found at its edge, it is looked for further there.
    found = jumps.jump_near(full, (), AT + off, reach(full))
    assert found.moment == pytest.approx(AT, abs=1.0)
    assert jumps.shock_instead(full, found) is None


@pytest.mark.slow
@pytest.mark.parametrize(("off", "sigma"), [(1.5, 1.0), (20.0, 25.0)])
def test_a_moment_that_others_hardly_know_is_placed_by_gps_with_few_columns_at_once(
    full, monkeypatch, off, sigma
):
    counts, fitted = [], jumps.fitted

    def counted(full, chosen, steps):
        counts.append(len(steps))
        return fitted(full, chosen, steps)

    monkeypatch.setattr(jumps, "fitted", counted)
    seen = BiasStep(Origin(0.0)).at(full.point.skew_from + AT + off, sigma=sigma)
    found = jumps.placed(full, seen)
    assert found.moment - full.point.skew_from == pytest.approx(AT, abs=1.5)
    assert found.onset_sigma < 1.5
    assert max(counts) <= MOST_AT_ONCE


def scan(gain):
    """Moments of a scan of 300 s, and what a jump there explains."""
    return [
        jumps.Looked(float(t), float(gain(t)), np.ones(3)) for t in np.arange(0.0, 300.0, SCAN_S)
    ]


@pytest.mark.parametrize("at", [117.0, 118.0, 119.0])
def test_a_jump_between_two_moments_of_a_scan_is_within_reach_of_what_looks_better(at):
    # It explains half 3 s from where it is; an EKF that follows it makes a later one look better.
    def gain(t):
        return max(4100.0 * 0.5 ** (abs(t - at) / 3.0), 3600.0 - 3.0 * (t - 126.0) ** 2)

    looked = scan(gain)
    best = max(looked, key=lambda x: x.gain)
    assert gain(at) > best.gain
    assert abs(best.moment - at) > SCAN_S
    assert abs(best.moment - at) < jumps.reach_of_scan(looked)


def test_a_jump_that_stands_alone_is_looked_for_where_it_is():
    assert jumps.reach_of_scan(scan(lambda t: 900.0 * 0.5 ** (abs(t - 61.0) / 3.0))) == SCAN_S


def test_a_jump_is_looked_for_no_further_away_than_it_is_told():
    assert jumps.reach_of_scan(scan(lambda t: 900.0 - t)) == FORGOTTEN_S


@pytest.mark.slow
def test_a_blow_just_before_the_end_of_a_flight_is_no_jump():
    seed = 12
    blow = Shock(time=LANDED - 4.0, x=-2.0, y=3.0, z=-4.0, turn=(0.05, -0.04))
    spec = FlightSpec(
        vehicle="copter", seed=seed, duration=110.0, imus=random_imus(seed), effects=(blow,)
    )
    found = diagnose(heard(spec), 1)
    assert {e.name for e in found.effects} <= {"gps_latency"}
    c = found.calibration
    assert np.abs(np.subtract(c.offset, spec.imus[0].offset)) == pytest.approx(
        np.zeros(3), abs=4.0 * max(c.offset_sigma)
    )


def test_moments_compare_whatever_pass_they_are_in(monkeypatch):
    """Each pass refuses other fixes, so that what all jumps explain in it is more or less."""
    passes = []

    def fitted(_full, _chosen, steps):
        passes.append(len(steps))
        level = 500.0 * (-1.0) ** len(passes)
        fits = [([], level - (s.moment - 71.0) ** 2) for s in steps]
        gain = lambda before, after: after - before  # noqa: E731
        return SimpleNamespace(gain=gain, pool=SimpleNamespace(variance=1.0)), 0.0, fits

    monkeypatch.setattr(jumps, "fitted", fitted)
    t = np.arange(0.0, 140.0, 2.0)
    found = jumps._scaled(None, (), [BiasStep(Origin(0.0)).at(x) for x in t.tolist()])
    assert len(passes) > 2
    assert max(passes) <= MOST_AT_ONCE
    np.testing.assert_allclose(found, -500.0 - (t - 71.0) ** 2)


@pytest.mark.parametrize(
    ("at_first", "again", "found"), [(10.0, 60.0, False), (22.0, 60.0, True), (22.0, 10.0, False)]
)
def test_a_scan_is_looked_at_again_where_twice_of_it_is_no_chance(
    monkeypatch, at_first, again, found
):
    asked = []

    def looked_again(_full, _looked):
        asked.append(again)
        return scan(lambda _: again)

    monkeypatch.setattr(jumps, "_looked_again", looked_again)
    least = surprise(40.0, 3, len(scan(np.ones_like)))  # of a gain between one of 22 and its double
    assert bool(jumps.surprising(None, scan(lambda _: at_first), least)) == found
    assert bool(asked) == (2.0 * at_first > 40.0)
    assert jumps.surprising(None, [], least) == []
