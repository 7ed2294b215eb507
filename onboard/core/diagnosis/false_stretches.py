"""Where a receiver's velocity jumps, and between which of these moments it is false: algebra.

All of it is on the sums of a pass with an error in each of many tiles (:mod:`.tiles`).  A
generalised likelihood ratio test of jumps (Willsky and Jones, 1976), whose window is the flight.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.diagnosis.effort import MOST_EDGES
from onboard.core.diagnosis.limits import CLEARLY, LARGEST_FALSE
from onboard.core.diagnosis.score import least, surprise
from onboard.core.diagnosis.tiles import D, Tile, Tiled
from onboard.core.maths.arrays import Array


class VelocityJumps:
    """Jumps of the error from one tile to the next, of tiles that follow on each other."""

    def __init__(self, tiled: Tiled) -> None:
        """Take the sums: an error that is larger from an edge on is so in all tiles after it."""
        self._tiled = tiled
        self._K = K = len(tiled.b)
        after = tiled.N[::-1, :, ::-1].cumsum(axis=0).cumsum(axis=2)[::-1, :, ::-1]
        self._N = after.reshape(D * K, D * K) + np.eye(D * K) / LARGEST_FALSE**2
        self._b = tiled.b[::-1].cumsum(axis=0)[::-1].reshape(D * K)

    def found(self) -> list[int]:
        """Tiles at whose begin the error jumps, in order; one after the other, the best first.

        What a jump explains is counted in units of the variance that is left with it.
        """
        chosen: list[int] = []
        left = self._tiled.misfit
        while len(chosen) < MOST_EDGES:
            gain = self.gain(chosen)
            best = int(np.argmax(gain))
            left -= float(gain[best])
            if surprise(gain[best], D, self._tiled.fixes, left / self._tiled.rows) < least():
                break
            chosen.append(best)
        return sorted(chosen)

    def sizes(self, chosen: Sequence[int]) -> list[float]:
        """By how much the error jumps at the begin of some tiles, m/s."""
        if not chosen:
            return []
        index = _index(chosen)
        jumps = np.linalg.solve(self._N[np.ix_(index, index)], self._b.reshape(-1)[index])
        out: list[float] = np.linalg.norm(jumps.reshape(-1, D), axis=1).tolist()
        return out

    def gain(self, chosen: Sequence[int]) -> Array:
        """(K,) fall of chi-square by a jump at the begin of each tile beside those chosen."""
        b, every = self._b, np.arange(self._K)
        own = self._N.reshape(self._K, D, self._K, D)[every, :, every]
        if chosen:
            index = _index(chosen)
            known, cross = self._N[np.ix_(index, index)], self._N[index]
            b = b - np.linalg.solve(known, b[index]) @ cross
            rest = np.linalg.solve(known, cross).reshape(len(index), -1, D)
            own = own - np.einsum("ika,ikc->kac", cross.reshape(len(index), -1, D), rest)
        none = [0, *chosen]  # what has always been is no jump
        own[none] = np.eye(D)
        right = b.reshape(-1, D)
        out: Array = np.sum(right * np.linalg.solve(own, right[..., None])[..., 0], axis=-1)
        out[none] = 0.0
        return out


@dataclass(frozen=True, slots=True)
class Stretch:
    """An error that there is: its tile, its size (3,), sigma of its length, what it explains."""

    tile: Tile
    off: Array
    sigma: float
    gain: float


class Stretches:
    """Errors that there may be, of which no two are to be at the same time."""

    def __init__(self, tiled: Tiled, chance: float, variance: float) -> None:
        """Take the sums, one tile for each.

        Args:
            tiled: the sums.
            chance: fall of chi-square that one needs to be no chance.
            variance: of the flight over what its sums say.
        """
        self._tiles, self._chance, self._variance = tiled.tiles, chance, variance
        C = len(self._tiles)
        self._N = tiled.N.reshape(D * C, D * C) + np.eye(D * C) / LARGEST_FALSE**2
        self._b = tiled.b.reshape(D * C)

    def chosen(self) -> tuple[Stretch, ...]:
        """One after the other, the best first, of those as good the shortest; in order of time."""
        chosen: list[int] = []
        while True:
            worth = np.array([self._worth(c, chosen) for c in range(len(self._tiles))])
            good = np.flatnonzero(worth > max(worth.max() - CLEARLY, 0.0))
            if not len(good):
                break
            chosen.append(min(good.tolist(), key=lambda c: self._tiles[c].lasts))
        while chosen:
            left = [self._worth(c, [x for x in chosen if x != c]) for c in chosen]
            worst = int(np.argmin(left))
            if left[worst] > 0.0:
                break
            chosen.pop(worst)
        return tuple(self._told(sorted(chosen, key=lambda c: self._tiles[c].begin)))

    def _worth(self, candidate: int, chosen: Sequence[int]) -> float:
        """What an error explains beside those chosen, over what it needs to be no chance."""
        tile = self._tiles[candidate]
        beside = (self._tiles[k] for k in chosen)
        if any(x.begin < tile.end and tile.begin < x.end for x in beside):
            return -np.inf
        return self._explained([*chosen, candidate]) - self._explained(chosen) - self._chance

    def _explained(self, chosen: Sequence[int]) -> float:
        """Fall of chi-square by some errors together."""
        if not chosen:
            return 0.0
        index = _index(chosen)
        b = self._b[index]
        return float(b @ np.linalg.solve(self._N[np.ix_(index, index)], b))

    def _told(self, chosen: Sequence[int]) -> Iterator[Stretch]:
        """With their sizes."""
        if not chosen:
            return
        index = _index(chosen)
        C = np.linalg.inv(self._N[np.ix_(index, index)])
        sizes = (C @ self._b[index]).reshape(-1, D)
        for k, c in enumerate(chosen):
            mine = slice(D * k, D * (k + 1))
            along = sizes[k] / np.linalg.norm(sizes[k])
            sigma = float(np.sqrt(along @ C[mine, mine] @ along * max(self._variance, 1.0)))
            gain = self._worth(c, [x for x in chosen if x != c]) + self._chance
            yield Stretch(self._tiles[c], sizes[k], sigma, gain)


def _index(chosen: Sequence[int]) -> NDArray[np.intp]:
    """Unknowns of some tiles."""
    out: NDArray[np.intp] = (D * np.asarray(chosen)[:, None] + np.arange(D)).ravel()
    return out
