"""Errors of a receiver in tiles of time, against a fit with the very columns, and by identities."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from onboard.core.diagnosis.effort import FORGOTTEN_S
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.false_stretches import Stretches, VelocityJumps
from onboard.core.diagnosis.limits import LARGEST_FALSE
from onboard.core.diagnosis.tiles import D, Tile, Tiled
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec, fly_messages

LENGTH = 100.0
OFF = np.array([0.7, -1.1, 0.0])
"""Telemetry has no vertical velocity."""


@pytest.fixture(scope="module")
def full():
    """A flight without anything wrong, its sums made."""
    made, decoder = Calibrator(CalibratorSettings(refine=False, buffer_s=3600.0)), Decoder()
    spec = FlightSpec(vehicle="copter", seed=5, duration=LENGTH, imus=random_imus(5))
    for _, message in fly_messages(spec):
        for sample in decoder.decode(message):
            made.feed(sample)
    made.finish()
    out = Examination(made.engine(1), (), t0=0.0).with_rows()
    out.found()
    return out


def off_by(full, tile, off):
    """The flight with a receiver that is off by ``off`` in a tile."""
    out = []
    for batch in full.batches:
        t = full.point.true_time(batch.fixes.t)
        v_n = batch.fixes.v_n + tile.share(t)[:, None] * off
        out.append(replace(batch, fixes=replace(batch.fixes, v_n=v_n)))
    return out


def edges_of(full, *moments):
    """Edges between fixes, the nearest to some moments, and the ends of the flight, s."""
    t = np.unique(np.concatenate([full.point.true_time(b.fixes.t) for b in full.batches]))
    between = 0.5 * (t[1:] + t[:-1])
    near = [between[np.argmin(np.abs(between - m))] for m in moments]
    return [t[0] - 1.0, *near, t[-1] + 1.0]


def in_a_row(edges):
    """Tiles that follow on each other."""
    return [Tile(float(a), float(b)) for a, b in pairwise(edges)]


@pytest.mark.parametrize("crept", [False, True])
def test_what_an_error_adds_to_the_sums_is_what_its_column_says(full, crept):
    """The measured rows are linear in the receiver's velocity: exactly, with the rest held."""
    begin, end = edges_of(full, 40.0, 52.0)[1:3]
    tile = Tile(begin, end, crept=crept)
    clean = Tiled(full, full.batches, full.noise, [tile])
    shifted = Tiled(full, off_by(full, tile, OFF), full.noise, [tile], OFF[None])
    added = np.einsum("iajb,jb->ia", shifted.N, OFF[None])
    assert shifted.b - clean.b == pytest.approx(added, rel=2e-2, abs=0.02 * np.abs(added).max())


def test_two_tiles_side_by_side_are_one_tile_with_one_error(full):
    a, b, c = edges_of(full, 40.0, 46.0, 52.0)[1:4]
    apart = Tiled(full, full.batches, full.noise, [Tile(a, b), Tile(b, c)])
    whole = Tiled(full, full.batches, full.noise, [Tile(a, c)])
    assert apart.N.sum(axis=(0, 2)) == pytest.approx(whole.N[0, :, 0], rel=1e-6)
    assert apart.b.sum(axis=0) == pytest.approx(whole.b[0], rel=1e-6, abs=1e-6)


def test_an_error_is_forgotten_so_that_tiles_far_from_each_other_share_no_row(full):
    a, b, c, d = edges_of(full, 25.0, 27.0, 27.0 + FORGOTTEN_S, 29.0 + FORGOTTEN_S)[1:5]
    made = Tiled(full, full.batches, full.noise, [Tile(a, b), Tile(c, d)])
    seen = made.N[:, :2, :, :2]
    own = np.sqrt(np.outer(np.diag(seen[0, :, 0]), np.diag(seen[1, :, 1])))
    assert np.abs(seen[0, :, 1] / own).max() < 0.02


def test_jumps_are_found_at_their_fixes_with_an_error_of_any_size_between(full):
    edges = edges_of(full, *np.arange(38.0, 62.0, 0.2))
    tiles = in_a_row(edges)
    k, n = 31, 87
    false = Tile(tiles[k].begin, tiles[n].begin)
    tiled = Tiled(full, off_by(full, false, OFF), full.noise, tiles)
    assert VelocityJumps(tiled).found() == [k, n]
    again = Tiled(full, off_by(full, false, OFF), full.noise, [false])
    (found,) = Stretches(again, 60.0, 1.0).chosen()
    assert np.linalg.norm(found.off - OFF) < 5.0 * found.sigma
    known = again.N[0, :, 0] + np.eye(D) / LARGEST_FALSE**2
    expected = float(again.b[0] @ np.linalg.solve(known, again.b[0]))
    assert found.gain == pytest.approx(expected, rel=1e-6)


def test_a_jump_gains_what_refitting_with_it_gains(full):
    """Gains beside those chosen are differences of chi-square of whole fits."""
    tiles = in_a_row(edges_of(full, *np.arange(40.0, 60.0, 2.5)))
    tiled = Tiled(full, off_by(full, tiles[3], OFF), full.noise, tiles)
    jumps, K = VelocityJumps(tiled), len(tiles)
    after = np.array([[float(i >= k) for i in range(K)] for k in range(K)])
    N = np.einsum("ki,iajb,lj->kalb", after, tiled.N, after).reshape(D * K, D * K)
    N += np.eye(D * K) / LARGEST_FALSE**2
    b = (after @ tiled.b).reshape(D * K)

    def explained(chosen):
        index = [D * k + a for k in chosen for a in range(D)]
        return float(b[index] @ np.linalg.solve(N[np.ix_(index, index)], b[index]))

    for chosen in ([3], [3, 4], [2, 5, 6]):
        gain = jumps.gain(chosen)
        for k in set(range(1, K)) - set(chosen):
            expected = explained([*chosen, k]) - explained(chosen)
            assert gain[k] == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_nothing_is_found_where_nothing_is_wrong(full):
    tiles = in_a_row(edges_of(full, *np.arange(20.0, 90.0, 0.5)))
    tiled = Tiled(full, full.batches, full.noise, tiles)
    assert VelocityJumps(tiled).found() == []
    assert Stretches(tiled, 60.0, 1.0).chosen() == ()
