"""A flight gone through once with an unknown error of the receiver in each of many tiles of time.

A false velocity is a column of its own: the error of all fixes from one moment to another.  With
one for each tile, what a flight says of a receiver that is off from any moment to any other is
algebra on the sums: an error that lasts is the same in all of its tiles.  No gate is asked, so that
nothing is missed that a filter gets used to.  A filter that GPS corrects forgets what an error did
after a while; from then on its columns are nothing, and its place in the model is another tile's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.diagnosis.effort import FORGOTTEN_S
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.limits import LARGEST_FALSE
from onboard.core.diagnosis.stepped import known_without
from onboard.core.estimate.calibration_model import calibration_model
from onboard.core.estimate.going_through import through
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.passes import Pass
from onboard.core.filter.whitening import Uses
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.maths.sums import NormalSums
from onboard.core.model.around import Around
from onboard.core.model.regressors import Direct, Family, Unknown

AXES = ("north", "east", "down")
D = len(AXES)
UNGATED = Uses(height=False, gates=False)
"""All that a receiver says of velocity, and nothing refused."""


@dataclass(frozen=True, slots=True)
class Tile:
    """Fixes that are false alike, s on the boot clock; or by ever more, until the end."""

    begin: float
    end: float
    crept: bool = False

    @property
    def lasts(self) -> float:
        """How long, s."""
        return self.end - self.begin

    def share(self, t: Array) -> Array:
        """(n,) how much of the error fixes at ``t`` have."""
        inside = ((t >= self.begin) & (t < self.end)).astype(float)
        return inside * (t - self.begin) / self.lasts if self.crept else inside


class Places(Family):
    """Velocities that are false in the tiles that are under way, a place for each."""

    name = "false_velocities"

    def __init__(self, count: int) -> None:
        """Take how many tiles there are at once."""
        self.unknowns = tuple(
            Unknown(f"false_{i}_{axis}", "m/s", 0.0, LARGEST_FALSE)
            for i in range(count)
            for axis in AXES
        )
        self.tiles: Sequence[tuple[int, Tile]] = ()
        """With their places."""

    def velocity(self, around: Around) -> Direct:
        """``n_i`` of each tile, by the share of it."""
        t = around.now.t
        ned = np.zeros((len(t), 3, len(self.unknowns)))
        for place, tile in self.tiles:
            ned[:, :, D * place : D * (place + 1)] = tile.share(t)[:, None, None] * np.eye(D)
        return Direct(ned=ned)


class Tiled:
    """What one pass over a flight says of false velocities in K tiles, all else unknown.

    Attributes:
        tiles: K of them.
        N: (K, 3, K, 3) information about the error in each tile, north, east, down.
        b: (K, 3) the right side of the normal equations.
        misfit: chi-square without any error.
        rows: how many measurements there are.
        fixes: how many epochs.
    """

    def __init__(
        self,
        full: Examination,
        batches: Sequence[Batch],
        noise: NoiseLevels,
        tiles: Sequence[Tile],
        about: Array | None = None,
    ) -> None:
        """Go through the flight.

        Args:
            full: the flight with every column, its sums made.
            batches: the flight with all fixes believed that are asked.
            noise: levels.
            tiles: K of them, in which errors are asked for.
            about: (K, 3) errors as they seem to be, m/s: the attitude is that of a flight with
                them; None: of one without.
        """
        self.tiles = list(tiles)
        K = len(self.tiles)
        self._about = np.zeros((K, D)) if about is None else about
        at = _under_way(self.tiles, batches)
        self._places = Places(max((max(now.values(), default=0) for now in at), default=0) + 1)
        columns = (*full.families, *full.carried, self._places)
        self._model = calibration_model(full.point, full.prior, full.settings.needs, columns)
        self._m = self._model.slices[Places.name].start
        self._sums = NormalSums.zeros(self._m)
        self._cross = np.zeros((D * K, self._m))
        self._own, self._b = np.zeros((D * K, D * K)), np.zeros(D * K)
        self.fixes = sum(len(batch.fixes) for batch in batches)
        self._go_through(full, batches, noise, at)
        self._reduce()

    def _go_through(
        self,
        full: Examination,
        batches: Sequence[Batch],
        noise: NoiseLevels,
        at: Sequence[dict[int, int]],
    ) -> None:
        """Add up each batch."""
        theta, covariance = known_without(full, self._model)
        made = Pass(
            self._model, full.point, (noise,), uses=UNGATED, theta=theta, covariance=covariance
        )
        made.keep_states = False
        before: dict[int, int] = {}
        for batch, now in zip(batches, at, strict=True):
            for j in now.keys() - before.keys():
                begun = self._m + D * now[j]
                made.filter.carried[:, :, 1 + begun : 1 + begun + D] = 0.0
            self._places.tiles = [(p, self.tiles[j]) for j, p in now.items()]
            for j, p in now.items():
                made.theta[self._m + D * p : self._m + D * (p + 1)] = self._about[j]
            self._add(through(made, batch, full.settings.coast_s).block.sums, now)
            before = now

    def _add(self, sums: NormalSums, now: dict[int, int]) -> None:
        """The sums of a batch, in which tiles had places."""
        m = self._m
        self._sums += sums.subset(range(m))
        tiles = np.array([D * j + a for j in now for a in range(D)], dtype=int)
        places = np.array([m + D * p + a for p in now.values() for a in range(D)], dtype=int)
        if not len(tiles):
            return
        self._cross[tiles] += sums.N[places, :m]
        self._own[np.ix_(tiles, tiles)] += sums.N[np.ix_(places, places)]
        self._b[tiles] += sums.b[places]

    def _reduce(self) -> None:
        """Everything but the errors is eliminated."""
        m, sums, K = self._m, self._sums, len(self.tiles)
        prior, mean = self._model.prior_sigma[:m] ** -2.0, self._model.prior[:m]
        right = sums.b + prior * mean
        inverse = np.linalg.inv(sums.signal + np.diag(prior))
        cross = self._cross @ inverse
        self.N = (self._own - cross @ self._cross.T).reshape(K, D, K, D)
        self.b = (self._b - cross @ right).reshape(K, D)
        self.misfit = float(sums.s + mean @ (prior * mean) - right @ inverse @ right)
        self.rows = sums.rows


def _under_way(tiles: Sequence[Tile], batches: Sequence[Batch]) -> list[dict[int, int]]:
    """For each batch the tiles that are not forgotten, by number, and which place each has."""
    out: list[dict[int, int]] = []
    before: dict[int, int] = {}
    for batch in batches:
        first, last = float(batch.fixes.t[0]), float(batch.fixes.t[-1])
        now = [j for j, x in enumerate(tiles) if x.begin <= last and first <= x.end + FORGOTTEN_S]
        taken = {before[j] for j in now if j in before}
        free = (p for p in range(len(tiles)) if p not in taken)
        before = {j: before[j] if j in before else next(free) for j in now}
        out.append(before)
    return out
