"""Sums of the normal equations: all that least squares will ever ask of the measurements.

A whitened innovation is a scalar ``e = y - h theta`` of unit variance, with ``y`` its value at
``theta = 0`` and ``h`` (m,) its regressors.  ``N = sum h^T h``, ``b = sum h^T y`` and
``s = sum y^2`` are sufficient for every solution, residual and test, so that the sums of two
segments of flight (two flights, two days) add up to the sums of both.

:class:`NormalSums` is what is kept of a block of flight.  :class:`BankSums` is the only place
where whitened innovations are added up: for all members of a filter bank at once.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.errors import StateError

_MAGIC = b"OBS1"
_HEAD = struct.Struct("<4sII")
_TOGETHER = 128
"""Whitened innovations that are multiplied at once [cost: more saves no time]."""


@dataclass(slots=True)
class NormalSums:
    """Sums over whitened innovations for ``m`` unknowns.

    Attributes:
        N: (m, m) ``sum h^T h``, the information matrix: 1 / (unit of i times unit of j).
        b: (m,) ``sum h^T y``, 1 / unit of i.
        G: (m, m) expected part of ``N`` that is noise in the regressors (errors in variables).
        s: ``sum y^2``, dimensionless.
        rows: number of whitened innovations (scalars).
        log_det: sum of the log determinants of their covariances (for likelihoods).
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

    def __add__(self, other: NormalSums) -> NormalSums:
        return NormalSums(
            self.N + other.N,
            self.b + other.b,
            self.G + other.G,
            self.s + other.s,
            self.rows + other.rows,
            self.log_det + other.log_det,
        )

    def __iadd__(self, other: NormalSums) -> Self:
        self.N += other.N
        self.b += other.b
        self.G += other.G
        self.s += other.s
        self.rows += other.rows
        self.log_det += other.log_det
        return self

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
        block, some = np.ix_(index, index), list(index)
        return NormalSums(
            self.N[block], self.b[some], self.G[block], self.s, self.rows, self.log_det
        )

    def shifted(self, theta: Array) -> NormalSums:
        """Sums of the same innovations with unknowns counted from ``theta`` (m,)."""
        return NormalSums(
            self.N.copy(),
            self.b - self.N @ theta,
            self.G.copy(),
            self.residual(theta),
            self.rows,
            self.log_det,
        )

    @property
    def signal(self) -> Array:
        """(m, m) ``N`` less what of it is noise in the regressors."""
        return self.N - self.G

    def residual(self, theta: Array) -> float:
        """``sum (y - h theta)^2``, the normalised innovation squared at ``theta`` (m,)."""
        return float(self.s - 2.0 * theta @ self.b + theta @ self.N @ theta)

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


class BankSums:
    """Sums of every member of a filter bank, side by side.

    What is added is collected first, and multiplied when the sums are asked for or enough is
    there: one large product costs a fraction of many small ones.

    Attributes:
        log_det: (B,).
        rows: number of whitened innovations, the same for every member.
    """

    __slots__ = ("_gram", "_pending", "_waiting", "log_det", "rows")

    def __init__(self, members: int, m: int) -> None:
        """Empty sums of ``members`` filters with ``m`` unknowns."""
        self._gram = np.zeros((members, m + 1, m + 1))
        """Products of ``y`` (first) and ``h`` with themselves and each other."""
        self._pending = np.empty((members, 0, m + 1))
        self._waiting = 0
        self.log_det = np.zeros(members)
        self.rows = 0

    @property
    def N(self) -> Array:
        """(B, m, m) information matrices of the B members."""
        return self._added()[:, 1:, 1:]

    @property
    def b(self) -> Array:
        """(B, m)."""
        return self._added()[:, 1:, 0]

    @property
    def s(self) -> Array:
        """(B,)."""
        return self._added()[:, 0, 0]

    def products(self, i: int) -> Array:
        """(m + 1, m + 1) of one member: of ``y`` (first) and ``h`` with all of these."""
        out: Array = self._added()[i]
        return out

    def add(self, y: Array, h: Array, log_det: Array) -> None:
        """Add whitened innovations.

        Args:
            y: (B, r) values at ``theta = 0``.
            h: (B, r, m) regressors.
            log_det: (B,) log determinant of the innovations' covariance before whitening.
        """
        r = y.shape[1]
        for first in range(0, r, _TOGETHER):
            part = slice(first, first + _TOGETHER)
            self._collect(y[:, part], h[:, part])
        self.log_det += log_det
        self.rows += r

    def add_rows(self, rows: Array, log_det: Array) -> None:
        """The same of ``y`` and ``h`` side by side, (B, r, m + 1): many are not collected first."""
        if rows.shape[1] < _TOGETHER:
            self.add(rows[:, :, 0], rows[:, :, 1:], log_det)
            return
        self._gram += rows.transpose(0, 2, 1) @ rows
        self.log_det += log_det
        self.rows += rows.shape[1]

    def _collect(self, y: Array, h: Array) -> None:
        """At most :data:`_TOGETHER` rows."""
        if not self._pending.shape[1]:  # most sums are given many rows at once, or other sums
            members, _, m1 = self._pending.shape
            self._pending = np.empty((members, _TOGETHER, m1))
        start, end = self._waiting, self._waiting + y.shape[1]
        if end > _TOGETHER:
            self._added()
            start, end = 0, y.shape[1]
        self._pending[:, start:end, 0] = y
        self._pending[:, start:end, 1:] = h
        self._waiting = end

    def _added(self) -> Array:
        """(B, m + 1, m + 1) products of all that was added."""
        if self._waiting:
            rows = self._pending[:, : self._waiting]
            self._gram += rows.transpose(0, 2, 1) @ rows
            self._waiting = 0
        return self._gram

    def __iadd__(self, other: BankSums) -> Self:
        self._gram += other._added()
        self.log_det += other.log_det
        self.rows += other.rows
        return self

    def member(self, i: int) -> NormalSums:
        """Copy of the sums of one member; no noise in its regressors is known (``G = 0``)."""
        return NormalSums(
            self.N[i].copy(),
            self.b[i].copy(),
            np.zeros_like(self.N[i]),
            float(self.s[i]),
            float(self.rows),
            float(self.log_det[i]),
        )

    def log_likelihoods(self, prior: Array, prior_sigma: Array) -> list[float]:
        """Log-likelihood of each member, the unknowns integrated out with their prior.

        Args:
            prior: (m,) mean of the unknowns before the flight.
            prior_sigma: (m,) standard deviations of it.

        Returns:
            B numbers, up to a constant that all members share.
        """
        # Unknowns counted from their means: what is then left of the data is one more row of the
        # products, and one factor says both that and the information's volume.
        gram = np.roll(self._added(), -1, axis=(1, 2))
        i = np.arange(len(prior))
        gram[:, -1] -= prior @ gram[:, :-1]
        gram[:, :, -1] -= gram[:, :, :-1] @ prior
        gram[:, i, i] += 1.0 / prior_sigma**2
        gram[:, -1, -1] += 1.0  # where there are no data nothing is left
        diagonal = np.einsum("bii->bi", np.linalg.cholesky(gram))
        nis, volume = diagonal[:, -1] ** 2 - 1.0, 2.0 * np.log(diagonal[:, :-1]).sum(axis=1)
        out: list[float] = (-0.5 * (self.log_det + nis + volume)).tolist()
        return out
