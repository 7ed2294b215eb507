"""Drag and thrust of a plane in gusty air, by forces that its gusts are taken out of.

Gusts are felt twice.  **Along the flow** by the airspeed sensor: what its reading is off by tells
what drag is off by.  **Across it** by the wing: air that rises carries it along in
``2 m / (rho V S c_lift_a)``, a quarter of a second, and after that the angle of attack is again the
one that the lift needs.  It is the angle by path and attitude that is off, not the force; so along
the body the law is asked at the angle that the measured lift needs (regression of the angle on the
force, right where the angle has the error: W. A. Fuller, *Measurement Error Models*, 1987, section
1.1).  Both are first-order: the force ahead less its own slopes times the two gusts.

That takes the lift for known.  Its slope cannot be told from angles that gusts scatter, so it is
nominal, and the lift at no angle what the mean force upwards makes it.  What the slope may be
instead, and how well wind and airspeed are known, are doubts of what is found.

The lift itself, and the side force, are told as :mod:`onboard.core.vehicle.across` says.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.half_space import least_above
from onboard.core.vehicle.across import Rows, across, side_places, whitened_axis
from onboard.core.vehicle.air import AHEAD, SIDE, UP
from onboard.core.vehicle.block_sums import BlockSums, total
from onboard.core.vehicle.effects.airspeed_scale import AirspeedScale
from onboard.core.vehicle.effects.beyond import Beyond
from onboard.core.vehicle.effects.drag import Drag
from onboard.core.vehicle.effects.gust_lift import GustLift
from onboard.core.vehicle.effects.lift import Lift
from onboard.core.vehicle.effects.propeller_inflow import PropellerInflow
from onboard.core.vehicle.effects.propulsion import Propulsion
from onboard.core.vehicle.effects.slip_drag import SlipDrag
from onboard.core.vehicle.effects.wind import Wind
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.inflation import inflation_of
from onboard.core.vehicle.instruments import whitened_rows
from onboard.core.vehicle.limits import SETTLED
from onboard.core.vehicle.model import GUST, ForceModel
from onboard.core.vehicle.windows import windows_of

SENSED, NONE = -1, -1
"""Places of the axes: a plane with throttle and airspeed has x, y, z and the sensor."""
STEPS = 25
"""Steps at the most: what is left is nearly linear [cost]."""
LONGEST_STEP = 0.5
"""Plausible sizes that one goes at once [cost]."""


@dataclass(frozen=True, slots=True)
class Felt:
    """A fit with drag and thrust by a force that has no gusts in it.

    Attributes:
        fit: of everything.
        places: of what has no gusts in it.
        lean: (m, l) of :class:`onboard.core.vehicle.turned.Turned`.
        ahead: whether the force ahead has none; it takes an airspeed sensor.
    """

    fit: Fit
    places: tuple[int, ...]
    lean: Array
    ahead: bool = True


def felt_by(fit: Fit) -> Felt | None:
    """The fit with drag and thrust found anew; None where there is nothing to find them by."""
    model = fit.model
    if model.axes != (AHEAD, SIDE, UP, 3):
        return None
    mine = _told_ahead(model)
    theta = _balanced(model, fit.theta)
    # From what gusts have made of drag and thrust another valley is nearer than the airframe's.
    theta[mine] = model.nominal[mine]
    for _ in range(STEPS):
        rows = _rows(model, theta)
        N = rows.regressors[:, mine].T @ rows.regressors[:, mine] + np.diag(fit.prior[mine])
        b = rows.regressors[:, mine].T @ rows.left
        b = b + fit.prior[mine] * (model.nominal - theta)[mine]
        step = least_above(N, b, (model.least - theta)[mine])
        far = float(np.max(np.abs(step) / model.plausible[mine]))
        theta = theta.copy()
        theta[mine] += step / max(1.0, far / LONGEST_STEP)
        if float(np.max(np.abs(step) / np.sqrt(np.diag(np.linalg.inv(N))))) < SETTLED:
            break
    rows = _rows(model, theta)
    theta, side, up = across(fit, theta)
    places = (*mine, *model.indices(Lift.name), *side_places(model))
    found = _summed(fit, theta, {AHEAD: rows, SIDE: side, UP: up}, {AHEAD: mine}, AHEAD)
    return Felt(found, places, _lean(fit, theta, rows, mine))


def felt_across(fit: Fit, lasting: float = 0.0) -> Felt:
    """The fit with lift and side force alone found anew, where no sensor feels the gusts ahead.

    Those are told by the axes that :mod:`onboard.core.vehicle.across` is about, and by no other.

    Args:
        fit: of everything.
        lasting: standard deviation of the air's mean up and down, m/s: none of turbulence, but
            thermals and waves last, and who soars stays in them.
    """
    model = fit.model
    theta, side, up = across(fit, _balanced(model, fit.theta))
    lift, slip = model.indices(Lift.name), side_places(model)
    rows = {model.axes.index(SIDE): side, model.axes.index(UP): up}
    told = {model.axes.index(SIDE): slip, model.axes.index(UP): lift}
    found = _summed(fit, theta, rows, told, NONE)
    lean = np.zeros((len(theta), 1))
    constant = up.regressors[:, lift[0]]
    # Risen air is another angle, and that times the slope another lift at no angle.
    speed = float(np.median(np.linalg.norm(model.air(theta).u_b, axis=1)))
    risen = constant * float(theta[lift[1]]) * lasting / max(speed, 1.0)
    lean[lift, 0] = up.regressors[:, lift].T @ risen
    return Felt(found, (*lift, *slip), lean, ahead=False)


def _told_ahead(model: ForceModel) -> list[int]:
    """Unknowns that the force ahead is to tell."""
    out: list[int] = []
    at = 0
    for effect in model.effects:
        bent = isinstance(effect, Beyond) and effect.law.axes == (AHEAD,)
        bent = bent or isinstance(getattr(effect, "each", effect), GustLift)
        if bent or isinstance(effect, Drag | SlipDrag | Propulsion | PropellerInflow):
            out += range(at, at + len(effect.unknowns))
        at += len(effect.unknowns)
    return [*out, model.index("offset_x")]


def _balanced(model: ForceModel, theta: Array) -> Array:
    """The unknowns with the nominal slope of the lift, and its mean as the mean force has it."""
    out = theta.copy()
    places = model.indices(Lift.name)
    out[places] = model.nominal[places]
    for _ in range(3):
        up = model.axes.index(UP)
        short = float(np.mean((model.measured() - model.predicted(out))[:, up]))
        slope = float(np.mean(model.jacobian(out).of(places[:1])[:, up]))
        out[places[0]] += short / slope
    return out


def _rows(model: ForceModel, theta: Array) -> Rows:
    """The force ahead without gusts, at unknowns (m,)."""
    here = model.predicted(theta)
    residual = model.measured() - here
    u_b = model.air(theta).u_b
    ahead = u_b / np.maximum(np.linalg.norm(u_b, axis=1), 1.0)[:, None]
    steady = _steadied(model, theta, residual[:, UP])
    by_flow = (model.predicted(theta, GUST * _north(model, ahead)) - here) / GUST
    up = GUST * model.flight.R_bn[:, UP]
    slopes = (model.predicted(theta, up) - here) / GUST
    # The mean of the slopes at both angles is the difference of the force between them.
    slopes = 0.5 * (slopes + (steady.predicted(theta, up) - steady.predicted(theta)) / GUST)
    along = by_flow / by_flow[:, SENSED, None]
    across = slopes[:, AHEAD] / slopes[:, UP]

    def apart(x: Array) -> Array:
        shape = (len(x), *(1,) * (x.ndim - 2))
        still = [x[:, k] - along[:, k].reshape(shape) * x[:, SENSED] for k in (AHEAD, UP)]
        out: Array = still[0] - across.reshape(shape) * still[1]
        return out

    windows = windows_of(model.flight)
    left, columns = windows.mean(apart(residual)), windows.mean(apart(steady.jacobian(theta).whole))
    return whitened_axis(left, columns, windows)


def _north(model: ForceModel, x_b: Array) -> Array:
    """(n, 3) north, east and down of vectors in body axes."""
    out: Array = np.einsum("nij,ni->nj", model.flight.R_bn, x_b)
    return out


def _steadied(model: ForceModel, theta: Array, missing: Array) -> ForceModel:
    """The same flight at the angles of attack that its measured lift needs."""
    flight, u_b = model.flight, model.air(theta).u_b
    up = GUST * flight.R_bn[:, UP]
    slope = (model.predicted(theta, up) - model.predicted(theta))[:, UP] / GUST
    speed = np.hypot(u_b[:, 0], u_b[:, 2])
    angle = np.arctan2(u_b[:, 2], u_b[:, 0]) - missing / (slope * speed)
    v_b = flight.v_b.copy()
    v_b[:, 0] += speed * np.cos(angle) - u_b[:, 0]
    v_b[:, 2] += speed * np.sin(angle) - u_b[:, 2]
    return replace(model, flight=replace(flight, v_b=v_b))


def _lean(fit: Fit, theta: Array, ahead: Rows, mine: Sequence[int]) -> Array:
    """(m, l) scores by a standard deviation of the lift's slope, of the wind, of the airspeed."""
    model = fit.model
    constant, slope = model.indices(Lift.name)
    others = [*model.indices(Wind.name), *model.indices(AirspeedScale.name)]
    known = np.linalg.cholesky(fit.covariance[np.ix_(others, others)])
    made = [ahead.regressors[:, others] @ known]
    # Another slope comes with another constant: the mean lift is what it is.
    angle = float(np.mean(model.air(theta).alpha))
    tilted = ahead.regressors[:, slope] - angle * ahead.regressors[:, constant]
    made.append(model.plausible[slope] * tilted[:, None])
    out = np.zeros((len(theta), len(others) + 1))
    out[list(mine)] = ahead.regressors[:, list(mine)].T @ np.hstack(made)
    return out


