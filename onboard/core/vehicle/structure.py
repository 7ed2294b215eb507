"""Whether what a model leaves repeats with the vehicle's motion, or with time: then it is not air.

Gusts are random: no law of speed, rates and attitude tells them, and what the model leaves of them
falls no further than chance if such a law is let in.  A force that does is no turbulence, whatever
its size; and a wind that changes over minutes is a wind.  Both are asked after a fit, by the score
that decides on effects: the fall of chi-square with everything else free, on flight that was not
fitted as well, and what it does must be more than errors of the velocity look like.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.chi_square import survival
from onboard.core.vehicle.air import AHEAD, SIDE, UP, Air
from onboard.core.vehicle.choices import Choices
from onboard.core.vehicle.effects.beyond import Beyond, Law
from onboard.core.vehicle.effects.beyond_rotors import COPTERS
from onboard.core.vehicle.effects.effect import Effect
from onboard.core.vehicle.effects.lift import Lift
from onboard.core.vehicle.effects.rising_air import RISING, RisingAir
from onboard.core.vehicle.effects.wind import Wind
from onboard.core.vehicle.effects.wind_change import CHANGE, WindChange
from onboard.core.vehicle.effects.wind_height import HEIGHT, WindByHeight
from onboard.core.vehicle.effects.wind_profile import WindProfile
from onboard.core.vehicle.fit import Fit, Slopes, slopes_at, summed
from onboard.core.vehicle.gust_errors import rising
from onboard.core.vehicle.inflation import inflation_of
from onboard.core.vehicle.limits import FALSE_ALARM, RECEIVER_M_S, SURE
from onboard.core.vehicle.noise import rms
from onboard.core.vehicle.places import FORCE

ASKED = "asked"
"""Name of what is asked about, while it is."""
LEVEL = (AHEAD, SIDE)
"""Axes along which a wind that changes is asked whether it matters."""


@dataclass(frozen=True, slots=True)
class Structure:
    """What repeats: its key, the fall of chi-square, and the RMS of its force, m/s^2."""

    key: str
    gain: float
    force: float


def structures(
    fit: Fit, known: Sequence[str], laws: Mapping[str, Law] = COPTERS, *, answering: bool = False
) -> tuple[Structure, ...]:
    """What repeats in the remainder of a fit, the strongest first.

    Args:
        fit: of everything else.
        known: keys of what the model has already.
        laws: that are asked for beside a wind that changes; a copter's, with air that rises, are
            the default.
        answering: whether the vehicle answers gusts that the fit takes for its own motion: then
            a law must hold as well by what it was a second before, which a gust has not made, and
            one of what answers at once is not asked for.
    """
    model = fit.model
    air = model.air(fit.theta)
    every: dict[str, Effect] = {key: Beyond(key, law, name=ASKED) for key, law in laws.items()}
    if answering:
        every = {key: e for key, e in every.items() if not laws[key].answers}
    every[CHANGE] = WindChange(model.flight, name=ASKED)
    if laws is COPTERS:
        every[RISING] = RisingAir(name=ASKED)
    else:
        every[HEIGHT] = WindByHeight(model.flight, name=ASKED)
    asked = {k: e for k, e in every.items() if k not in known and _acts(e, air)}
    slopes = slopes_at(model, fit.theta)
    level = FALSE_ALARM / len(every)
    found = [_found(key, e, fit, slopes, level) for key, e in asked.items()]
    if answering:
        told = replace(fit, model=replace(model, instrumented=FORCE))
        seen = {s.key for s in found if s is not None}
        again = {key: e for key, e in asked.items() if key in seen}
        found = [_found(key, e, told, slopes, level, again=True) for key, e in again.items()]
    return tuple(sorted((s for s in found if s is not None), key=lambda s: -s.gain))


def _acts(effect: Effect, air: Air) -> bool:
    """Whether this flight could show it."""
    return effect.acts(air) if isinstance(effect, Beyond) else not effect.missing(air)


def _found(
    key: str, effect: Effect, fit: Fit, slopes: Slopes, level: float, *, again: bool = False
) -> Structure | None:
    """What one law finds, if it is more than chance and than errors of the velocity."""
    wide = _with(fit, slopes, effect)
    choices = Choices(wide)
    names = [n for n in choices.names if n != ASKED]
    without, whole = choices.solved(names), choices.solved([*names, ASKED])
    places = wide.model.indices(ASKED)
    x = whole.x[places]
    gain = min(without.chi2 - whole.chi2, whole.apart(places, x))
    if not survival(gain, len(places)) < level:
        return None
    if choices.held_out(names) <= choices.held_out([*names, ASKED]):
        return None
    sides = effect.law.axes if isinstance(effect, Beyond) else LEVEL
    axes = [k for k, axis in enumerate(wide.model.axes) if axis in sides]
    if not axes:
        return None
    made = wide.jacobian.of(places)[:, axes]
    force, sigma = rms(made @ x), _spread(made, whole.covariance[np.ix_(places, places)])
    # Up to here it may be the velocity's or the heading's error, as gusts that small may be.
    # By its past a law shows that it is there; how large it is, it shows by itself.
    if not again and force < rms(_unclear(fit, effect)[:, axes]) + SURE * sigma:
        return None
    return Structure(key, gain, force)


def _unclear(fit: Fit, effect: Effect) -> Array:
    """(n, k) m/s^2 that errors look like, which an effect has to exceed.

    What a wrong heading does to a wing goes with the bank and its side, as no law of a wing does.
    """
    if not isinstance(effect, Beyond) or not fit.model.indices(Lift.name):
        return fit.model.unclear(fit.theta, RECEIVER_M_S)
    # Air that rises leans the lift, and what it does along the lift nobody takes for a law.
    errors = RECEIVER_M_S if UP in effect.law.axes else max(RECEIVER_M_S, rising(fit))
    out: Array = errors * np.linalg.norm(fit.model.gust_slope(fit.theta), axis=-1)
    return out


def _spread(made: Array, covariance: Array) -> float:
    """Root of the mean variance of a force by unknowns that are so well known."""
    mean = np.einsum("nki,nkj->ij", made, made) / (made.shape[0] * made.shape[1])
    return float(np.sqrt(np.sum(mean * covariance)))


def _with(fit: Fit, slopes: Slopes, effect: Effect) -> Fit:
    """The sums with one more effect, which does nothing yet; ``slopes`` are those without it."""
    effects = list(fit.model.effects)
    at = len(effects)
    if isinstance(effect, WindChange | WindByHeight | RisingAir):
        before = (Wind.name, WindProfile.name) if isinstance(effect, RisingAir) else (Wind.name,)
        at = 1 + max(k for k, e in enumerate(effects) if e.name in before)
    place = sum(len(e.unknowns) for e in effects[:at])
    effects.insert(at, effect)
    model = replace(fit.model, effects=tuple(effects))
    theta = np.insert(fit.theta, place, np.zeros(len(effect.unknowns)))
    more = list(range(place, place + len(effect.unknowns)))
    by = slopes.by.inserted(place, model.columns(theta, more))
    level = slopes.level
    if level is not None:
        level = level.inserted(place, model.levelled.columns(theta, more))
    wide = summed(
        model, theta, 1.0 / model.plausible**2, fit.noise, fit.sensitivity, Slopes(by, level)
    )
    # Where it does nothing yet, scores of what it should do have a mean, which is no scatter.
    step = Choices(wide).solved([e.name for e in effects]).x
    there = [replace(b, b=b.b - b.times(step)) for b in wide.blocks]
    held = theta + step <= model.least
    # What errors of the motion look like is asked by itself.
    none = np.zeros((len(theta), 1))
    inflation, scale = inflation_of(there, wide.prior, held, none, settled=False)
    return replace(wide, inflation=inflation, scale=scale)
