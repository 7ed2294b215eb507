"""Normal-equation sums of the whitened integral criterion: the currency of everything after.

A whitened row is ``e = y - h theta`` with unit variance.  ``N += h^T h``, ``b += h^T y``,
``s += y^2``, ``rows += 1`` keep all that least squares will ever ask of the rows, so sums of two
segments of flight (two flights, two days) add up to the sums of both.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.errors import StateError

_MAGIC = b"OBS1"
_HEAD = struct.Struct("<4sII")


@dataclass(slots=True)
class NormalSums:
    """Sums over whitened rows for ``m`` unknowns.

    Attributes:
        N: (m, m) ``sum h^T h``.
        b: (m,) ``sum h^T y``.
        s: ``sum y^2``.
        G: (m, m) expected part of ``N`` that is noise in the columns (errors in variables).
        rows: number of rows.
        log_det: sum of the log determinants of the whitening (for likelihoods).
    """

    N: Array
    b: Array
    G: Array
    s: float = 0.0
    rows: float = 0.0
    log_det: float = 0.0

    @classmethod
    def zeros(cls, m: int) -> NormalSums:
        """Empty sums of ``m`` unknowns."""
        return cls(np.zeros((m, m)), np.zeros(m), np.zeros((m, m)))

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.b)

    def add_rows(self, h: Array, y: Array) -> None:
        """Add whitened rows ``h`` (r, m) with right-hand sides ``y`` (r,)."""
        self.N += h.T @ h
        self.b += h.T @ y
        self.s += float(y @ y)
        self.rows += len(y)

    def __add__(self, other: NormalSums) -> NormalSums:
        return NormalSums(
            self.N + other.N,
            self.b + other.b,
            self.G + other.G,
            self.s + other.s,
            self.rows + other.rows,
            self.log_det + other.log_det,
        )

    def __sub__(self, other: NormalSums) -> NormalSums:
        return self + other.scaled(-1.0)

    def scaled(self, weight: float) -> NormalSums:
        """All sums times ``weight``: forgetting, or taking a segment out again."""
        return NormalSums(
            self.N * weight,
            self.b * weight,
            self.G * weight,
            self.s * weight,
            self.rows * weight,
            self.log_det * weight,
        )

    def subset(self, index: Sequence[int]) -> NormalSums:
        """Sums of a smaller model: the other unknowns held at zero."""
        block = np.ix_(index, index)
        return NormalSums(
            self.N[block], self.b[list(index)], self.G[block], self.s, self.rows, self.log_det
        )

    def shifted(self, theta: Array) -> NormalSums:
        """Sums of the same rows with unknowns counted from ``theta`` (m,)."""
        return NormalSums(
            self.N.copy(),
            self.b - self.N @ theta,
            self.G.copy(),
            self.residual(theta),
            self.rows,
            self.log_det,
        )

    def residual(self, theta: Array) -> float:
        """``sum (y - h theta)^2`` over the rows."""
        return float(self.s - 2.0 * theta @ self.b + theta @ self.N @ theta)

    def eliminate(self, keep: Sequence[int]) -> tuple[Array, Array]:
        """Schur complement over all unknowns that are not in ``keep``.

        Returns:
            ``(S, c)``: (k, k) and (k,), the normal equations ``S x = c`` of the kept unknowns
            after the others were minimised over.

        Raises:
            numpy.linalg.LinAlgError: the eliminated block is singular.
        """
        kept = list(keep)
        gone = [i for i in range(self.size) if i not in set(kept)]
        if not gone:
            return self.N[np.ix_(kept, kept)].copy(), self.b[kept].copy()
        cross = self.N[np.ix_(kept, gone)]
        solved = np.linalg.solve(
            self.N[np.ix_(gone, gone)], np.column_stack([cross.T, self.b[gone]])
        )
        return (
            self.N[np.ix_(kept, kept)] - cross @ solved[:, :-1],
            self.b[kept] - cross @ solved[:, -1],
        )

    def to_bytes(self) -> bytes:
        """Little-endian doubles behind a head of 12 bytes."""
        tail = np.array([self.s, self.rows, self.log_det])
        body = np.concatenate([self.N.ravel(), self.b, self.G.ravel(), tail]).astype("<f8")
        return _HEAD.pack(_MAGIC, self.size, len(body)) + body.tobytes()

    @classmethod
    def from_bytes(cls, data: bytes) -> NormalSums:
        """Inverse of :meth:`to_bytes`.

        Raises:
            StateError: not sums, cut short, or not finite.
        """
        if len(data) < _HEAD.size:
            raise StateError("saved sums are cut short")
        magic, m, count = _HEAD.unpack_from(data)
        if magic != _MAGIC or count != 2 * m * m + m + 3 or len(data) != _HEAD.size + 8 * count:
            raise StateError("saved sums are damaged or of another version")
        body = np.frombuffer(data, dtype="<f8", offset=_HEAD.size).astype(np.float64)
        if not np.all(np.isfinite(body)):
            raise StateError("saved sums hold numbers that are not finite")
        square = m * m
        return cls(
            body[:square].reshape(m, m).copy(),
            body[square : square + m].copy(),
            body[square + m : 2 * square + m].reshape(m, m).copy(),
            *(float(x) for x in body[-3:]),
        )