def _summed(
    fit: Fit, theta: Array, rows: Mapping[int, Rows], mine: Mapping[int, Sequence[int]], only: int
) -> Fit:
    """Sums of all axes, some by these rows: what is an axis's own is told by it alone.

    The place ``only`` tells nothing else, either: gusts are taken out of it by what others say.
    """
    model, m = fit.model, len(theta)
    residual = model.measured() - model.predicted(theta)
    jacobian = model.jacobian(theta)
    sensitivity = model.sensitivity(theta)
    windows = windows_of(model.flight)
    noise = tuple(rows[k].noise if k in rows else its for k, its in enumerate(fit.noise))
    every = whitened_rows(model, residual, jacobian, noise, sensitivity)
    for k, its in rows.items():
        every[k] = np.column_stack([its.left, its.regressors])
    for k, axis in enumerate(every):
        others = [place for at, places in mine.items() if at != k for place in places]
        axis[:, [1 + place for place in others]] = 0.0
        if k == only:
            own = np.isin(np.arange(m), mine[k])
            axis[:, 1:] = np.where(own, axis[:, 1:], 0.0)
    of_row, part = fit.block[windows.first], model.flight.part[windows.first]
    sums = []
    for number in np.unique(of_row):
        here = of_row == number
        block = np.concatenate([r[here] for r in every])
        y, h = block[:, 0], block[:, 1:]
        of = int(part[here][0])
        sums.append(BlockSums(h.T @ h, h.T @ y, float(y @ y), len(y), np.arange(m), of))
    # What is told by these rows is freed from errors of the angles in another way, and how it leans
    # on wind and airspeed is said beside it.
    information = total(sums, m)[0] + np.diag(fit.prior)
    moved = np.linalg.solve(information, fit.considered)
    freed = {place for places in mine.values() for place in places}
    moved[sorted(freed | {*model.indices(Lift.name), *side_places(model)})] = 0.0
    considered, held = information @ moved, theta <= model.least
    inflation, scale = inflation_of(sums, fit.prior, held, considered, settled=False)
    return replace(
        fit,
        theta=theta,
        blocks=tuple(sums),
        inflation=inflation,
        considered=considered,
        scale=scale,
        noise=noise,
        residual=residual,
        jacobian=jacobian,
        sensitivity=sensitivity,
    )
