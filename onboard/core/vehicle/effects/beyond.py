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
        sides: (n, 2) of the air, along x and y, by one of the unknown.
        plausible: standard deviation of the unknown.
        unit: of it.
        said: what a person reads of it, as the end of *a force ...*.
        spoils: effects whose numbers are no longer the vehicle's then: they have another law.
    """

    sides: Callable[[Air], Array]
    plausible: float
    unit: str
    said: str
    spoils: tuple[str, ...] = ()


def _across(air: Air) -> Array:
    u = air.u_b
    return np.stack([-u[:, 1], u[:, 0]], axis=1)


def _unequal(air: Air) -> Array:
    u = rotor_root(air)[:, None] * air.u_b
    return np.stack([u[:, 0], -u[:, 1]], axis=1)


def _climbing(air: Air) -> Array:
    out: Array = air.u_b[:, 2:] * air.u_b[:, :2]
    return out


def _steeper(air: Air) -> Array:
    u = air.u_b
    out: Array = np.sum(u * u, axis=1)[:, None] * u[:, :2]
    return out


def _turning(air: Air) -> Array:
    w = air.flight.w_b
    return np.stack([w[:, 1], -w[:, 0]], axis=1)


DRAG = ("rotor_drag", "body_drag")
LAWS: Mapping[str, Law] = {
    "across": Law(_across, 0.3, "1/s", "across the speed through the air"),
    "unequal": Law(_unequal, 0.3, "1/s", "of rotors' drag that is another ahead than aside", DRAG),
    "climbing": Law(_climbing, 0.1, "1/m", "that goes with the speed times the climb"),
    "steeper": Law(
        _steeper, 0.01, "s/m^2", "that grows otherwise over the speed than drag does", DRAG
    ),
    "turning": Law(_turning, 1.0, "m/s", "that goes with the rates of turn"),
}
"""Of low order in speed and rates, and no effect's."""


class Beyond(Effect):
    """One of :data:`LAWS`; it has no name in the record, and none asks for it before it is seen."""

    def __init__(self, key: str, *, name: str = "") -> None:
        """Take which; by the name it is asked about."""
        self.key, self._law, self.name = key, LAWS[key], name
        super().__init__([Unknown(f"beyond_{key}", 0.0, self._law.plausible, 0.0, self._law.unit)])

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Add it."""
        if values[0] != 0.0:
            air.force_b[:, :2] += values[0] * self._law.sides(air)


def beyond_of(effects: Sequence[Effect]) -> tuple[str, ...]:
    """Keys of those that a model has."""
    return tuple(e.key for e in effects if isinstance(e, Beyond))


def spoilt_by(keys: Sequence[str]) -> tuple[str, ...]:
    """Effects whose numbers are not the vehicle's beside these."""
    return tuple(dict.fromkeys(name for key in keys for name in LAWS[key].spoils))


def beyond_sentence(keys: Sequence[str]) -> str:
    """What a person is told of them; empty where there are none."""
    if not keys:
        return ""
    said = " and ".join(f"a force {LAWS[key].said}" for key in keys)
    spoilt = spoilt_by(keys)
    but = f", so that {' and '.join(spoilt)} have no numbers" if spoilt else ""
    return f"{said} repeats, and no effect describes it: it is no gust{but}"
