"""A model of the specific force: effects in a row, their unknowns as one vector."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.columns import Columns
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.effects.own import Own
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.limits import HEADING_RAD, UNCLEAR_M_S

DIFFERENCE = 1e-3
"""Step of a difference quotient, in plausible sizes: forces are smooth [cost]."""

GUST = 0.1
"""Gust of the difference quotient, m/s [cost]."""


Start: TypeAlias = Callable[[Flight], Air]
"""Makes the still air that a prediction for a flight begins with."""


@dataclass(frozen=True, slots=True)
class _Listed:
    """What effects say of their unknowns, as one list.

    Attributes:
        unknowns: m of all effects, in a row.
        nominal: (m,) values of the nominal airframe.
        plausible: (m,) prior standard deviations.
        least: (m,) below which they cannot be.
        places: of an effect's unknowns, by its name.
        owners: which effect each unknown is of.
        acting: each effect with where its unknowns begin and end.
        directions: (p, d) places of unknowns that are asked about at once, by flight: no step has
            more than one of them.  They are those of an effect that has numbers of its own in each
            of several flights; of others the same place is there for each flight.
    """

    unknowns: tuple[Unknown, ...]
    nominal: Array
    plausible: Array
    least: Array
    places: dict[str, list[int]]
    owners: list[int]
    acting: list[tuple[Effect, int, int]]
    directions: NDArray[np.intp]

    @classmethod
    def of(cls, effects: Sequence[Effect], *, bounded: bool) -> _Listed:
        """Those of some effects; with ``bounded=False`` they may be as little as they like."""
        unknowns = tuple(u for e in effects for u in e.unknowns)
        places: dict[str, list[int]] = {}
        acting, directions, at = [], list[list[int]](), 0
        for effect in effects:
            n = len(effect.unknowns)
            acting.append((effect, at, at + n))
            places.setdefault(effect.name, []).extend(range(at, at + n))
            stride = effect.count if isinstance(effect, Own) else n
            directions += [list(range(at + j, at + n, stride)) for j in range(stride)]
            at += n
        flights = max(map(len, directions), default=1)
        return cls(
            unknowns,
            np.array([u.nominal for u in unknowns]),
            np.array([u.plausible for u in unknowns]),
            np.array([u.least if bounded else -math.inf for u in unknowns]),
            places,
            [k for k, e in enumerate(effects) for _ in e.unknowns],
            acting,
            np.array([d if len(d) > 1 else d * flights for d in directions], dtype=np.intp).T,
        )


@dataclass(frozen=True, slots=True)
class ForceModel:
    """What predicts the force of one flight.

    Attributes:
        flight: n steps.
        effects: in the order in which they act.
        axes: body axes that it predicts.
        start: makes the air.
        instrumented: axes along which what the vehicle does answers the disturbance, so that
            regressors must be told from what does not (:mod:`onboard.core.vehicle.instruments`).
        bounded: whether unknowns stay above what they can be at least.
    """

    flight: Flight
    effects: tuple[Effect, ...]
    axes: tuple[int, ...]
    start: Start
    instrumented: tuple[int, ...] = ()
    bounded: bool = True
    _listed: _Listed = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """List what is asked for at every step of a fit."""
        object.__setattr__(self, "_listed", _Listed.of(self.effects, bounded=self.bounded))

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Of all effects, in a row."""
        return self._listed.unknowns

    @property
    def nominal(self) -> Array:
        """(m,) values of the nominal airframe."""
        return self._listed.nominal.copy()

    def nominal_near(self, theta: Array) -> Array:
        """(m,) values that a nominal airframe may have, as near to ``theta`` (m,) as they are."""
        within = np.array([u.within for u in self.unknowns])
        out: Array = self.nominal + np.clip(theta - self.nominal, -within, within)
        return out

    @property
    def plausible(self) -> Array:
        """(m,) prior standard deviations."""
        return self._listed.plausible.copy()

    @property
    def least(self) -> Array:
        """(m,) below which they cannot be."""
        return self._listed.least.copy()

    @property
    def levelled(self) -> ForceModel:
        """Of the same flight without its tilt."""
        return replace(self, flight=self.flight.levelled())

    def indices(self, name: str) -> list[int]:
        """Places of an effect's unknowns; empty if it is not in the model."""
        return list(self._listed.places.get(name, ()))

    def effect(self, name: str) -> Effect:
        """The effect of this name, which is in the model."""
        return next(e for e in self.effects if e.name == name)

    def effect_of(self, place: int) -> Effect:
        """The effect that an unknown belongs to."""
        return self.effects[self._listed.owners[place]]

    def index(self, unknown: str) -> int:
        """Place of an unknown by its own name, of the first effect that has it.

        Raises:
            KeyError: there is none.
        """
        for k, u in enumerate(self.unknowns):
            if u.name == unknown:
                return k
        raise KeyError(unknown)

    @property
    def beside(self) -> list[int]:
        """Places of what is only estimated beside the effects."""
        return self.indices("")

    def air(self, theta: Array, gust: Array | None = None) -> Air:
        """The prediction at unknowns (m,), in air that also moves by ``gust``, m/s.

        Args:
            theta: (m,) unknowns.
            gust: (3,) or (n, 3) towards north, east, down.
        """
        air = self.start(self.flight)
        if gust is not None:
            air.gust_n = gust
        values = theta.tolist()
        for effect, begin, end in self._listed.acting:
            effect.act(air, values[begin:end])
        return air

    def predicted(self, theta: Array, gust: Array | None = None) -> Array:
        """(n, k) force along the axes, m/s^2, in air that also moves by ``gust``."""
        out: Array = self.air(theta, gust).force_b[:, list(self.axes)]
        return out

    def _stages(self, theta: Array, gust: Array | None = None) -> list[Air]:
        """The prediction before each effect: what an unknown changes begins with its effect."""
        air, out, values = self.start(self.flight), [], theta.tolist()
        if gust is not None:
            air.gust_n = gust
        for effect, begin, end in self._listed.acting:
            out.append(air.copied())
            effect.act(air, values[begin:end])
        return out

    def _from(self, stages: Sequence[Air], number: int, theta: Array) -> Array:
        """(n, k) prediction at unknowns that differ from the stages' from this effect on."""
        air, values = stages[number].copied(), theta.tolist()
        for effect, begin, end in self._listed.acting[number:]:
            effect.act(air, values[begin:end])
        out: Array = air.force_b[:, list(self.axes)]
        return out

    def gust_slope(self, theta: Array) -> Array:
        """(n, k, 3) change of the force by a gust towards north, east, down, 1/s."""
        here = self.predicted(theta)
        columns = [(self.predicted(theta, gust) - here) / GUST for gust in GUST * np.eye(3)]
        return np.stack(columns, axis=-1)

    def sensitivity(self, theta: Array) -> Array:
        """(n, k) change of the force by a gust of 1 m/s from anywhere, 1/s."""
        out: Array = np.sqrt(np.sum(self.gust_slope(theta) ** 2, axis=-1))
        return out

    def sensitivity_to(self, theta: Array, rms: float) -> Array:
        """(n, k) the same for gusts of this RMS, m/s, beside which the wind itself may be small.

        The straight line that leaves least of a bent force over normal gusts (statistical
        linearisation; J. B. Roberts and P. D. Spanos, *Random Vibration and Statistical
        Linearization*, 1990), by three points of Gauss and Hermite.
        """
        apart = math.sqrt(3.0) * rms
        slopes = [
            (self.predicted(theta, gust) - self.predicted(theta, -gust)) / (2.0 * apart)
            for gust in apart * np.eye(3)
        ]
        out: Array = np.sqrt(np.sum(np.square(slopes), axis=0))
        return out

    def unclear(self, theta: Array, velocity: float = UNCLEAR_M_S) -> Array:
        """(n, k) m/s^2 that errors of the velocity (m/s) and the heading may make, and no gust."""
        slope = self.gust_slope(theta)
        u_n = np.einsum("nij,ni->nj", self.flight.R_bn, self.air(theta).u_b)
        across = np.column_stack([-u_n[:, 1], u_n[:, 0], np.zeros(len(u_n))])
        turned = np.einsum("nki,ni->nk", slope, across)
        square = velocity**2 * np.sum(slope**2, axis=-1)
        out: Array = np.sqrt(square + (HEADING_RAD * turned) ** 2)
        return out

    def measured(self) -> Array:
        """(n, k) what the accelerometer says."""
        every = np.hstack([self.flight.f_b, self.flight.airspeed[:, None]])
        out: Array = every[:, list(self.axes)]
        return out

    def _slopes(self, apart: Callable[[Array, int], Array]) -> Columns:
        """Derivatives by all unknowns.

        Args:
            apart: differences (n, k) of the prediction by a change of the unknowns (m,), of which
                an effect's are the first (its number).
        """
        listed, part = self._listed, self.flight.part
        sizes = DIFFERENCE * listed.plausible
        by = np.empty((len(self.flight), len(self.axes), len(listed.directions.T)))
        for j, places in enumerate(listed.directions.T):
            change = np.zeros(len(sizes))
            change[places] = sizes[places]
            made = apart(change, listed.owners[places[0]])
            np.divide(made, sizes[places][part, None], out=by[:, :, j])
        return Columns(by, listed.directions, part, len(sizes))

    def steps(self, theta: Array) -> Columns:
        """(n, k) derivatives by one-sided differences: good enough to step by."""
        here, stages = self.predicted(theta), self._stages(theta)
        return self._slopes(lambda change, owner: self._from(stages, owner, theta + change) - here)

    def columns(self, theta: Array, places: Sequence[int]) -> Array:
        """(n, k, p) derivatives by some of the unknowns, by central differences."""
        out = []
        for j in places:
            step = np.zeros(len(theta))
            step[j] = DIFFERENCE * self._listed.plausible[j]
            apart = self.predicted(theta + step) - self.predicted(theta - step)
            out.append(0.5 * apart / step[j])
        return np.stack(out, axis=-1)

    def jacobian(self, theta: Array, gust: Array | None = None) -> Columns:
        """(n, k) derivatives by central differences, in air that also moves by ``gust``."""
        stages = self._stages(theta, gust)

        def apart(change: Array, owner: int) -> Array:
            up = self._from(stages, owner, theta + change)
            out: Array = 0.5 * (up - self._from(stages, owner, theta - change))
            return out

        return self._slopes(apart)
