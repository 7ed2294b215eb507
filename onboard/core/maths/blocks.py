"""Sums of blocks of a flight: enough of them for folds, clusters and forgetting.

Of hours there are many, with every column of the catalogue in each: what is symmetric in them is
kept once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.maths.sums import NormalSums

_HEAD = 3
"""Numbers before the others of a block: ``s``, ``rows``, ``log_det``."""


class Block:
    """Sums of one block of flight.

    Attributes:
        start: s on the boot clock.
        end: likewise.
    """

    __slots__ = ("_m", "_noise", "_noisy", "_numbers", "end", "start")

    def __init__(self, start: float, end: float, sums: NormalSums) -> None:
        """Take the sums as they are now."""
        self.start, self.end = start, end
        self._m = m = sums.size
        head = np.array([sums.s, sums.rows, sums.log_det])
        half = sums.N.ravel()[_places(m)[0]]
        self._numbers: Array = np.concatenate([head, sums.b, half])
        # Few regressors have noise, and of hours there are many blocks.
        self._noisy = np.flatnonzero(np.diagonal(sums.G))
        self._noise: Array = sums.G[np.ix_(self._noisy, self._noisy)]

    @property
    def sums(self) -> NormalSums:
        """A copy of the sums."""
        return total([self])

    @property
    def rows(self) -> float:
        """Number of whitened innovations."""
        return float(self._numbers[1])

    @property
    def b(self) -> Array:
        """(m,) ``sum h^T y``."""
        return self._numbers[_HEAD : _HEAD + self._m]

    def noise_along(self, theta: Array) -> Array:
        """(m,) noise in the regressors times ``theta`` (m,)."""
        out = np.zeros(self._m)
        out[self._noisy] = self._noise @ theta[self._noisy]
        return out

    def add_noise(self, G: Array) -> None:
        """Add the noise in the regressors to (m, m)."""
        G[np.ix_(self._noisy, self._noisy)] += self._noise

    @property
    def half(self) -> Array:
        """The triangle of the information, as :func:`whole` takes it."""
        return self._numbers[_HEAD + self._m :]


def total(blocks: Sequence[Block]) -> NormalSums:
    """Sum over blocks (at least one) of the same unknowns."""
    sums = _sums(reduce(np.add, (p._numbers for p in blocks)), blocks[0]._m)  # noqa: SLF001
    for p in blocks:
        p.add_noise(sums.G)
    return sums


def whole(halves: Sequence[Array], m: int) -> Array:
    """(n, m, m) information of n blocks of which these are the triangles."""
    return np.take(np.array(halves), _places(m)[1], axis=1).reshape(-1, m, m)


def _sums(numbers: Array, m: int) -> NormalSums:
    s, rows, log_det = numbers[:_HEAD].tolist()
    N = np.take(numbers[_HEAD + m :], _places(m)[1]).reshape(m, m)
    return NormalSums(N, numbers[_HEAD:][:m].copy(), np.zeros((m, m)), s, rows, log_det)


@lru_cache(maxsize=32)
def _places(m: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Where the numbers of a triangle are in a flat (m, m) matrix, and the matrix' in it."""
    i, j = np.triu_indices(m)
    back = np.empty((m, m), dtype=np.intp)
    back[i, j] = back[j, i] = np.arange(len(i))
    return i * m + j, back.ravel()


@dataclass(frozen=True, slots=True)
class Seconds:
    """How much flight is behind some sums: ``trusted``, and of that ``brisk``, s."""

    trusted: float
    brisk: float


def merged(blocks: list[Block], most: int) -> list[Block]:
    """At most ``most`` blocks, neighbours added up."""
    while len(blocks) > most:
        pairs = [
            Block(a.start, b.end, total([a, b]))
            for a, b in zip(blocks[::2], blocks[1::2], strict=False)
        ]
        blocks = pairs + ([blocks[-1]] if len(blocks) % 2 else [])
    return blocks
