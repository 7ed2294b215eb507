"""A model of the force brought to a flight: fit, decide, prove."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array, Mask
from onboard.core.vehicle.answer_errors import answered_by_commands
from onboard.core.vehicle.bounds import above_bounds, at_bounds, below_bounds
from onboard.core.vehicle.changed import undecided_of
from onboard.core.vehicle.choices import Choices
from onboard.core.vehicle.chosen import Chosen, choose
from onboard.core.vehicle.effects.airspeed_scale import AirspeedScale
from onboard.core.vehicle.effects.beyond import Beyond, beyond_of, spoilt_by
from onboard.core.vehicle.effects.wind import FLOOR_M_S, Wind
from onboard.core.vehicle.effects.wind_change import WindChange
from onboard.core.vehicle.felt import felt_across, felt_by
from onboard.core.vehicle.fit import Fit, fitted
from onboard.core.vehicle.gust_errors import rising, turned_by_gusts
from onboard.core.vehicle.limits import (
    LEAVING_ROUNDS,
    MOST_OUTLYING,
    OUTLYING,
    RECEIVER_M_S,
    SURE,
)
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.noise import likelihood
from onboard.core.vehicle.propeller_doubt import propeller_doubt
from onboard.core.vehicle.remainder import (
    Remainder,
    left_out,
    not_used,
    remainders,
    share_of,
)
from onboard.core.vehicle.rotor_doubt import rotor_doubt
from onboard.core.vehicle.turbulence import Turbulence, turbulence_of
from onboard.core.vehicle.windows import windows_of


@dataclass(frozen=True, slots=True)
class Matched:
    """A fit with what was decided on it, ready to be told.

    Attributes:
        fit: of everything.
        choices: its subsets.
        chosen: the effects.
        held: (n, k) residual of each step by unknowns of other folds, m/s^2, with what is handed
            back.
        nominal: (n, k) residual of the nominal airframe in still air.
        turbulence: of the air.
        remainders: spans that the model does not describe.
        left_out: spans, s since the start, that were not used.
        below: effects that would go below what they can be, and stand for something else.
        above: the same of what cannot be so much.
        unexplained: share of the flight in the remainders.
        plain: the fit before what gusts did to it was taken out; the same where nothing was.
    """

    fit: Fit
    choices: Choices
    chosen: Chosen
    held: Array
    nominal: Array
    turbulence: Turbulence
    remainders: tuple[Remainder, ...] = ()
    left_out: tuple[tuple[float, float], ...] = ()
    below: tuple[str, ...] = ()
    plain: Fit | None = None
    above: tuple[str, ...] = ()
    unexplained: float = 0.0

    @property
    def stand_ins(self) -> tuple[str, ...]:
        """Effects that stand for something else, and have no name for it."""
        return (*self.below, *self.above, *self.undecided)

    @property
    def undecided(self) -> tuple[str, ...]:
        """Effects that describe a change in flight which may be another one."""
        return undecided_of(self.chosen.effects)

    @property
    def handed_back(self) -> tuple[str, ...]:
        """Effects whose numbers a file of the airframe is to have: all that are the vehicle's."""
        none = {*self.stand_ins, *spoilt_by(beyond_of(self.model.effects))}
        return tuple(name for name in self.chosen.taken if name not in none)

    @property
    def flies_by(self) -> Array:
        """(m,) unknowns by which it flies on: the fit's, or nominal where nothing is used."""
        return self.model.nominal if self.held is self.nominal else self.fit.theta

    @property
    def model(self) -> ForceModel:
        """The model."""
        return self.fit.model


def matched(model: ForceModel, first: Fit | None = None) -> Matched:
    """Fit, leave out what is no part of the model, fit again, decide.

    Args:
        model: of the whole flight.
        first: the fit of it, where it is there already.
    """
    whole = model.flight
    done = _finished(likelier(model) if first is None else first)
    below: tuple[str, ...] = ()
    if at_bounds(done.fit):
        free = _finished(likelier(replace(model, bounded=False), done.fit))
        below = below_bounds(free.fit)
        if below:
            done = free
    fit, model = done.fit, done.fit.model
    choices = Choices(fit)
    chosen = _blowing(fit, choose(choices))
    nominal = model.measured() - model.predicted(model.nominal)
    of_all = replace(model, flight=whole)
    spans = not_used(of_all, fit, done.kept, done.turbulence.largest)
    left = (*remainders(of_all, fit), *spans)
    return Matched(
        fit,
        choices,
        chosen,
        left_by(choices, chosen.taken),
        nominal,
        done.turbulence,
        left,
        left_out(whole, done.kept),
        below,
        done.plain,
        above_bounds(fit),
        share_of(left, whole),
    )


def _blowing(fit: Fit, chosen: Chosen) -> Chosen:
    """With the wind named where it changes: its two halves may cancel in the mean that it has."""
    if Wind.name in (*chosen.effects, *chosen.untestable) or not _becomes_another(fit):
        return chosen
    return replace(
        chosen,
        effects=(*chosen.effects, Wind.name),
        gains=chosen.gains | {Wind.name: 0.0},
        rivals=chosen.rivals | {Wind.name: ()},
    )


