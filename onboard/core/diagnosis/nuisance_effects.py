"""Effects whose unknowns are in every model: when they count as found.

Timing is always estimated, and so are constant errors of the recorded attitude: an EKF is never
exact.  Each becomes an effect past a size that it states itself
(:attr:`onboard.core.physics.effect.Effect.in_every_model`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache

from onboard.core.maths.arrays import Array
from onboard.core.model.linearisation import Linearisation
from onboard.core.physics.catalogue import kinds
from onboard.core.physics.effect import Cure, Effect, NuisanceFit
from onboard.core.physics.finding import Quantity

Measured = dict[str, tuple[dict[str, Quantity], Cure]]


@cache
def nuisance_kinds() -> dict[str, type[Effect]]:
    """Effects whose unknowns are in every model, by name, in the order of the catalogue."""
    return {kind.effect: kind for kind in kinds() if kind.in_every_model}


def timing_unknowns() -> list[str]:
    """Unknowns of the timing that are effects from a size on."""
    return [u for k in nuisance_kinds().values() if k.least is not None for u in k.in_every_model]


def constant_unknowns() -> list[str]:
    """Unknowns that are effects from a size on and no timing."""
    timing = set(timing_unknowns())
    return [u for k in nuisance_kinds().values() for u in k.in_every_model if u not in timing]


def nuisance_effects(nuisances: Callable[[type[Effect]], NuisanceFit]) -> Measured:
    """Effects that are always in the model, and large enough and sure enough to report.

    Args:
        nuisances: of the fit that tells an effect.
    """
    measured = {name: kind.measured(nuisances(kind)) for name, kind in nuisance_kinds().items()}
    return {name: found for name, found in measured.items() if found is not None}


def without(
    names: Sequence[str],
    index: Mapping[str, int],
    point: Linearisation,
    absent: Array,
    told: float,
) -> Array:
    """(m,) values at which the unknowns ``names`` are not in the model.

    Args:
        names: of unknowns.
        index: places of unknowns by name.
        point: what they are counted from.
        absent: (m,) the same for all other unknowns.
        told: latency that the autopilot was told, s.
    """
    at = absent.copy()
    values = {
        unknown: value
        for kind in nuisance_kinds().values()
        for unknown, value in kind.absent(point, told).items()
    }
    for name in names:
        at[index[name]] = values.get(name, 0.0)
    return at
