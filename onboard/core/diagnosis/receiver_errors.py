"""Velocities of a receiver that are false for a while: where an error begins, changes and ends.

A velocity that begins to be false jumps, as no inertia can, and jumps back when it is true again.
So moments at which it jumps are looked for first, among the fixes that are no chance beside those
before them.  Between two of them the receiver is right, or off by one error; or by one that has
crept in until the second.  No gate is asked, for a filter gets used to what is false for long.

Inertia jumps where a vehicle is struck and the samples miss it.  Where that may be, a jump is the
receiver's only if it jumps back elsewhere.

That velocities are off each by something else has its own price, and gates that refuse them.  So an
error is one that lasts, and explains more than chance where the receiver is as noisy as there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import log

import numpy as np

from onboard.core.diagnosis.blows import Blows
from onboard.core.diagnosis.effort import (
    CREEPS_S,
    FORGOTTEN_S,
    FURTHEST,
    MOST_EDGES,
    SEARCHED,
)
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.false_stretches import Stretch, Stretches, VelocityJumps
from onboard.core.diagnosis.limits import CONTACT_S, NEAR_S
from onboard.core.diagnosis.score import needed, surprise
from onboard.core.diagnosis.selection import Fitter
from onboard.core.diagnosis.stepped import known_without
from onboard.core.diagnosis.tiles import UNGATED, D, Tile, Tiled
from onboard.core.estimate.calibration_model import calibration_model
from onboard.core.estimate.going_through import through
from onboard.core.filter.limits import ANYTHING, GATE_VELOCITY, RECEIVER_M_S
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.passes import Pass
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array


@dataclass(frozen=True, slots=True)
class ReceiverError:
    """Velocities that are false from one fix to another, s on the boot clock.

    Attributes:
        start: s, first fix that is false.
        end: s, last one.
        off: (3,) north, east, down, m/s; of an error that has crept in, where it ends.
        sigma: of its size, m/s.
    """

    start: float
    end: float
    off: Array
    sigma: float

    @property
    def size(self) -> float:
        """m/s."""
        return float(np.linalg.norm(self.off))


class Looking:
    """Looks for errors of the receiver in one flight."""

    def __init__(self, full: Examination, batches: Sequence[Batch], noise: NoiseLevels) -> None:
        """Take the flight.

        Args:
            full: with every column, its sums made.
            batches: the flight with all fixes believed that are asked.
            noise: levels, of the receiver where it is right.
        """
        self._full, self._batches, self._noise = full, batches, noise
        self._variance = Fitter(full.all_blocks, full.model, full.absent).pool.variance
        self._fixes = np.unique(np.concatenate([full.point.true_time(b.fixes.t) for b in batches]))
        self._blows, self._struck = Blows(batches), frozenset[float]()
        self._apart = float(np.median(np.diff(self._fixes)))
        # It may begin and end at any fix.
        self._chance = needed(D, 0.5 * len(self._fixes) ** 2, self._variance)

    def errors(self) -> tuple[ReceiverError, ...]:
        """Those that are no chance, in order of time."""
        found: tuple[Stretch, ...] = ()
        left = self._left(found)
        for _ in range(FURTHEST):
            self._struck = frozenset()
            moments = left.surprising[:MOST_EDGES]
            seen = self._between(self._jumps(moments, found)) if moments else ()
            if {x.tile for x in seen} <= {x.tile for x in found}:
                break
            # The attitude is that of a flight without errors until they are known.
            found = self._chosen([x.tile for x in seen], np.array([x.off for x in seen]))
            left = self._left(found)
        told = (self._told(x, left) for x in found if self._lasts(x, left))
        # What it is unsure by, and what a good receiver errs by now and then, is no error to tell.
        return tuple(x for x in told if x.size**2 > needed(1) * (x.sigma**2 + RECEIVER_M_S**2))

    @property
    def blows(self) -> tuple[tuple[float, float], ...]:
        """From when to when (s) jumps are that :meth:`errors` has met, and that may be a blow."""
        return tuple((t - self._apart, t + self._apart) for t in sorted(self._struck))

    def _jumps(self, moments: Sequence[float], known: Sequence[Stretch]) -> dict[float, float]:
        """When velocities jump, s, and by how much, m/s, in order of time.

        There is a tile for each fix about some moments, and for the flight between.
        """
        fixes = self._fixes
        between = np.concatenate(
            [[fixes[0] - 1.0], 0.5 * (fixes[1:] + fixes[:-1]), [fixes[-1] + 1.0]]
        )
        near = np.searchsorted(fixes, moments)[:, None] + np.arange(-1, 3)
        ends = np.searchsorted(between, [t for x in known for t in (x.tile.begin, x.tile.end)])
        every = np.unique([*near.ravel(), *ends, 0, len(fixes)])
        edges = between[every[(every >= 0) & (every <= len(fixes))]]
        tiles = [Tile(a, b) for a, b in pairwise(edges.tolist())]
        about = _sum_at(0.5 * (edges[1:] + edges[:-1]), known)
        jumps = VelocityJumps(self._tiled(tiles, about))
        found = jumps.found()
        return dict(zip(edges[found].tolist(), jumps.sizes(found), strict=True))

    def _between(self, jumps: Mapping[float, float]) -> tuple[Stretch, ...]:
        """Errors that begin and end where velocities jump, s, by so much, m/s.

        Where a jump has no partner, one crept in until then, or is there when the flight begins or
        ends, if that is near enough to be remembered.
        """
        # While the ground may be touched, it may be a shock that a velocity jumps by.
        first, last = self._fixes[0] + CONTACT_S, self._fixes[-1] - CONTACT_S
        aloft = {t for t in jumps if first < t < last}
        struck = {t for t in aloft if jumps[t] <= self._blows.near(t, self._apart)}
        aloft -= struck
        closed = self._chosen([Tile(a, b) for a, b in pairwise(jumps) if a in aloft or b in aloft])
        ends = {t for x in closed for t in (x.tile.begin, x.tile.end)}
        self._struck = frozenset(struck - ends)
        begins, stops = float(self._fixes[0]) - 1.0, float(self._fixes[-1]) + 1.0
        alone = sorted(aloft - ends)
        others = [
            Tile(t - span, t, crept=True)
            for t in alone
            for span in CREEPS_S
            if not any(t - span < u < t for u in (begins, *jumps))
        ]
        others += [Tile(t, stops) for t in alone if max(jumps) == t > stops - FORGOTTEN_S]
        others += [Tile(begins, t) for t in alone if min(jumps) == t < begins + FORGOTTEN_S]
        return self._chosen([*(x.tile for x in closed), *others]) if others else closed

    def _chosen(self, tiles: Sequence[Tile], about: Array | None = None) -> tuple[Stretch, ...]:
        """Those that there are, of errors that there may be, of sizes (n, 3) that they seem."""
        if not tiles:
            return ()
        return Stretches(self._tiled(tiles, about), self._chance, self._variance).chosen()

    def _tiled(self, tiles: Sequence[Tile], about: Array | None = None) -> Tiled:
        return Tiled(self._full, self._batches, self._noise, tiles, about)

    def _lasts(self, found: Stretch, left: _Left) -> bool:
        """Whether an error is one of many fixes, and no chance where the receiver is noisy.

        Nor by its size alone, as if noise could last as long as it likes: multipath may.  A fix
        that is off by itself is what gates are for.  A jump without a partner is no more than that,
        if nothing is explained beyond it: a receiver has lost a satellite.
        """
        fixes = len(self._false(found.tile))
        variance = self._noise.velocity**2 + self._noise.velocity_colour**2
        if float(found.off @ found.off) < needed(D, len(self._fixes)) * variance:
            return False
        # What twice the log-likelihood falls by if a velocity may be anything.
        refused = ANYTHING["vvv"] - D * (log(variance) + 1.0)
        enough = left.variance(found.tile, GATE_VELOCITY) * self._chance
        within = self._fixes[0] < found.tile.begin and found.tile.end < self._fixes[-1]
        enough += 0.0 if within and not found.tile.crept else refused
        return fixes > 1 and min(found.gain, fixes * refused) > enough

    def _false(self, tile: Tile) -> Array:
        """Fixes in a tile, s."""
        inside: Array = self._fixes[(self._fixes >= tile.begin) & (self._fixes < tile.end)]
        return inside

    def _told(self, found: Stretch, left: _Left) -> ReceiverError:
        """From its first fix to its last, as well known as the receiver is noisy there."""
        false = self._false(found.tile)
        sigma = found.sigma * float(np.sqrt(left.variance(found.tile)))
        return ReceiverError(float(false[0]), float(false[-1]), found.off, sigma)

    def _left(self, known: Sequence[Stretch]) -> _Left:
        """What each velocity is off by beside what was measured before, known errors taken out."""
        full = self._full
        model = calibration_model(
            full.point, full.prior, full.settings.needs, (*full.families, *full.carried)
        )
        theta, covariance = known_without(full, model)
        made = Pass(
            model, full.point, (self._noise,), uses=UNGATED, theta=theta, covariance=covariance
        )
        made.keep_traces = made.keep_rows = True
        rows = []
        for batch in self._batches:
            fixes = batch.fixes
            v_n = fixes.v_n - _sum_at(full.point.true_time(fixes.t), known)
            right = replace(batch, fixes=replace(fixes, v_n=v_n)) if known else batch
            for x in through(made, right, full.settings.coast_s).traces:
                off = x.y[: x.velocities] - x.h[: x.velocities] @ theta
                rows.append((x.t, float(off @ off), float(x.velocities)))
        return _Left(*np.array(rows).reshape(-1, 3).T)


@dataclass(frozen=True, slots=True)
class _Left:
    """Of n epochs, s: chi-square of the velocity beside what was measured before, its freedom."""

    t: Array
    chi2: Array
    freedom: Array

    @property
    def surprising(self) -> list[float]:
        """Those that are hardly chance, the worst first, s.

        A velocity that begins or ceases to be false is such a one, whatever comes after it.
        """
        n = int(np.sum(self.freedom > 0.0))
        pairs = zip(self.chi2.tolist(), self.freedom.tolist(), strict=True)
        score = np.array([surprise(x, int(k), n) if k else -np.inf for x, k in pairs])
        worst = np.argsort(score)[::-1]
        out: list[float] = self.t[worst[score[worst] > -2.0 * log(SEARCHED)]].tolist()
        return out

    def variance(self, tile: Tile, most: float = np.inf) -> float:
        """Of velocities in a tile and near it over what is expected, at least 1.

        Args:
            tile: from when to when.
            most: of the chi-square of one, the rest of which is left out.
        """
        near = (self.t > tile.begin - NEAR_S) & (self.t < tile.end + NEAR_S)
        chi2 = np.minimum(self.chi2[near], most)
        return max(float(chi2.sum() / max(self.freedom[near].sum(), 1.0)), 1.0)


def _sum_at(t: Array, known: Sequence[Stretch]) -> Array:
    """(n, 3) what known errors are at some moments, m/s."""
    out = np.zeros((len(t), D))
    for x in known:
        out += x.tile.share(t)[:, None] * x.off
    return out
