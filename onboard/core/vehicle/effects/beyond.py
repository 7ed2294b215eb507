"""Forces of which no effect knows, and which repeat with the motion: what air never does."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.effects.vertical_drag import rotor_root


@dataclass(frozen=True, slots=True)
class Law:
    """A force by what the vehicle does.

    Attributes:
        force: (n, 3) of the air, by one of the unknown; (n, 4) with what the airspeed reads.
        plausible: standard deviation of the unknown.
        unit: of it.
        said: what a person reads of it, as the end of *a force ...*; of a sensor, all of it.
        axes: along which it is large enough to be seen.
        spoils: effects whose numbers are no longer the vehicle's then: they have another law.
        answers: whether it goes with what a plane and its autopilot answer a gust with at once, so
            that it cannot be told from the gust.
        sensed: whether it is of the airspeed sensor, and no force.
    """

    force: Callable[[Air], Array]
    plausible: float
    unit: str
    said: str
    axes: tuple[int, ...] = (0, 1)
    spoils: tuple[str, ...] = ()
    answers: bool = False
    sensed: bool = False


def _level(x: Array, y: Array) -> Array:
    """(n, 3) along x and y alone."""
    return np.stack([x, y, 0.0 * x], axis=1)


def _across(air: Air) -> Array:
    return _level(-air.u_b[:, 1], air.u_b[:, 0])


def _unequal(air: Air) -> Array:
    u = rotor_root(air)[:, None] * air.u_b
    return _level(u[:, 0], -u[:, 1])


def _climbing(air: Air) -> Array:
    u = air.u_b
    return _level(u[:, 2] * u[:, 0], u[:, 2] * u[:, 1])


def _steeper(air: Air) -> Array:
    u = air.u_b
    square = np.sum(u * u, axis=1)
    return _level(square * u[:, 0], square * u[:, 1])


def _turning(air: Air) -> Array:
    w = air.flight.w_b
    return _level(w[:, 1], -w[:, 0])


DRAG = ("rotor_drag", "body_drag")
LAWS: Mapping[str, Law] = {
    "across": Law(_across, 0.3, "1/s", "across the speed through the air"),
    "unequal": Law(
        _unequal, 0.3, "1/s", "of rotors' drag that is another ahead than aside", spoils=DRAG
    ),
    "climbing": Law(_climbing, 0.1, "1/m", "that goes with the speed times the climb"),
    "steeper": Law(
        _steeper, 0.01, "s/m^2", "that grows otherwise over the speed than drag does", spoils=DRAG
    ),
    "turning": Law(_turning, 1.0, "m/s", "that goes with the rates of turn"),
}
"""Of low order in speed and rates, and no effect's."""


class Beyond(Effect):
    """One of these laws; it has no name in the record, and none asks for it before it is seen."""

    def __init__(self, key: str, law: Law, *, name: str = "") -> None:
        """Take which; by the name it is asked about."""
        self.key, self.law, self.name = key, law, name
        super().__init__([Unknown(f"beyond_{key}", 0.0, law.plausible, 0.0, law.unit)])

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Add it."""
        if values[0] != 0.0:
            made = self.law.force(air)
            air.force_b[:, : made.shape[1]] += values[0] * made

    def acts(self, air: Air) -> bool:
        """Whether it does anything in this air, which is the prediction's of all other effects."""
        return bool(self.law.force(air)[:, list(self.law.axes)].any())


def beyond_of(effects: Sequence[Effect]) -> tuple[Law, ...]:
    """Those that a model has."""
    return tuple(e.law for e in effects if isinstance(e, Beyond))


def spoilt_by(laws: Sequence[Law]) -> tuple[str, ...]:
    """Effects whose numbers are not the vehicle's beside these."""
    return tuple(dict.fromkeys(name for law in laws for name in law.spoils))


def beyond_sentence(laws: Sequence[Law]) -> str:
    """What a person is told of them; empty where there are none."""
    forces = [f"a force {law.said}" for law in laws if not law.sensed]
    sensed = [law.said for law in laws if law.sensed]
    spoilt = spoilt_by(laws)
    but = f", so that {' and '.join(spoilt)} have no numbers" if spoilt else ""
    if forces:
        said = " and ".join(forces)
        sensed.insert(0, f"{said} repeats, and no effect describes it: it is no gust{but}")
    return "; ".join(sensed)
