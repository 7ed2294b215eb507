"""Effects in proportion to what the accelerometer measures: axes, curvature, mounts that give."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import ClassVar, Self

from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Signals
from onboard.core.physics.effect import Effect


class Proportional(Effect, abstract=True):
    """An effect proportional to the force: its regressors are those of the *true* force.

    What was measured contains the effect itself; ``taken`` (k,), what is known of its unknowns,
    takes it off to first order, which leaves an error of third order.  Of a turn half of it is
    taken off: a turn is not one and its first order, but ``exp(-a) = 1 - a (1 - a / 2) + ...``.
    """

    in_proportion: ClassVar[bool] = True
    changes_force: ClassVar[bool] = True
    taken_off: ClassVar[float] = 1.0
    taken: Array | None = None
    beside: tuple[tuple[Effect, Array], ...] = ()

    def about(self, size: Array, beside: Sequence[tuple[Effect, Array]] = ()) -> Self:
        """The same effect, linearised about ``size`` (k,) and other effects with their sizes."""
        made = copy(self)
        made.taken, made.beside = size, tuple(beside)
        return made

    def acceleration(self, nodes: Signals) -> Array:
        """(..., 3, k) of the force without the effect."""
        f_b = nodes.f_b
        for other, size in self.beside:
            added = other.acceleration(nodes)
            if added is not None:
                f_b = f_b + added @ size
        if self.taken is not None:
            f_b = f_b + self.amount(f_b) @ (self.taken_off * self.taken)
        return self.amount(f_b)

    def amount(self, f_b: Array) -> Array:
        """What one unit of each unknown takes off a force (..., 3): (..., 3, k)."""
        raise NotImplementedError  # abstract: every effect in proportion states its own
