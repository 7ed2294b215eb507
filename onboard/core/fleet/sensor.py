"""The six numbers of one accelerometer over its flights: each as a series, and all of them merged.

A flight's answer leans on what was in force before it.  For its place in a series that is taken
out: the flight is solved again with a prior :data:`~onboard.core.fleet.limits.WIDE` times as wide,
and a number counts where the flight alone knows it to half of the usual prior's sigma.  Sigmas are
those with its gyroscope (:func:`onboard.core.estimate.calibration_record.gyro_sigma`): the
gyroscope's part is the same in all flights of a vehicle and neither a drift nor a step.

Merged are the flights after the last step of any of the six, as several recordings are
(:mod:`onboard.core.diagnosis.joined`), none of those that are odd, and nothing at all where a
number drifts: of that there is no mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.diagnosis.joined import WHO, Heard, joined
from onboard.core.diagnosis.undecided import in_words, left_open
from onboard.core.estimate.joint import FLOOR
from onboard.core.estimate.limits import PRIOR_SHARE
from onboard.core.estimate.merged_flights import FlightSix, Normal, Prior
from onboard.core.fleet.limits import WIDE
from onboard.core.maths.accelerometer import SixParameters, parameters_jacobian, parameters_of
from onboard.core.maths.arrays import Array, vector3


@dataclass(frozen=True, slots=True)
class Alone:
    """What a flight says without any prior: (6,) scale (1) and offset (m/s^2), and sigmas.

    NaN where the flight does not know the number by itself.
    """

    value: Array
    sigma: Array


@dataclass(frozen=True, slots=True)
class Together:
    """Flights merged.

    Attributes:
        value: (6,) scale (1) and offset (m/s^2).
        sigma: (6,) of them, with the gyroscope's part and what all flights leave open.
        counted: indices of the flights in it.
        contradicted: indices of flights that contradict the others.
        inflation: factor on the variance of all flights, for their scatter.
        open_sigma: (6,) the part of ``sigma`` that is of effects which no flight shows by itself.
        open: those of them that most of the sigma of a number is about, in words.
    """

    value: Array
    sigma: Array
    counted: tuple[int, ...]
    contradicted: tuple[int, ...]
    inflation: float
    open_sigma: Array
    open: str = ""


def alone(flight: FlightSix, prior: Prior) -> Alone:
    """One flight's own values.

    Args:
        flight: what it says, with the floors.
        prior: of any sensor, about what was in force.
    """
    unit, said = prior.sigma, _in_units(flight, prior)
    usual, wide = (
        prior.center + unit * np.linalg.solve(said.N + np.eye(6) / width**2, said.b)
        for width in (1.0, WIDE)
    )
    # An offset is beta over a scale: not over one that nobody knows, which may be near nothing.
    J = parameters_jacobian(usual)
    covariance = np.linalg.inv(said.N + np.eye(6) / WIDE**2) * np.outer(unit, unit)
    value = parameters_of(usual) + J @ (wide - usual)
    sigma = np.sqrt(np.maximum(np.diag(J @ covariance @ J.T), 0.0))
    known = np.isfinite(value) & (sigma > 0.0) & (sigma < PRIOR_SHARE * unit)
    return Alone(np.where(known, value, np.nan), np.where(known, sigma, np.nan))


def together(flights: Sequence[Heard], prior: Prior, gyro_sigma: Array) -> Together | None:
    """Flights merged; None if nobody can say which are right.

    Args:
        flights: of one accelerometer, in order, at least one.
        prior: of any sensor, about what was in force last.
        gyro_sigma: (6,) what the gyroscope's axes put into the six.
    """
    made = joined(flights, prior)
    if (found := made.merged) is None:
        return None
    J = parameters_jacobian(found.estimate)
    P = J @ found.covariance @ J.T + np.diag(FLOOR**2 + gyro_sigma**2)
    value = parameters_of(found.estimate)
    claimed, six = np.diag(P), SixParameters(vector3(value[:3]), vector3(value[3:]))
    return Together(
        value,
        np.sqrt(claimed),
        made.found.counted,
        made.found.contradicted,
        found.inflation,
        np.sqrt(np.diag(J @ left_open(made.open) @ J.T)),
        in_words(made.open, six, claimed, WHO),
    )


def _in_units(f: FlightSix, prior: Prior) -> Normal:
    b = f.floored_vector - f.floored @ prior.center
    return Normal(f.floored * np.outer(prior.sigma, prior.sigma), b * prior.sigma)
