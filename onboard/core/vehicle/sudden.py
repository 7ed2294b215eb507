"""Whether the mass or the thrust became another at a moment that nobody announced.

A level that changes once, at an unknown moment, is looked for at every window of the flight (the
supremum of a score test: D. W. K. Andrews, *Econometrica* 61, 1993), with a level of chance that is
divided by the number of moments.  A fit that knows no change takes it for noise that wanders, so it
tells little but the moment; how much the change explains is told by a fit that has it, with noise
of its own.  What goes from one level to another over a part of the flight, or over all of it (a
battery that nobody measured), is no sudden change: that is asked of the same likelihood.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.maths.chi_square import survival
from onboard.core.vehicle.effects.mass_change import Change, MassChange, ThrustChange
from onboard.core.vehicle.fit import Fit, fitted
from onboard.core.vehicle.instruments import whitened_regressors, whitened_residual
from onboard.core.vehicle.limits import (
    AMBIGUOUS,
    BLOCK_S,
    FALSE_ALARM,
    LEAST_NOISE_M_S2,
    STEP_S,
    WINDOW_STEPS,
)
from onboard.core.vehicle.matching import deviance, likelier
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.noise import AxisNoise, onsets, rms
from onboard.core.vehicle.recursion import accumulated, starts_of
from onboard.core.vehicle.windows import windows_of

CHANGES = (MassChange.name, ThrustChange.name)
GRADUAL = (0.25, 1.0)
"""Shares of a flight over which a change may go that is no sudden one [use]."""
Changing: TypeAlias = Callable[[Change], ForceModel]
"""Makes the model of the fit's flight that has this change besides."""
Blown: TypeAlias = Callable[[float], ForceModel]
"""Makes the model of the fit's flight whose wind becomes another at this moment."""


def change_of(fit: Fit, changing: Changing) -> Change | None:
    """The sudden change of a flight; None where there is none beyond chance.

    Args:
        fit: of a model that knows no change, and of the likelihood's least.
        changing: makes the model that has one.
    """
    moments = moments_of(fit)
    if not len(moments) or fit.model.flight.commands.shape[1] == 0:
        return None
    gains = scores(fit, changing, moments)
    if by_chance(float(np.max(gains)), len(CHANGES), len(moments)):
        return None
    plain = scores(replace(fit, noise=white(fit)), changing, moments)
    at = {int(moments[np.argmax(g)]) for g in (gains, plain)}
    its, change = min((_at(fit, changing, k) for k in at), key=lambda x: deviance(x[0]))
    if by_chance((deviance(fit) - deviance(its)) / its.scale, len(CHANGES), len(moments)):
        return None
    others = [_with(fit, changing(c)) for c in _gradual(fit, change)]
    ahead = min(deviance(other) - deviance(its) for other in others) / its.scale
    return change if ahead > AMBIGUOUS else None


def wind_instead(fit: Fit, change: Change, changing: Changing, blown: Blown) -> float | None:
    """When the wind became another, where that tells more of a flight than a change of it does.

    A front is no change of the vehicle: beside a wind that is one for the whole flight it looks
    like less of everything by which the vehicle feels the air.

    Args:
        fit: of a model that knows neither.
        change: of the mass or the thrust, which was found.
        changing: makes the model that has one.
        blown: makes the model whose wind becomes another at a moment, s.
    """
    without = deviance(_with(fit, changing(change)))
    near = [change.begin + k * WINDOW_STEPS * STEP_S for k in (-1, 0, 1)]
    best, moment = min((deviance(likelier(blown(t))), t) for t in near)
    return moment if best < without else None


def by_chance(gain: float, unknowns: int, moments: int) -> bool:
    """Whether so much is gained at one of the moments by chance, by so many unknowns."""
    return survival(max(gain, 0.0), unknowns) * moments > FALSE_ALARM


def _at(fit: Fit, changing: Changing, window: int) -> tuple[Fit, Change]:
    """The fit with a change near a window, at its likeliest moment."""
    t = float(fit.model.flight.t[windows_of(fit.model.flight).first[window]])
    change = Change(t, t)
    change = _placed(_with(fit, changing(change)), changing, change)
    return _with(fit, changing(change)), change


def white(fit: Fit) -> tuple[AxisNoise, ...]:
    """Noise without a memory: least squares find the moment whatever the noise is.

    J. Bai, *Review of Economics and Statistics* 79 (1997).  What a change leaves to a fit that does
    not know it looks like noise that wanders, for which a level is nothing and a jump everything.
    """
    return tuple(AxisNoise(max(rms(x), LEAST_NOISE_M_S2)) for x in fit.residual.T)


def scores(fit: Fit, changing: Changing, moments: NDArray[np.intp]) -> Array:
    """(c,) fall of chi-square by a change at each of these windows, to first order."""
    return gained(fit, *_always(fit, changing), moments)


