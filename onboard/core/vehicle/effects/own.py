"""What several flights of one vehicle do not share: the air, and what a calibration left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import ByStep, Effect, Shown


class Own(Effect):
    """One effect with numbers of its own in each flight.

    The first flight's unknowns keep their names, those of the others have its number behind them
    (``north_2``).  What is shown is of the first: the others are told of flight by flight.
    """

    def __init__(self, alike: Sequence[ByStep]) -> None:
        """Take the effect as it is in each flight: of one kind, priors of its own."""
        first = alike[0]
        unknowns = list(first.unknowns)
        for number, its in enumerate(alike[1:], 2):
            unknowns += [replace(u, name=f"{u.name}_{number}") for u in its.unknowns]
        super().__init__(unknowns)
        self.name, self.manoeuvre, self.together = first.name, first.manoeuvre, first.together
        self.each, self.count = first, len(first.unknowns)

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Each step by the values of its flight."""
        by_flight = np.reshape(np.asarray(values), (-1, self.count))
        self.each.act_by(air, list(by_flight[air.flight.part].T))

    def shown(self, values: Sequence[float], sigmas: Sequence[float]) -> list[Shown]:
        """Of the first flight."""
        return self.each.shown(values[: self.count], sigmas[: self.count])

    def missing(self, air: Air) -> str:
        """As for one flight."""
        return self.each.missing(air)


def own(alike: Sequence[ByStep]) -> Effect:
    """The effect of one flight, or of each of several."""
    return alike[0] if len(alike) == 1 else Own(alike)
