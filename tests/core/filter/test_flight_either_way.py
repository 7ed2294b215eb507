"""A flight by numpy's arithmetic and by compiled loops, and what members of a bank say of it."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.engine import through
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.filter.noise import USUAL, NoiseLevels, neighbours
from onboard.core.filter.passes import Pass
from onboard.core.filter.whitening import Uses, WhiteningFilter
from onboard.core.maths.compiling import prefer_compiled
from onboard.core.maths.frames import rotation_from_vector
from tests.core.compiled import assert_close, both_ways
from tests.core.estimate.test_simulated_flights import fed, flown

pytest.importorskip("onboard.core.filter.compiled", reason="numba is not installed")


@pytest.fixture
def _preference_kept():
    yield
    prefer_compiled()


@pytest.fixture(scope="module")
def engine():
    """With the batches of a simulated flight of which the attitude is not exact."""
    samples, _ = flown("copter", 75.0, seed=3)
    return fed(samples, Calibrator(CalibratorSettings(refine=False))).engine(1)


def relative(N):
    scale = np.sqrt(np.maximum(np.einsum("bii->bi", N), 1e-12))
    return scale, N / (scale[:, :, None] * scale[:, None])


def assert_same_sums(a, b, tolerance):
    assert a.rows == b.rows
    scale, N = relative(b.N)
    np.testing.assert_allclose(relative(a.N)[1], N, rtol=0.0, atol=tolerance)
    assert_close(a.b / scale, b.b / scale, tolerance)
    np.testing.assert_allclose(a.s, b.s, rtol=tolerance)
    np.testing.assert_allclose(a.log_det, b.log_det, rtol=tolerance)


@pytest.mark.slow
@pytest.mark.parametrize("bank", [(USUAL,), neighbours(USUAL)], ids=["one", "bank"])
@pytest.mark.usefixtures("_preference_kept")
def test_a_flight_gives_the_same_sums_either_way(engine, bank):
    def sums():
        made = Pass(engine.model, engine.point, bank)
        return made, [through(made, batch, 10.0) for batch in engine.batches]

    (one, results), (two, others) = both_ways(sums)
    assert one.sums.rows > 1000
    assert_same_sums(two.sums, one.sums, 1e-9)
    np.testing.assert_allclose(two.log_likelihoods(), one.log_likelihoods(), rtol=1e-9)
    for a, b in zip(results, others, strict=True):
        assert_close(b.block.sums.G, a.block.sums.G, 1e-9)
        assert b.refused == a.refused
    assert results[-1].block.sums.G.any() == (len(bank) == 1)


def troubled(batches):
    """Flight with fixes that gates refuse, that are not believed, or that lack something."""
    out = []
    for i, batch in enumerate(batches):
        v_n, height = batch.fixes.v_n.copy(), batch.fixes.height.copy()
        trusted = batch.trusted.copy()
        n = len(v_n)
        accuracy = np.where(np.arange(n) % 11 < 5, 0.9, 0.2)
        accuracy[n // 4], accuracy[n // 5] = np.nan, 1e-4
        if i == 2:
            v_n[n // 2 : n // 2 + 5, 0] += 30.0
            trusted[3:5] = False
        if i == 3:
            v_n[n // 3 : n // 3 + 4, 2] = np.nan
            v_n[n // 2, 0] = np.nan
            height[-3:] += 80.0
            v_n[1::7, 1] += 0.6
        fixes = replace(batch.fixes, v_n=v_n, height=height, accuracy=accuracy)
        out.append(replace(batch, fixes=fixes, trusted=trusted))
    return out


@pytest.mark.parametrize("held", [True, False], ids=["held", "as it goes"])
@pytest.mark.usefixtures("_preference_kept")
def test_epoch_by_epoch_either_way_sees_the_same(engine, held):
    batches = troubled(engine.batches)
    prior = engine.model.prior, np.diag(engine.model.prior_sigma**2)

    def seen():
        made = Pass(engine.model, engine.point, (USUAL,), traces=True)
        if held:
            made.hold(*prior)
        return made, [through(made, batch, 30.0) for batch in batches]

    (one, results), (two, others) = both_ways(seen)
    assert any(r.refused for r in results)
    assert_close(two.bias_b, one.bias_b, 1e-9)
    assert two.dead_reckoning_since == one.dead_reckoning_since
    for a, b in zip(results, others, strict=True):
        assert (b.refused, b.epochs) == (a.refused, a.epochs)
        for x, y in zip(a.traces, b.traces, strict=True):
            assert (y.t, y.velocities, y.height, y.refused) == (
                x.t,
                x.velocities,
                x.height,
                x.refused,
            )
            for name in ("innovation", "columns", "y", "h", "refused_by"):
                assert_close(getattr(y, name), getattr(x, name), 1e-7)
        x, y = np.concatenate(a.states), np.concatenate(b.states)
        np.testing.assert_array_equal(y[:, 0], x[:, 0])
        np.testing.assert_allclose(y, x, rtol=0.0, atol=1e-8, equal_nan=True)


def kicked(batches):
    """Flight with much that is in the tail of its distribution, and little that is refused."""
    out, rng = [], np.random.default_rng(8)
    for batch in batches:
        fixes, segment = batch.fixes, batch.segment
        n, k = len(fixes), len(segment.t_attitude)
        far = 4.5 * (rng.random((n, 4)) < 0.05)
        v_n = fixes.v_n + USUAL.velocity * far[:, :3]
        height = fixes.height + USUAL.height * far[:, 3]
        moved = 25.0 * USUAL.attitude_white * (rng.random((k, 3)) < 0.05)
        R = rotation_from_vector(moved) @ segment.R_attitude[:]
        out.append(
            replace(
                batch,
                fixes=replace(fixes, v_n=v_n, height=height),
                segment=replace(segment, R_attitude=R),
            )
        )
    return out


@pytest.mark.parametrize("held", [True, False], ids=["held", "as it goes"])
@pytest.mark.parametrize("members", [1, 3])
@pytest.mark.usefixtures("_preference_kept")
def test_what_is_in_a_tail_is_so_either_way(engine, monkeypatch, held, members):
    batches, bank = kicked(engine.batches), (USUAL, *neighbours(USUAL))[:members]
    first = Pass(engine.model, engine.point, (USUAL,))
    for batch in engine.batches:
        through(first, batch, 10.0)
    known = first.theta, np.linalg.inv(first.estimate.uncertainty.matrix)
    widened, seen = WhiteningFilter._widened, []

    def noted(self, made, z, kinds, white, wider):
        seen.extend(wider)
        return widened(self, made, z, kinds, white, wider)

    monkeypatch.setattr(WhiteningFilter, "_widened", noted)

    def sums():
        seen.clear()
        made = Pass(engine.model, engine.point, bank)
        if held:
            made.hold(*known)
        results = [through(made, batch, 10.0) for batch in batches]
        return made, results, list(seen)

    (one, results, by_numpy), (two, others, by_itself) = both_ways(sums)
    assert {*"vhty"} <= set(by_numpy)
    assert len(by_itself) < len(by_numpy) / 2  # what a gate may have a say in
    assert_same_sums(two.sums, one.sums, 1e-8)
    assert_close(two.bias_b, one.bias_b, 1e-8)
    assert [b.refused for b in others] == [a.refused for a in results]


@pytest.mark.usefixtures("_preference_kept")
def test_what_members_change_is_that_of_filters_of_their_own(engine):
    """Products of differences of whitened innovations, each member's from a filter by itself."""
    bank = (USUAL, NoiseLevels(velocity=0.08), NoiseLevels(force_walk=0.06, jitter=0.01))
    batch = engine.batches[1]
    # Attitude and the earth's turning are member 0's for all: held, and left out.
    free = Uses(recorded_attitude=True, earth=False)

    def whitened(levels):
        made = Pass(engine.model, engine.point, levels, uses=free)
        made.keep_traces = made.keep_rows = True
        made.hold(engine.model.prior, np.diag(engine.model.prior_sigma**2))
        traces = through(made, batch, 10.0).traces
        return made, np.concatenate([x.y - x.h @ engine.model.prior for x in traces])

    together, first = whitened(bank)
    alone = [whitened((levels,)) for levels in bank]
    moved = np.array([y - first for _, y in alone])
    # Half of the logarithm of the variances, which innovations on their own do not show: the sum
    # of all of them has to be what the likelihood has it to be.
    scales = np.diag(together.trades - moved @ moved.T)
    assert together.trades[1, 1] > 1.0
    assert scales[0] == 0.0
    shift = [(made.sums.log_det[0] - together.sums.log_det[0]) / 2.0 for made, _ in alone]
    assert np.all(scales[1:] > np.square(shift[1:]) / together.sums.rows)  # Cauchy and Schwarz
    np.testing.assert_allclose(
        together.sums.log_det, [made.sums.log_det[0] for made, _ in alone], rtol=1e-9
    )


@pytest.mark.usefixtures("_preference_kept")
def test_information_of_levels_is_the_curvature_of_their_likelihood(engine):
    """Fisher's, near the top: the expected curvature, which the flight's own scatters about."""
    engine.refine()
    found, names = engine.noise, ("velocity", "height", "height_walk")
    wide = [found.scaled(n, by) for n in names for by in (np.exp(-0.1), np.exp(0.1))]
    near = [found.scaled(n, np.exp(0.01)) for n in names]
    made = Pass(engine.model, engine.point, (found, *wide, *near))
    for batch in engine.batches:
        through(made, batch, 10.0)
    likely = np.array(made.log_likelihoods())
    curve = (2.0 * likely[0] - likely[1:7:2] - likely[2:7:2]) / 0.1**2
    np.testing.assert_allclose(np.diag(made.trades)[7:] / 0.01**2, curve, rtol=0.1)