def gained(fit: Fit, slope: Array, prior: Array, moments: NDArray[np.intp]) -> Array:
    """(c,) fall of chi-square by what begins at each of these windows, to first order.

    Args:
        fit: of a model without it.
        slope: (w, k, p) derivatives by what is there from the beginning, in windows.
        prior: (p, p) information on it.
        moments: (c,) windows.
    """
    left = whitened_residual(fit.model, fit.residual, fit.noise, fit.sensitivity)
    by = whitened_regressors(fit.model, fit.jacobian, fit.noise, fit.sensitivity)
    p, d = slope.shape[-1], fit.jacobian.by.shape[-1]
    by_rows, squares = np.zeros((len(moments), p, 1 + d)), np.zeros((len(moments), p, p))
    # At the fit what the flight asks of the others is what their prior holds back.
    N, asked = np.diag(fit.prior), fit.prior * (fit.model.nominal - fit.theta)
    for k, (y, columns) in enumerate(zip(left, by, strict=True)):
        its, with_itself = _products(fit, k, slope[:, k], np.column_stack([y, columns.by]))
        by_rows += its[moments]
        squares += with_itself[moments]
        more_N, more_b = columns.normal(y)
        N, asked = N + more_N, asked + more_b
    covariance, out = np.linalg.inv(N), np.zeros(len(moments))
    part = fit.model.flight.part[windows_of(fit.model.flight).first][moments]
    for number in np.unique(part).tolist():
        # A change is one of its own flight, and has rows in common with what acts there.
        here, places = part == number, fit.jacobian.places[number]
        its = by_rows[here, :, 1:]
        # What the other unknowns would take of it.
        u = by_rows[here, :, 0] - its @ (covariance[places] @ asked)
        S = squares[here] - its @ covariance[np.ix_(places, places)] @ np.swapaxes(its, 1, 2)
        out[here] = np.einsum("cp,cp->c", u, np.linalg.solve(S + prior, u[..., None])[..., 0])
    return out


def _products(fit: Fit, axis: int, slope: Array, rows: Array) -> tuple[Array, Array]:
    """Of whitened columns that begin at each window, with rows and with one another.

    By sums over what comes after: a product for each moment would take the square of their number.

    Args:
        fit: whose noise whitens.
        axis: number of the axis.
        slope: (w, p) columns that begin at the beginning.
        rows: (w, j) whitened.

    Returns:
        (w, p, j) and (w, p, p).
    """
    flight = fit.model.flight
    windows = windows_of(flight)
    sensitivity = windows.mean(fit.sensitivity)[:, axis]
    begun = onsets(slope, fit.noise[axis], sensitivity, windows.piece, windows.length_s)
    whole, apart = begun.whole, begun.apart
    both = np.hstack([rows, whole])
    after = _after(whole[:, :, None] * both[:, None, :], 1.0, flight.part[windows.first])
    fading = _after(both, begun.decay, windows.piece)
    products = after + apart[:, :, None] * fading[:, None, :]
    j = rows.shape[1]
    once = np.ones((len(rows), 1))
    tail = _after(once, begun.decay**2, windows.piece)[:, :, None]
    squares = products[..., j:] + fading[:, j:, None] * apart[:, None, :]
    squares = squares + tail * apart[:, :, None] * apart[:, None, :]
    return products[..., :j], squares


def _after(x: Array, decay: float, piece: NDArray[np.int64]) -> Array:
    """(n, ...) sums of ``decay^(k - i) x_k`` over k from i to the end of a piece."""
    turned = x[::-1].reshape(len(x), -1)
    out: Array = accumulated(turned, decay, starts_of(piece[::-1]))[::-1].reshape(x.shape)
    return out


def _always(fit: Fit, changing: Changing) -> tuple[Array, Array]:
    """Derivatives (w, k, p) by changes that are there all the time, and their prior (p, p)."""
    flight = fit.model.flight
    begins = [float(flight.t[flight.part == part][0]) for part in range(flight.parts)]
    models = [changing(Change(begin, begin)) for begin in begins]
    places = [i for n in CHANGES for i in models[0].indices(n)]
    # Each is of its own recording, and nothing elsewhere.
    slope = sum(
        (m.columns(_padded(fit, m), places) for m in models),
        np.zeros((len(flight), len(fit.model.axes), len(places))),
    )
    return windows_of(flight).mean(slope), np.diag(1.0 / models[0].plausible[places] ** 2)


def moments_of(fit: Fit) -> NDArray[np.intp]:
    """Windows that begin a block's length and more from either end of their recording."""
    flight = fit.model.flight
    first = windows_of(flight).first
    since = flight.since_start
    length = np.array([since[flight.part == k].max() for k in range(flight.parts)])[flight.part]
    inside = (since >= BLOCK_S) & (since <= length - BLOCK_S)
    return np.flatnonzero(inside[first])


def _placed(fit: Fit, changing: Changing, near: Change) -> Change:
    """The change at the likeliest step within a window of this moment, its numbers held."""
    t = fit.model.flight.t
    at = int(np.searchsorted(t, near.begin))
    steps = range(max(at - WINDOW_STEPS, 1), min(at + WINDOW_STEPS + 1, len(t)))

    def squares(moment: float) -> float:
        model = changing(Change(moment, moment))
        left = model.measured() - model.predicted(fit.theta)
        rows = whitened_residual(model, left, fit.noise, fit.sensitivity)
        return float(sum(y @ y for y in rows))

    moment = min((float(t[k]) for k in steps), key=squares)
    return Change(moment, moment)


def _gradual(fit: Fit, change: Change) -> list[Change]:
    """Changes over parts of the recording, as far as they are inside it."""
    flight = fit.model.flight
    t = flight.t[flight.part == change.part(flight)]
    out = []
    for share in GRADUAL:
        half = 0.5 * share * float(t[-1] - t[0])
        begin, end = max(change.begin - half, float(t[0])), min(change.begin + half, float(t[-1]))
        out.append(Change(float(t[0]), float(t[-1])) if share == 1.0 else Change(begin, end))
    return out


def _with(fit: Fit, model: ForceModel) -> Fit:
    """The model with a change fitted, from where the fit without it ended."""
    return fitted(model, _padded(fit, model))


def _padded(fit: Fit, model: ForceModel) -> Array:
    """(m,) unknowns of the fit, in a model that has a change besides, which is none yet."""
    out = model.nominal
    added = {i for n in CHANGES for i in model.indices(n)}
    if len(fit.theta) == len(out):
        return fit.theta.copy()
    out[[i for i in range(len(out)) if i not in added]] = fit.theta
    return out
