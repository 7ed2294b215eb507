"""Whitening: correlated innovations to independent ones of unit variance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from onboard.core.filter.innovations import WhitenedInnovations
from onboard.core.filter.readings import Reading, reading
from onboard.core.filter.state import STATES
from onboard.core.maths.arrays import Array


@dataclass(frozen=True, slots=True)
class Whitened:
    """Innovations of one epoch before and after whitening, for all B members of the bank.

    Attributes:
        kinds: one letter for each of the r innovations.
        read: which states they read.
        E: (B, r, m + 1) innovations at ``theta = 0`` and their regressors.
        y: (B, r) whitened innovations.
        h: (B, r, m) their regressors: at ``theta`` they are ``y - h theta``.
        gain: (B, r, STATES) transposed Kalman gain of the whitened innovations.
        whitener: (B, r, r) inverse of ``L``.
        L: (B, r, r) Cholesky factor of the innovations' covariance.
    """

    kinds: str
    read: Reading
    E: Array
    y: Array
    h: Array
    gain: Array
    whitener: Array
    L: Array

    def innovations(
        self, t: float, theta: Array, refused: Sequence[str], off: Array
    ) -> WhitenedInnovations:
        """What the epoch at ``t`` (s) gives, with what the gates refused before."""
        n = self.kinds.count("v")
        first, regressors = self.E[0, :n, 0], self.E[0, :n, 1:]
        return WhitenedInnovations(
            t=t,
            y=self.y,
            h=self.h,
            log_det=2.0 * np.log(np.diagonal(self.L, axis1=1, axis2=2)).sum(axis=1),
            velocities=n,
            height="h" in self.kinds,
            innovation=first - regressors @ theta,
            raw_innovation=first,
            raw_columns=regressors,
            refused=tuple(refused),
            refused_by=off,
        )


def whiten(both: Array, noise: Array, kinds: str) -> Whitened:
    """Multiply innovations by the inverse Cholesky factor of their covariance.

    Args:
        both: (B, r, m + 1 + STATES) innovation, regressors and ``H P``, side by side.
        noise: (B, 7) variances of the white noise of each measured number.
        kinds: of the r numbers.
    """
    read = reading(kinds)
    m1 = both.shape[2] - STATES
    E, HP = both[:, :, :m1], both[:, :, m1:]
    S = HP.take(read.first, axis=2) + HP.take(read.second, axis=2)
    np.einsum("...ii->...i", S)[:] += noise[:, read.noise]
    L = cast("Array", np.linalg.cholesky(S))
    whitener = cast("Array", np.linalg.inv(L))
    W = whitener @ both
    return Whitened(kinds, read, E, W[:, :, 0], W[:, :, 1:m1], W[:, :, m1:], whitener, L)


def nothing(
    members: int, m: int, t: float, refused: Sequence[str], off: Array
) -> WhitenedInnovations:
    """All that the epoch at ``t`` (s) has measured was refused."""
    return WhitenedInnovations(
        t=t,
        y=np.zeros((members, 0)),
        h=np.zeros((members, 0, m)),
        log_det=np.zeros(members),
        velocities=0,
        height=False,
        innovation=np.zeros(0),
        raw_innovation=np.zeros(0),
        raw_columns=np.zeros((0, m)),
        refused=tuple(refused),
        refused_by=off,
    )