def _becomes_another(fit: Fit) -> bool:
    """Whether the wind changes by surely more than matters."""
    at = 0
    for effect in fit.model.effects:
        places = np.arange(at, at + len(effect.unknowns))
        at += len(effect.unknowns)
        if not isinstance(effect, WindChange):
            continue
        for its in places.reshape(2, -1):
            most, least = its[np.argmax(fit.theta[its])], its[np.argmin(fit.theta[its])]
            way = np.zeros(len(fit.theta))
            way[most], way[least] = 1.0, -1.0
            sigma = math.sqrt(max(float(way @ fit.covariance @ way), 0.0))
            if float(way @ fit.theta) > FLOOR_M_S + SURE * sigma:
                return True
    return False


@dataclass(frozen=True, slots=True)
class _Finished:
    """The fit of what the model describes, without and with what gusts did; steps; the air."""

    plain: Fit
    fit: Fit
    kept: Mask
    turbulence: Turbulence


def _finished(first: Fit) -> _Finished:
    plain, kept = described(first)
    fit, turbulence = plain, turbulence_of(plain)
    up = rising(plain)
    risen = up > math.hypot(RECEIVER_M_S, turbulence.errors)
    sensed = AirspeedScale.name in {e.name for e in fit.model.effects}
    felt = felt_by(fit) if sensed and turbulence.found else None
    if felt is None and risen:
        # Nothing feels these gusts, and angles that they scatter are told without their scatter.
        felt = felt_across(fit, up if sensed else 0.0)
        turbulence = turbulence if sensed else turbulence_of(felt.fit)
    fit = fit if felt is None else felt.fit
    if felt is not None or (sensed and turbulence.seen):
        fit = replace(fit, turned=turned_by_gusts(fit, turbulence.rms, felt))
    fit = replace(
        fit, doubt=propeller_doubt(fit) + rotor_doubt(fit), answered=answered_by_commands(fit)
    )
    return _Finished(plain, fit, kept, turbulence)


def described(fit: Fit) -> tuple[Fit, Mask]:
    """The fit of what the model describes, and which of the steps (n,) that is.

    What is far from a fit has bent it: from the one without it other steps are far, and another
    valley may be the likelier.  Both are asked of each fit anew until the steps are the same.
    """
    whole = fit.model
    kept = np.ones(len(whole.flight), dtype=bool)
    for _ in range(LEAVING_ROUNDS):
        now = _inlying(whole.measured() - whole.predicted(fit.theta), whole.flight.part)
        if np.array_equal(now, kept) or np.mean(~now) > MOST_OUTLYING:
            break
        kept = now
        fit = likelier(replace(whole, flight=whole.flight.cut(kept)), fit)
    return fit, kept


def likelier(model: ForceModel, start: Fit | None = None) -> Fit:
    """The likelier of two fits: from still air, or another fit, and anew in its wind.

    Beside a wind that is not known yet all else is pulled about, and may be left in another valley
    of the likelihood: a propeller that brakes, and twice the thrust to make up for it.
    """
    noise = None if start is None else start.noise
    first = fitted(model, None if start is None else start.theta, noise)
    if model.instrumented:
        # Regressors that are told from the past lead to no minimum of a likelihood.
        return first
    anew, wind = model.nominal, model.indices(Wind.name)
    anew[wind] = first.theta[wind]
    again = fitted(model, anew, noise)
    return min(first, again, key=deviance)


def deviance(fit: Fit) -> float:
    """Twice the negative logarithm of the likelihood, by the fit's own noise, and of the prior."""
    windows = windows_of(fit.model.flight)
    residual, sensitivity = windows.mean(fit.residual), windows.mean(fit.sensitivity)
    told = sum(
        likelihood(residual[:, k], windows.piece, windows.length_s, its, sensitivity[:, k])
        for k, its in enumerate(fit.noise)
    )
    apart = fit.theta - fit.model.nominal
    return float(fit.prior @ (apart * apart)) - 2.0 * told


def held_out(choices: Choices, effects: tuple[str, ...]) -> Array:
    """(n, k) residual of every step, each by unknowns that its fold had no part in."""
    fit = choices.fit
    out: Array = fit.residual.copy()
    numbers = np.unique(fit.block)
    for fold, x in choices.by_fold(effects):
        mine = np.isin(fit.block, numbers[fold])
        out[mine] -= fit.jacobian.at(mine).times(x)
    return out


def left_by(choices: Choices, effects: tuple[str, ...]) -> Array:
    """(n, k) the same, with what no effect describes in it: it is not handed back."""
    fit = choices.fit
    mine = [isinstance(fit.model.effect_of(k), Beyond) for k in range(len(fit.theta))]
    out: Array = held_out(choices, effects) + fit.jacobian.times(np.where(mine, fit.theta, 0.0))
    return out


def _inlying(residual: Array, part: NDArray[np.int64]) -> Mask:
    """(n,) steps whose residual (n, k), m/s^2, is no further off than noise goes in its flight.

    Args:
        residual: what the model leaves.
        part: (n,) which of several recordings a step is of: each flew in air of its own.
    """
    out: Mask = np.ones(len(residual), dtype=bool)
    for number in np.unique(part):
        mine = part == number
        apart = np.abs(residual[mine] - np.median(residual[mine], axis=0))
        spread = 1.4826 * np.median(apart, axis=0)
        out[mine] = np.all(apart <= OUTLYING * np.maximum(spread, 0.02), axis=1)
    return out
