"""What all effects share: unknowns with a nominal value, and how they act on the prediction."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air

NO_GROUND = "it was never seen on the ground, and heights above it are not known"
"""Why nothing can be said of what depends on them."""


@dataclass(frozen=True, slots=True)
class Unknown:
    """One number of an effect.

    Attributes:
        name: in the document.
        nominal: its value where the airframe is the nominal one.
        plausible: standard deviation over the vehicles that fly: prior, and scale of steps.
        floor: differences below do not matter.
        unit: in the document.
        doubt: what the form of the law itself is good for, as a standard deviation.
        share: the same as a share of the value.
        within: by how much it may be off in an airframe that is nominal all the same.
        least: below which it cannot be.
        most: above which it cannot be; a fit may go there, and is told that it did.
    """

    name: str
    nominal: float
    plausible: float
    floor: float
    unit: str
    doubt: float = 0.0
    share: float = 0.0
    within: float = 0.0
    least: float = -math.inf
    most: float = math.inf

    def doubted(self, value: float, sigma: float) -> float:
        """A sigma of the fit with what the law is good for."""
        return math.sqrt(sigma**2 + self.doubt**2 + (self.share * value) ** 2)


@dataclass(frozen=True, slots=True)
class Shown:
    """A number as people and other programs read it: nominal value, value, sigma, unit."""

    name: str
    nominal: float
    value: float
    sigma: float
    unit: str


class Effect(ABC):
    """One piece of physics.

    Attributes:
        name: in the controlled vocabulary; empty for what is only estimated beside the effects.
        unknowns: its numbers.
        manoeuvre: what would show it, as an imperative.
        note: what a person must know where it is found, as a part of a sentence; may be empty.
        together: whether it is asked what its unknowns do together where gusts hide single ones.
        commanded: whether it is of what a command makes, which no wind has to be known for, and in
            the airframe's file.
    """

    name: str = ""
    manoeuvre: str = ""
    note: str = ""
    together: bool = False
    commanded: bool = False

    def __init__(self, unknowns: Sequence[Unknown]) -> None:
        """Take the unknowns."""
        self.unknowns = tuple(unknowns)

    @abstractmethod
    def act(self, air: Air, values: Sequence[float]) -> None:
        """Change the prediction by these values of the unknowns."""

    def shown(self, values: Sequence[float], sigmas: Sequence[float]) -> list[Shown]:
        """The unknowns in the units of the document."""
        return [
            Shown(u.name, u.nominal, v, s, u.unit)
            for u, v, s in zip(self.unknowns, values, sigmas, strict=True)
        ]

    def heavier(self, values: Sequence[float], log_ratio: float) -> list[float]:
        """The unknowns of the same airframe with ``exp(log_ratio)`` times the mass."""
        del log_ratio
        return list(values)

    def missing(self, air: Air) -> str:
        """Why this recording cannot speak of it; empty where it can."""
        del air
        return ""


class ByStep(Effect):
    """An effect of the air or of a sensor: its numbers may be others in each of several flights."""

    @abstractmethod
    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """Change the prediction by values (n,) of the unknowns at each step."""

    def act(self, air: Air, values: Sequence[float]) -> None:
        """The same values at all steps."""
        n = len(air.flight)
        self.act_by(air, [np.full(n, v) for v in values])
