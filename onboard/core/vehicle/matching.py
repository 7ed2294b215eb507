"""The vehicle level of one recording: fit, decide, prove, say."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.diagnosis.records import Ambiguity, NotTestable
from onboard.core.maths.arrays import Array, Mask
from onboard.core.maths.chi_square import survival
from onboard.core.vehicle.choices import Choices, Chosen, choose
from onboard.core.vehicle.effects.effect import Effect
from onboard.core.vehicle.effects.wind_profile import WindProfile
from onboard.core.vehicle.fit import Fit, fitted
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.flown_alone import drift_alone
from onboard.core.vehicle.gust_errors import gust_doubt
from onboard.core.vehicle.limits import (
    FALSE_ALARM,
    MOST_OUTLYING,
    OUTLYING,
    SENSED_GUST_M_S,
    SURE,
    TURBULENCE_FLOOR_M_S,
)
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.noise import AxisNoise, fitted_noise, gust_evidence, likelihood
from onboard.core.vehicle.places import AXES, places_of
from onboard.core.vehicle.records import (
    Alone,
    AxisMismatch,
    Compared,
    Difference,
    ForceSeries,
    WindEstimate,
)
from onboard.core.vehicle.remainder import (
    Remainder,
    left_out,
    left_out_sentence,
    remainder_sentence,
    remainders,
)
from onboard.core.vehicle.windows import windows_of

AIRSPEED = "airspeed_scale"
FORCE = (0, 1, 2)
"""Columns of a prediction that are forces; a further one is airspeed."""


@dataclass(frozen=True, slots=True)
class Turbulence:
    """Gusts along an axis.

    Attributes:
        rms: of those that the noise shows, slower than the steps, m/s.
        sigma: of it.
        evidence: twice the log-likelihood that it adds.
        whole: RMS by what all gusts, fast ones too, do to the mean of the drag, m/s; the same as
            ``rms`` where that is not known.
        whole_sigma: of it.
        floor: what other things than gusts look like, m/s.
    """

    rms: float
    sigma: float
    evidence: float
    whole: float
    whole_sigma: float
    floor: float = TURBULENCE_FLOOR_M_S

    @property
    def seen(self) -> bool:
        """Whether it is more than chance."""
        return survival(self.evidence, 1) < FALSE_ALARM

    @property
    def found(self) -> bool:
        """Whether it is more than chance, and than errors of the velocity look like."""
        return self.seen and self.rms > self.floor + SURE * self.sigma


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


def matched(model: ForceModel) -> Matched:
    """Fit, leave out what is no part of the model, fit again, decide."""
    whole, fit = model, fitted(model)
    kept = _inlying(fit)
    if not kept.all():
        model = replace(model, flight=_cut(model.flight, kept))
        fit = fitted(model, fit.theta)
    turbulence = _turbulence(fit)
    if AIRSPEED in {e.name for e in model.effects} and turbulence.seen:
        fit = replace(fit, doubt=gust_doubt(fit, turbulence.rms))
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


def held_out(choices: Choices, effects: tuple[str, ...]) -> Array:
    """(n, k) residual of every step, each by unknowns that its fold had no part in."""
    fit = choices.fit
    out: Array = fit.residual.copy()
    numbers = np.unique(fit.block)
    for fold, x in choices.by_fold(effects):
        mine = np.isin(fit.block, numbers[fold])
        out[mine] -= fit.jacobian[mine] @ x
    return out


def rms(x: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(x**2))) if x.size else float("nan")


def differences(m: Matched) -> tuple[Difference, ...]:
    """The effects that were chosen, and turbulence, with their evidence."""
    fit, chosen = m.fit, m.chosen
    whole = sum(max(chosen.gains[n], 0.0) for n in chosen.effects)
    out = []
    for name in chosen.effects:
        without = tuple(n for n in chosen.effects if n != name)
        places = m.model.indices(name)
        effect = _effect(m.model, name)
        shown = effect.shown(fit.theta[places].tolist(), fit.sigma[places].tolist())
        apart = fit.theta[places] - m.model.nominal[places]
        columns = [k for k, a in enumerate(m.model.axes) if (a in FORCE) != (name == AIRSPEED)]
        out.append(
            Difference(
                name,
                "vehicle",
                {s.name: Compared(s.nominal, s.value, s.sigma, s.unit) for s in shown},
                max(chosen.gains[name], 0.0) / whole if whole > 0.0 else 0.0,
                places_of(
                    m.model.flight, fit.jacobian[:, :, places] @ apart, m.model.axes, fit.block
                ),
                chosen.rivals[name],
                rms(held_out(m.choices, without)[:, columns]),
                rms(m.held[:, columns]),
            )
        )
    if m.turbulence.found:
        t = m.turbulence
        value = {
            "rms": Compared(0.0, t.whole, t.whole_sigma, "m/s"),
            "rms_below_5_hz": Compared(0.0, t.rms, t.sigma, "m/s"),
        }
        out.append(Difference("turbulence", "vehicle", value, 0.0))
    return tuple(out)


def wind_of(m: Matched) -> WindEstimate:
    """The wind of the flight, whether it was found to matter or not."""
    fit, flight = m.fit, m.model.flight
    places = m.model.indices("wind")
    north, east = fit.theta[places].tolist()
    sigmas = fit.sigma[places].tolist()
    exponent, exponent_sigma = None, float("nan")
    factor = np.ones(len(flight))
    if "wind_profile" in m.chosen.effects:
        k = m.model.indices("wind_profile")[0]
        exponent, exponent_sigma = float(fit.theta[k]), float(fit.sigma[k])
        profile = _effect(m.model, "wind_profile")
        if isinstance(profile, WindProfile):
            factor = profile.factor(m.model.start(flight), exponent)
    numbers = np.unique(fit.block)
    series, spread, when, heights, ekf, law = [], [], [], [], [], []
    for block, number in zip(fit.blocks, numbers, strict=False):
        mine = fit.block == number
        information = block.N[np.ix_(places, places)]
        if np.linalg.cond(information) > 1e8:
            continue
        covariance = np.linalg.inv(information) * fit.scale
        here = float(np.mean(factor[mine]))  # the unknown is the wind at the mean height
        found = fit.theta[places] + np.linalg.solve(information, block.b[places])
        series.append(here * found)
        spread.append(here * np.sqrt(np.diag(covariance)))
        law.append(here * fit.theta[places])
        when.append(float(np.mean(flight.t[mine]) - flight.t[0]))
        heights.append(float(np.mean(flight.height[mine]) - flight.ground))
        has = flight.ekf_wind.shape[1] == 2
        ekf.append(np.mean(flight.ekf_wind[mine], axis=0) if has else np.full(2, np.nan))
    return WindEstimate(
        north,
        east,
        sigmas[0],
        sigmas[1],
        flight.mean_height,
        exponent,
        exponent_sigma,
        m.turbulence.whole if m.turbulence.found else None,
        np.array(when),
        np.array(heights),
        np.array(series).reshape(-1, 2),
        np.array(spread).reshape(-1, 2),
        np.array(ekf).reshape(-1, 2),
        np.array(law).reshape(-1, 2),
    )


def mismatch_of(m: Matched) -> dict[str, AxisMismatch]:
    """RMS by axis on flight not used, before and after."""
    return {
        AXES[axis]: AxisMismatch(rms(m.nominal[:, k]), rms(m.held[:, k]))
        for k, axis in enumerate(m.model.axes)
        if axis in FORCE
    }


def drifts_of(m: Matched) -> Alone | None:
    """How velocity drifts when the nominal model, and the found one, fly on alone."""
    before = _drift(m.model, m.model.nominal, m.nominal)
    after = _drift(m.model, m.fit.theta, m.held)
    if not len(before):
        return None
    t: Array = m.model.flight.step_s * np.arange(1.0, len(before) + 1.0)
    return Alone(t, before, after)


def series_of(m: Matched) -> ForceSeries:
    """Forces over time, for a report."""
    columns = [k for k, axis in enumerate(m.model.axes) if axis in FORCE]
    measured = m.model.measured()[:, columns]
    t = m.model.flight.t - m.model.flight.t[0]
    axes = tuple(AXES[m.model.axes[k]] for k in columns)
    before, after = measured - m.nominal[:, columns], measured - m.held[:, columns]
    speed = np.linalg.norm(m.model.flight.v_n, axis=1)
    return ForceSeries(t, axes, measured, before, after, speed)


def ambiguous_of(m: Matched) -> tuple[Ambiguity, ...]:
    """Pairs that this flight cannot tell apart."""
    return tuple(
        Ambiguity((name, *rivals), _effect(m.model, rivals[0]).manoeuvre)
        for name, rivals in m.chosen.rivals.items()
        if rivals
    )


def not_testable_of(
    m: Matched, absent: Mapping[str, str], manoeuvres: Mapping[str, str]
) -> tuple[NotTestable, ...]:
    """What this flight could not have shown, why, and what would."""
    why = dict(absent)
    for name in m.chosen.untestable:
        why.setdefault(name, "the flight would not have shown it")
    return tuple(
        NotTestable(name, f"{reason}; {manoeuvres[name]}" if manoeuvres.get(name) else reason)
        for name, reason in why.items()
    )


def windless(untested: tuple[NotTestable, ...], m: Matched) -> tuple[NotTestable, ...]:
    """A calm has no profile: that is the reason, not the flight."""
    if "wind" in m.chosen.effects:
        return untested
    why = "there was no wind to have one"
    return tuple(replace(n, why=why) if n.name == "wind_profile" else n for n in untested)


def numbers_of(m: Matched) -> dict[str, Compared]:
    """Every unknown of the model, by ``effect.unknown``, and as the document shows it."""
    out: dict[str, Compared] = {}
    at = 0
    sigmas = m.fit.sigma
    for effect in m.model.effects:
        end = at + len(effect.unknowns)
        values, spread = m.fit.theta[at:end].tolist(), sigmas[at:end].tolist()
        prefix = f"{effect.name}." if effect.name else ""
        for s in effect.shown(values, spread):
            out[prefix + s.name] = Compared(s.nominal, s.value, s.sigma, s.unit)
        for u, value, sigma in zip(effect.unknowns, values, spread, strict=True):
            out[prefix + u.name] = Compared(u.nominal, value, sigma, u.unit, u.floor)
        at = end
    return out


def is_explained(m: Matched) -> bool:
    """Whether what is left is less than what errors of the velocity or the gusts found make."""
    if m.remainders:
        return False
    if m.turbulence.found:
        return True
    left = [
        rms(m.held[:, k]) / max(rms(m.fit.sensitivity[:, k]), 1e-6)
        for k, axis in enumerate(m.model.axes)
        if axis in (0, 1)
    ]
    return max(left, default=0.0) < TURBULENCE_FLOOR_M_S


def note_of(m: Matched) -> str:
    """What a person must know of flight that is not described or was not used; may be empty."""
    said = remainder_sentence(m.remainders), left_out_sentence(m.left_out)
    return "; ".join(s for s in said if s)


def _effect(model: ForceModel, name: str) -> Effect:
    return next(e for e in model.effects if e.name == name)


def _drift(model: ForceModel, theta: Array, residual: Array) -> Array:
    n = len(model.flight)
    error, slope = np.zeros((n, 3)), np.zeros((n, 3, 3))
    columns = [k for k, axis in enumerate(model.axes) if axis in FORCE]
    axes = [model.axes[k] for k in columns]
    error[:, axes] = -residual[:, columns]
    # Moving air one way is moving the vehicle the other way.
    slope[:, axes] = -model.gust_slope(theta)[:, columns]
    return drift_alone(model.flight, error, slope)


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


def _felt(fit: Fit) -> Turbulence:
    """Gusts by what the airspeed sensor reads beyond the model, as far as it is no white noise."""
    k, flight = len(fit.model.axes) - 1, fit.model.flight
    windows = windows_of(flight)
    residual = windows.mean(fit.residual[:, k])
    noise = fitted_noise(residual, np.ones(len(residual)), windows.piece, windows.length_s)
    data = residual, windows.piece, windows.length_s
    evidence = 2.0 * (likelihood(*data, noise) - likelihood(*data, AxisNoise(rms(residual))))
    scale = float(fit.theta[fit.model.indices(AIRSPEED)[0]])
    gust = noise.force * math.sqrt(1.0 - noise.white) / max(abs(scale), 0.1)
    memory = 2.0 * (noise.correlation_s + windows.length_s)
    sigma = gust / math.sqrt(2.0 * max(len(flight) * flight.step_s / memory, 1.0))
    return Turbulence(gust, sigma, evidence, gust, sigma, SENSED_GUST_M_S)


def _turbulence(fit: Fit) -> Turbulence:
    """Gusts by how the lateral noise grows with the sensitivity to them.

    An airspeed sensor shows those along the flow directly: a plane's angles follow the gusts, so
    that its forces hide them.
    """
    flight = fit.model.flight
    if AIRSPEED in {e.name for e in fit.model.effects}:
        return _felt(fit)
    lateral = (0, 1) if "rotor_drag" in {e.name for e in fit.model.effects} else (1,)
    found = []
    for k, axis in enumerate(fit.model.axes):
        if axis not in lateral:
            continue
        data = fit.residual[:, k], fit.sensitivity[:, k], flight.piece, flight.step_s
        noise = fitted_noise(*data, gusts=True)
        evidence, _ = gust_evidence(*data, noise)
        seconds = len(flight) * flight.step_s
        memory = noise.correlation_s * (1.0 - noise.white) + flight.step_s
        found.append((noise.gust, evidence, seconds / (2.0 * memory)))
    gust = float(np.sqrt(np.mean([g * g for g, _, _ in found]))) if found else 0.0
    count = sum(n for _, _, n in found) if found else 1.0
    evidence = sum(e for _, e, _ in found)
    sigma = gust / math.sqrt(2.0 * max(count, 1.0))
    whole, its = gust, sigma
    if any(u.name == "gust_variance" for u in fit.model.unknowns):
        k = fit.model.index("gust_variance")
        variance, spread = float(fit.theta[k]), float(fit.sigma[k])
        if variance > max(SURE * spread, gust**2):
            whole, its = math.sqrt(variance), spread / (2.0 * math.sqrt(variance))
        else:
            # Gusts that are too fast for the steps may be there: as large as the drag allows.
            its = max(math.sqrt(max(variance, 0.0) + SURE * spread) - gust, sigma)
    return Turbulence(gust, sigma, evidence, whole, its)
