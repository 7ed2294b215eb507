"""Small linear problems with known answers: rows as they are, and the sums made of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onboard.core.diagnosis.candidates import Candidate
from onboard.core.diagnosis.selection import Fitter
from onboard.core.maths.blocks import Block
from onboard.core.maths.sums import NormalSums
from onboard.core.model.nuisances import Six
from onboard.core.model.regressors import Family, Model, Unknown

BLOCK_S = 10.0
WIDTHS = {"a": 1, "b": 3, "c": 2, "d": 1, "e": 3, "f": 1}
"""Candidates and their unknowns."""
SIX = np.array([1.01, 0.99, 1.02, 0.1, -0.2, 0.05])


class Columns(Family):
    """Unknowns of a piece of physics that is nothing but columns."""

    def __init__(self, name: str, width: int, prior: float = 0.0, sigma: float = 10.0) -> None:
        self.name = name
        self.unknowns = tuple(Unknown(f"{name}_{i}", "1", prior, sigma) for i in range(width))


@dataclass(frozen=True)
class Problem:
    """Whitened rows of a flight: ``h`` (blocks, n, m), ``y`` (blocks, n), and whose columns."""

    model: Model
    h: np.ndarray
    y: np.ndarray

    @property
    def rows(self):
        """All rows together: (blocks * n, m) and (blocks * n,)."""
        return self.h.reshape(-1, self.model.size), self.y.ravel()

    @property
    def blocks(self):
        """The same as sums."""
        out = []
        for i, (h, y) in enumerate(zip(self.h, self.y, strict=True)):
            sums = NormalSums(
                h.T @ h, h.T @ y, np.zeros((self.model.size, self.model.size)), y @ y, len(y)
            )
            out.append(Block(BLOCK_S * i, BLOCK_S * (i + 1), sums))
        return out

    def fitter(self, absent: np.ndarray | None = None) -> Fitter:
        """What is tested."""
        return Fitter(self.blocks, self.model, absent)

    def columns(self, name: str) -> tuple[int, ...]:
        """Places of a family's unknowns."""
        return tuple(range(self.model.size)[self.model.slices[name]])


def drawn(rng, families, theta, *, blocks=10, rows=60, noise=1.0):
    """A problem with independent regressors that ``theta`` (m,) is the truth of."""
    model = Model([Six(scale_sigma=5.0, beta_sigma=5.0), *families])
    h = rng.normal(size=(blocks, rows, model.size))
    y = h @ theta + noise * rng.normal(size=(blocks, rows))
    return Problem(model, h, y)


def least_squares(problem, free, at, rows=None):
    """Dense least squares, the prior as rows: unknowns (m,), what it minimises, covariance.

    Args:
        problem: the rows.
        free: what is fitted.
        at: (m,) values of the rest.
        rows: (h, y) to take instead of all.
    """
    h, y = problem.rows if rows is None else rows
    index = list(free)
    mean, sigma = problem.model.prior[index], problem.model.prior_sigma[index]
    held = at.copy()
    held[index] = 0.0
    A = np.vstack([h[:, index], np.diag(1.0 / sigma)])
    c = np.concatenate([y - h @ held, mean / sigma])
    x = np.linalg.lstsq(A, c, rcond=None)[0]
    theta = held.copy()
    theta[index] = x
    R = np.linalg.qr(A)[1]
    inverse = np.linalg.inv(R)
    return theta, float(np.sum((c - A @ x) ** 2)), inverse @ inverse.T


def families():
    return [Columns(name, width) for name, width in WIDTHS.items()]


def made(rng, *present, size=0.6, noise=1.0, blocks=10, rows=60):
    """A flight in which these effects act, each unknown by ``size`` or its negative."""
    theta = np.concatenate([SIX, np.zeros(sum(WIDTHS.values()))])
    at = 6
    for name, width in WIDTHS.items():
        if name in present:
            theta[at : at + width] = size * rng.choice([-1.0, 1.0], width)
        at += width
    return drawn(rng, families(), theta, blocks=blocks, rows=rows, noise=noise)


def candidates(problem, names=WIDTHS):
    return [Candidate(n, problem.columns(n), (5.0,) * len(problem.columns(n))) for n in names]
