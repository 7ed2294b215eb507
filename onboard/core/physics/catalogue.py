"""Every effect there is: whatever class lies in :mod:`onboard.core.physics.effects`.

Nothing lists the effects: a file that is put there is in the catalogue, with its name in every
report and its number in the parameter view.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

import numpy as np

from onboard.core.inputs.segments import Batch
from onboard.core.physics import effects
from onboard.core.physics.effect import Bearing, Effect, Origin
from onboard.core.physics.finding import Finding, Quantity, ResponseCurve


@cache
def kinds() -> tuple[type[Effect], ...]:
    """All effects, in the order of their codes.

    Raises:
        TypeError: two of them have the same name or code.
    """
    found: list[type[Effect]] = []
    for module in iter_modules(effects.__path__):
        space = vars(import_module(f"{effects.__name__}.{module.name}"))
        found += [
            kind
            for kind in space.values()
            if isinstance(kind, type)
            and issubclass(kind, Effect)
            and not kind.abstract
            and kind.__module__ == space["__name__"]
        ]
    for statement in ("effect", "code"):
        stated = [getattr(kind, statement) for kind in found]
        twice = {s for s in stated if stated.count(s) > 1}
        if twice:
            raise TypeError(f"several effects have the {statement} {sorted(twice)}")
    return tuple(sorted(found, key=lambda kind: kind.code))


def kind_of(name: str) -> type[Effect] | None:
    """The effect of a name; None if there is none."""
    return _by_name().get(name)


def catalogue(origin: Origin) -> list[Effect]:
    """One of each, about ``origin``."""
    return [kind(origin) for kind in kinds()]


@cache
def _by_name() -> dict[str, type[Effect]]:
    return {kind.effect: kind for kind in kinds()}


def bearing_of(name: str) -> Bearing:
    """What an effect means for the calibration; of one that nobody knows, the worst."""
    kind = kind_of(name)
    return Bearing.NO_ONE_NUMBER if kind is None else kind.bearing


def title_of(name: str) -> str:
    """The effect as a short sentence; an unknown name is read as words."""
    kind = kind_of(name)
    return name.replace("_", " ") if kind is None else kind.title


def is_named(name: str) -> bool:
    """False for a description of the data that claims no physical name."""
    kind = kind_of(name)
    return kind is None or kind.named


def is_excluded(name: str) -> bool:
    """Whether the effect is seen in the data themselves and left out of the fit."""
    kind = kind_of(name)
    return kind is not None and kind.excluded


def treated_of(name: str) -> str:
    """What becomes of what was seen in the data themselves, as part of a sentence."""
    return (kind_of(name) or Effect).treated


def adds_to_force(name: str) -> bool:
    """Whether the six are not all that makes the force beside it; of one that nobody knows, yes."""
    kind = kind_of(name)
    return kind is None or kind.acceleration is not Effect.acceleration


def size_of(found: Finding) -> str:
    """The size in a few words; empty where there is nothing finite to say."""
    if not math.isfinite(sum(q.value for q in found.unknowns.values())):
        return ""
    return (kind_of(found.name) or Effect).size(found)


def danger_of(found: Finding) -> str:
    """Why one should not fly with it before it is cured, in words; empty if one may."""
    return (kind_of(found.name) or Effect).danger(found)


def phrase_of(found: Finding) -> str:
    """A finding as part of a sentence, with its size and its name."""
    kind = kind_of(found.name)
    sentence = "something is missing" if kind is None else kind.sentence
    size = float(np.linalg.norm([q.value for q in found.unknowns.values()]))
    return f"{sentence.format(size=size, degrees=np.degrees(size))} ({found.name})"


def response_of(
    name: str,
    unknowns: Mapping[str, Quantity],
    batches: Sequence[Batch],
    t0: float,
    temperature: float,
) -> ResponseCurve | None:
    """How an effect goes with its signal; None for one that follows no single signal.

    Args:
        name: of the effect.
        unknowns: as found; ``time``, if it is there, is when it began, s since ``t0``.
        batches: the flight.
        t0: first sample, s on the boot clock.
        temperature: at which a temperature drift is nothing, degC.
    """
    kind = kind_of(name)
    if kind is None or kind.response is None:
        return None
    began = unknowns.get("time")
    sizes = {k: q for k, q in unknowns.items() if k != "time"}
    if began is None:
        return kind.response.curve(sizes, batches, t0, temperature)
    return kind.response.curve(sizes, batches, t0, began.value, began.value)
