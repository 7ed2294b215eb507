"""What one flight of a vehicle alone says of the vehicle, to be held against what others say."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.effects.air_density import AirDensity
from onboard.core.vehicle.effects.effect import ByStep, Effect
from onboard.core.vehicle.effects.mass_change import Change, MassChange, ThrustChange
from onboard.core.vehicle.effects.own import Own
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.limits import FEWEST_BLOCKS
from onboard.core.vehicle.records import Compared

DIFFERENCE = 1e-4
"""Step of a difference quotient, in plausible sizes: what is shown is smooth in them [cost]."""

Key = tuple[str, str]
"""Effect and unknown."""


@dataclass(frozen=True, slots=True)
class Said:
    """What one flight alone says of its vehicle.

    Attributes:
        effects: of the vehicle, that its model has.
        values: (c,) their unknowns.
        covariance: (c, c) inflated, with what laws are good for and the prior in it.
    """

    effects: tuple[Effect, ...]
    values: Array
    covariance: Array

    @property
    def keys(self) -> list[Key]:
        """Names of the unknowns."""
        return [(e.name, u.name) for e in self.effects for u in e.unknowns]

    def of(self, keys: Sequence[Key]) -> tuple[Array, Array]:
        """Values (k,) and covariance (k, k) of some of them."""
        ours = self.keys
        places = [ours.index(key) for key in keys]
        return self.values[places], self.covariance[np.ix_(places, places)]

    def numbers(self, key: Key) -> dict[str, Compared]:
        """What is shown of an unknown, by name; of its effect where none has its name."""
        effect = next(e for e in self.effects if e.name == key[0])
        values, covariance = self.of([(effect.name, u.name) for u in effect.unknowns])
        shown = effect.shown(values.tolist(), np.sqrt(np.diag(covariance)).tolist())
        named = [s for s in shown if f"_{s.name}".endswith(f"_{key[1]}")] or shown
        return {s.name: Compared(s.nominal, s.value, s.sigma, s.unit) for s in named}


NOTHING = Said((), np.zeros(0), np.zeros((0, 0)))


def said_of(fit: Fit) -> tuple[Said, ...]:
    """What a fit of one flight alone says of its vehicle: as it was, and as it became.

    Fewer blocks than tell their scatter have sigmas that nobody knows: such a flight says nothing.
    """
    model = fit.model
    effects = tuple(e for e in model.effects if is_of_vehicle(e))
    if len(fit.blocks) < FEWEST_BLOCKS:
        effects = ()
    every = list(range(len(fit.theta)))
    covariance = fit.covariance + fit.untold(fit.information, every)
    laws = [u.doubted(v, 0.0) ** 2 for u, v in zip(model.unknowns, fit.theta, strict=True)]
    covariance = covariance + np.diag(laws)

    def values(theta: Array, became: Change | None) -> Array:
        numbers = {e.name: theta[model.indices(e.name)].tolist() for e in model.effects}
        if became is not None:
            way = -1.0 if became.since else 1.0
            for e in effects:
                numbers[e.name] = _changed(e, numbers, way)
        return np.array([v for e in effects for v in numbers[e.name]])

    out = []
    for became in dict.fromkeys((None, change_in(model.effects))):

        def form(theta: Array, became: Change | None = became) -> Array:
            return values(theta, became)

        slope = _slope(form, fit.theta, model.plausible)
        out.append(Said(effects, form(fit.theta), slope @ covariance @ slope.T))
    return tuple(out)


def is_of_vehicle(effect: Effect) -> bool:
    """Whether its unknowns are told, and the same in every flight of the vehicle."""
    not_its = Own | ByStep | AirDensity | MassChange | ThrustChange
    return bool(effect.name) and not isinstance(effect, not_its)


def change_in(effects: Sequence[Effect]) -> Change | None:
    """That which the model of a flight has."""
    return next((e.change for e in effects if isinstance(e, MassChange | ThrustChange)), None)


def _changed(effect: Effect, numbers: dict[str, list[float]], way: float) -> list[float]:
    """An effect's unknowns on the other side of the change."""
    values = effect.heavier(numbers[effect.name], way * sum(numbers.get(MassChange.name, [0.0])))
    if effect.name == "thrust_scale":
        values = [values[0] + way * sum(numbers.get(ThrustChange.name, [0.0]))]
    return values


def _slope(of: Callable[[Array], Array], at: Array, unit: Array) -> Array:
    """(c, m) derivatives by differences in these units (m,)."""
    here = of(at)
    columns = []
    for k, size in enumerate(unit.tolist()):
        moved = at.copy()
        moved[k] += DIFFERENCE * size
        columns.append((of(moved) - here) / (DIFFERENCE * size))
    return np.stack(columns, axis=1)
