"""Effects in proportion to what the accelerometer measures: axes, curvature, mounts that give."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import ClassVar, Final, Self

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import skew
from onboard.core.model.quadrature import Signals
from onboard.core.physics.effect import Effect

ROUNDS: Final = 3
"""How often an effect is taken off the force that was read, by the force that was left before: each
leaves of an error as much as the effect is of the force, a fifth where it is large [bound]."""


class Proportional(Effect, abstract=True):
    """An effect proportional to the force: its regressors are those of the *true* force.

    What was measured contains the effect itself; ``taken`` (k,), what is known of its unknowns,
    takes it off.
    """

    in_proportion: ClassVar[bool] = True
    changes_force: ClassVar[bool] = True
    taken: Array | None = None
    beside: tuple[tuple[Effect, Array], ...] = ()

    def about(self, size: Array, beside: Sequence[tuple[Effect, Array]] = ()) -> Self:
        """The same effect, linearised about ``size`` (k,) and other effects with their sizes."""
        made = copy(self)
        made.taken, made.beside = size, tuple(beside)
        return made

    def acceleration(self, nodes: Signals) -> Array:
        """(..., 3, k) of the force without the effect."""
        read = nodes.f_b
        for other, size in self.beside:
            added = other.acceleration(nodes)
            if added is not None:
                read = read + added @ size
        true = read
        if self.taken is not None:
            for _ in range(ROUNDS):
                true = read + self.between(read, true) @ self.taken
        return self.between(read, true)

    def between(self, read: Array, true: Array) -> Array:  # noqa: ARG002 - turns need both
        """What one unit of each unknown takes off (..., 3, k), where ``true`` came as ``read``.

        Args:
            read: (..., 3) force as it was read, m/s^2.
            true: (..., 3) without the effect, as far as it is known.
        """
        return self.amount(true)

    def amount(self, f_b: Array) -> Array:
        """What one unit of each unknown takes off a force (..., 3): (..., 3, k)."""
        raise NotImplementedError  # abstract: every effect in proportion states its own


class Turning(Proportional, abstract=True):
    """One that turns the force: by the rule of the midpoint, so that it keeps its length.

    A turn is not one and its first order, which would make the force longer by half of the
    square of the angle: ``true - read = a x (true + read) / 2`` up to the third order.
    """

    def between(self, read: Array, true: Array) -> Array:
        """Of the force half-way, by the angles that the true one makes."""
        out: Array = skew(0.5 * (read + true))[..., :2] * self.angle(true)[..., None, None]
        return out

    def angle(self, f_b: Array) -> Array:
        """(...) by what part of its unknowns a force (..., 3) is turned."""
        return np.ones(f_b.shape[:-1])

    def amount(self, f_b: Array) -> Array:
        """``f x e`` about roll and pitch, by the angle."""
        return self.between(f_b, f_b)
