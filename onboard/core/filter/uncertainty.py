"""How well an estimate is known: asked along some directions, seldom, and so never as a whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array


@dataclass(frozen=True, slots=True)
class Covariance:
    """By its covariance (m, m)."""

    matrix: Array

    def along(self, D: Array) -> Array:
        """(n, n) covariance of ``D theta``, with D (n, m)."""
        out: Array = D @ self.matrix @ D.T
        return out


@dataclass(frozen=True, slots=True)
class Information:
    """By its information (m, m), the covariance's inverse.

    To invert it costs four times what the estimate does.
    """

    matrix: Array

    def along(self, D: Array) -> Array:
        """(n, n) covariance of ``D theta``, with D (n, m)."""
        out: Array = D @ np.linalg.solve(self.matrix, D.T)
        return out


Uncertainty = Covariance | Information
