"""The model of an ordinary flight, and how its linearisation follows what was found."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from onboard.core.estimate.limits import (
    ATTITUDE_DELAY_RANGE_S,
    BEYOND,
    HEADING_RANGE_RAD,
    SHAPE_RANGE,
    SHORTER,
    TILT_RANGE_RAD,
)
from onboard.core.estimate.observability import Needs
from onboard.core.inputs.limits import DELAY_RANGE_S
from onboard.core.inputs.reach import FAR, reach_of
from onboard.core.maths.arrays import Array, vector2, vector3, vector4
from onboard.core.maths.bounded import bounded
from onboard.core.model.ekf_sensors import EkfSensors
from onboard.core.model.gyro_scale import GyroScale
from onboard.core.model.linearisation import MOVING, SHAPES, Linearisation
from onboard.core.model.nuisances import (
    AttitudeOffset,
    GpsLatency,
    GpsSmoothing,
    GyroTiming,
    HeightLatency,
    ImuDelay,
    LeverArmError,
    Six,
)
from onboard.core.model.regressors import Family, Model

NOMINAL = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
"""Scale (1) and beta (m/s^2) of an accelerometer of which nothing is known."""


def calibration_model(
    point: Linearisation,
    prior: Array | None = None,
    needs: Needs | None = None,
    more: tuple[Family, ...] = (),
) -> Model:
    """Calibration parameters, timing and nuisances about ``point``.

    Args:
        point: linearisation.
        prior: (6,) scale (1) and beta (m/s^2), sensor axes; None: nothing is known.
        needs: prior sigmas of them.
        more: other physics; a nuisance gives way to what is there instead of it.
    """
    needs = needs or Needs()
    centre = np.array(NOMINAL) if prior is None else prior
    always: tuple[Family, ...] = (
        Six(centre[:3], centre[3:], needs.prior_scale, needs.prior_offset),
        GpsLatency(point.delay),
        GpsSmoothing(point.window, shapes=point.shapes),
        ImuDelay(point.attitude_delay),
        HeightLatency(),
        GyroTiming(),
        GyroScale(),
        EkfSensors(needs.prior_scale, needs.prior_offset),
        AttitudeOffset(point.heading, point.tilt),
        LeverArmError(),
    )
    gone = {f.instead_of for f in more}
    return Model([*(f for f in always if f.name not in gone), *more])


def possible(
    point: Linearisation,
    model: Model,
    estimate: tuple[Array, Array],
    wanders: float = 0.0,
    *,
    apart: float = 0.0,
) -> Array:
    """The likeliest unknowns with which the linearisation stays within what is possible.

    Args:
        point: the linearisation that the estimate is about.
        model: its model.
        estimate: (m,) unknowns, and (m, m) covariance.
        wanders: variance of the mean of what the heading is off by for a while, rad^2.
        apart: from one fix to the next, s.
    """
    reach = reach_of(apart)
    low, high = np.full(model.size, -math.inf), np.full(model.size, math.inf)
    ranges = (
        (point.delay, *DELAY_RANGE_S),
        (point.window**2, 0.0, reach.longest_window**2),
        (point.attitude_delay, *ATTITUDE_DELAY_RANGE_S),
        (point.heading, *HEADING_RANGE_RAD),
        *((angle, *TILT_RANGE_RAD) for angle in point.tilt),
        *zip(
            point.shapes, *(SHAPE_RANGE if FAR.tells(apart) else 2 * (point.shapes,)), strict=True
        ),
    )
    for name, (now, least, most) in zip(MOVING, ranges, strict=True):
        low[model.index[name]], high[model.index[name]] = least - now, most - now
    theta = _with_all_of_the_heading(point, model, estimate, wanders)
    return bounded(theta, estimate[1], low, high)


def _with_all_of_the_heading(
    point: Linearisation, model: Model, estimate: tuple[Array, Array], wanders: float
) -> Array:
    """Unknowns with all that the heading is off by in the mean, which is where it is linear.

    A heading that is wrong all the time and one that is for a while enter alike, and share what a
    flight shows as their variances are: the number gets little of it beside a level that has room
    for anything.  Both together are off by no more than the number may be, beforehand: a level is
    room that a search has made, and where a flight does not tell a heading it is no reason to go
    anywhere.

    Args:
        point: the linearisation that the estimate is about.
        model: its model.
        estimate: (m,) unknowns, and (m, m) covariance.
        wanders: variance of the mean of what wanders, rad^2.
    """
    i, out = model.index["heading"], estimate[0].copy()
    prior, known = model.prior_sigma[i] ** 2, 1.0 / estimate[1][i, i]
    seen = known - 1.0 / prior  # of the number, all else unknown, without its prior
    if seen > 0.0:
        noise = max(1.0 / seen - wanders, 0.0)
        out[i] += (point.heading + out[i]) * wanders / (prior + noise)
    return out


def moved(point: Linearisation, model: Model, theta: Array) -> Linearisation:
    """The linearisation that a solution asks for, inside the range of what is possible.

    Args:
        point: the linearisation that the solution is about.
        model: its model.
        theta: (m,) its unknowns.
    """
    i = model.index
    square = point.window**2 + theta[i["window_squared"]]
    return Linearisation(
        scale=vector3(theta[0:3]),
        beta=vector3(theta[3:6]),
        delay=float(np.clip(point.delay + theta[i["gps_delay"]], *DELAY_RANGE_S)),
        window=float(np.clip(np.sqrt(max(0.0, square)), 0.0, FAR.longest_window)),
        attitude_delay=float(
            np.clip(point.attitude_delay + theta[i["attitude_delay"]], *ATTITUDE_DELAY_RANGE_S)
        ),
        heading=float(np.clip(point.heading + theta[i["heading"]], *HEADING_RANGE_RAD)),
        tilt=vector2(
            np.clip(point.tilt + theta[[i["tilt_roll"], i["tilt_pitch"]]], *TILT_RANGE_RAD)
        ),
        antenna=vector3(theta[antenna_of(model)]),
        skew=point.skew + (float(theta[i["clock_rate"]]) if "clock_rate" in i else 0.0),
        skew_from=point.skew_from,
        shapes=vector4(np.clip(point.shapes + theta[[i[n] for n in SHAPES]], *SHAPE_RANGE)),
    )


def least_square(step: float) -> float:
    """The least that the square of a receiver's span can be, s^2: it averages, or does not.

    A span is told against that of the force.  What is read may be the mean over the ``step`` to the
    next sample, s.  An autopilot's low-pass before it takes ``w^2 / (s^2 + 2 zeta w s + w^2)`` of
    the force: a delay, and the variance ``(4 zeta^2 - 2) / w^2``, which is nil for its damping of
    ``1 / sqrt(2)`` at any frequency (INS_ACCEL_FILTER).
    """
    return -(step**2)


def beyond_range(
    point: Linearisation,
    model: Model,
    theta: Array,
    covariance: Array,
    *,
    apart: float = 0.0,
    step: float = math.inf,
) -> list[str]:
    """What would have to be further off than it is looked for, by :data:`BEYOND` of its sigmas.

    Its clipped value is then none that the flight asks for, and everything else makes up for it.
    Where the shape of the receiver's averaging is not followed, an even mean stands for it, and
    that only as long as all of it is within what is looked around a fix: it has to be shorter, by
    :data:`SHORTER` sigmas.

    Args:
        point: the linearisation that the estimate is about.
        model: its model.
        theta: (m,) estimate.
        covariance: (m, m) of it.
        apart: from one fix to the next, s; where fixes have no neighbours within what is looked
            around them, the shape of the receiver's averaging is not followed.
        step: between inertial samples, s; infinite where nobody knows it any more.

    Returns:
        In words; empty if all is where the flight wants it.
    """
    reach = reach_of(apart)
    ranges = (
        ("the latency of GPS", "gps_delay", point.delay, DELAY_RANGE_S),
        (
            "the receiver's averaging",
            "window_squared",
            point.window**2,
            (least_square(step), reach.longest_window**2),
        ),
        (
            "the lateness of the attitude",
            "attitude_delay",
            point.attitude_delay,
            ATTITUDE_DELAY_RANGE_S,
        ),
        ("the error of the heading", "heading", point.heading, HEADING_RANGE_RAD),
    )
    free = {name for family in model.families for name in family.goes_below}
    out = []
    for words, name, taken, (least, high) in ranges:
        low = -math.inf if name in free else least
        i = model.index[name]
        asked, sigma = taken + theta[i], math.sqrt(covariance[i, i])
        longer = name == "window_squared" and asked + SHORTER * sigma > reach.around**2
        if asked < low - BEYOND * sigma or asked > high + BEYOND * sigma:
            out.append(f"{words} would have to be further off than can be told")
        elif longer and not FAR.tells(apart):
            out.append(f"so few fixes may be averages over more than {reach.around:.1f} s")
    return out + [
        f"{name} would have to be the other way round than it can be"
        for name in reversed_of(model, model.families, theta, covariance)
    ]


def reversed_of(
    model: Model, families: Sequence[Family], theta: Array, covariance: Array
) -> list[str]:
    """Names of families of which an unknown that cannot be negative surely is.

    Args:
        model: has the families.
        families: that are asked for.
        theta: (m,) estimate.
        covariance: (m, m) of it.
    """
    sigma = np.sqrt(np.diag(covariance))
    out = []
    for family in families:
        index = [model.index[name] for name in family.never_negative]
        if np.any(theta[index] < -BEYOND * sigma[index]):
            out.append(family.name)
    return out


def antenna_of(model: Model) -> slice:
    """Unknowns of the antenna's place: a nuisance of centimetres, or the effect instead of it."""
    place = LeverArmError.name
    name = next(f.name for f in model.families if place in (f.name, f.instead_of))
    return model.slices[name]
