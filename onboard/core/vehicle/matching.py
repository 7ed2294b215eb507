"""A model of the force brought to a flight: fit, decide, prove."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from onboard.core.maths.arrays import Array, Mask
from onboard.core.vehicle.choices import Choices
from onboard.core.vehicle.chosen import Chosen, choose
from onboard.core.vehicle.effects.airspeed_scale import AirspeedScale
from onboard.core.vehicle.effects.wind import Wind
from onboard.core.vehicle.felt import felt_by
from onboard.core.vehicle.fit import Fit, fitted
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.gust_errors import turned_by_gusts
from onboard.core.vehicle.limits import MOST_OUTLYING, OUTLYING
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.noise import likelihood
from onboard.core.vehicle.propeller_doubt import propeller_doubt
from onboard.core.vehicle.remainder import Remainder, left_out, remainders
from onboard.core.vehicle.turbulence import Turbulence, turbulence_of
from onboard.core.vehicle.windows import windows_of


@dataclass(frozen=True, slots=True)
class Matched:
    """A fit with what was decided on it, ready to be told.

    Attributes:
        fit: of everything.
        choices: its subsets.
        chosen: the effects.
        held: (n, k) residual of each step by unknowns of other folds, m/s^2.
        nominal: (n, k) residual of the nominal airframe in still air.
        turbulence: of the air.
        remainders: spans that the model does not describe.
        left_out: spans, s since the start, that were not used.
    """

    fit: Fit
    choices: Choices
    chosen: Chosen
    held: Array
    nominal: Array
    turbulence: Turbulence
    remainders: tuple[Remainder, ...] = ()
    left_out: tuple[tuple[float, float], ...] = ()

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
    whole, fit = model, likelier(model) if first is None else first
    kept = _inlying(fit)
    if not kept.all():
        model = replace(model, flight=_cut(model.flight, kept))
        fit = fitted(model, fit.theta)
    turbulence = turbulence_of(fit)
    if AirspeedScale.name in {e.name for e in model.effects}:
        felt = felt_by(fit) if turbulence.found else None
        fit = fit if felt is None else felt.fit
        if turbulence.seen:
            fit = replace(fit, turned=turned_by_gusts(fit, turbulence.rms, felt))
    fit = replace(fit, doubt=propeller_doubt(fit))
    choices = Choices(fit)
    chosen = choose(choices)
    nominal = model.measured() - model.predicted(model.nominal)
    return Matched(
        fit,
        choices,
        chosen,
        held_out(choices, chosen.effects),
        nominal,
        turbulence,
        remainders(whole, fit),
        left_out(whole.flight, kept),
    )


def likelier(model: ForceModel) -> Fit:
    """The likelier of two fits: from still air, and anew in the wind that it finds.

    Beside a wind that is not known yet all else is pulled about, and may be left in another valley
    of the likelihood: a propeller that brakes, and twice the thrust to make up for it.
    """
    first = fitted(model)
    if model.instrumented:
        # Regressors that are told from the past lead to no minimum of a likelihood.
        return first
    start, wind = model.nominal, model.indices(Wind.name)
    start[wind] = first.theta[wind]
    again = fitted(model, start)
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
        out[mine] -= fit.jacobian[mine] @ x
    return out


def _inlying(fit: Fit) -> Mask:
    """(n,) steps that the model describes; all of them if it fails on too many."""
    centre = np.median(fit.residual, axis=0)
    spread = 1.4826 * np.median(np.abs(fit.residual - centre), axis=0)
    far: Mask = np.abs(fit.residual - centre) > OUTLYING * np.maximum(spread, 0.02)
    kept: Mask = np.logical_not(far.any(axis=1))
    if np.mean(~kept) > MOST_OUTLYING:
        return np.ones(len(kept), dtype=bool)
    return kept


def _cut(flight: Flight, kept: Mask) -> Flight:
    """The flight without some steps; the noise's memory does not reach across."""
    out = flight.kept(kept)
    breaks = (np.diff(out.t) > 1.5 * out.step_s) | (np.diff(out.piece) != 0)
    out.piece[:] = np.concatenate([[0], np.cumsum(breaks)])
    return out
