"""How much the air moved in a flight, as the noise of its forces shows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.chi_square import survival
from onboard.core.vehicle.effects.airspeed_scale import AirspeedScale
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.limits import (
    APART,
    FALSE_ALARM,
    RECEIVER_M_S,
    SENSED_GUST_M_S,
    SURE,
    UNCLEAR_M_S,
)
from onboard.core.vehicle.model import DIFFERENCE
from onboard.core.vehicle.noise import (
    AxisNoise,
    fitted_noise,
    gust_evidence,
    likelihood,
    rms,
)
from onboard.core.vehicle.windows import windows_of

SLIP = "c_y_b"
"""Unknown by which sideslip makes a side force."""
TINY = 1e-12
"""Of a square of a sensitivity, 1/s^2: no drag at all [physics]."""


@dataclass(frozen=True, slots=True)
class Turbulence:
    """Gusts along an axis.

    Attributes:
        rms: of those that the noise shows, slower than the steps, m/s.
        sigma: of it, as the air's: a flight meets some gusts, not all.
        evidence: twice the log-likelihood that it adds.
        floor: what other things than gusts look like, m/s.
        errors: of the recording's own velocity, m/s.
        whole: RMS by what all gusts, fast ones too, do to the mean of the drag, m/s; None where
            that is not known.
        whole_sigma: of it.
        by_law: sigma of the gusts by that of the drag or side force that shows them, m/s: of how
            large they are, and not of whether there are any.
    """

    rms: float
    sigma: float
    evidence: float
    floor: float
    errors: float
    whole: float | None = None
    whole_sigma: float = math.nan
    by_law: float = 0.0

    @property
    def largest(self) -> float:
        """RMS of the gusts that are named, m/s, as large as they may be; none where none are."""
        if not self.found:
            return 0.0
        slow = self.rms + SURE * self.sigma
        return slow if self.whole is None else max(slow, self.whole + SURE * self.whole_sigma)

    @property
    def seen(self) -> bool:
        """Whether it is more than chance."""
        return survival(self.evidence, 1) < FALSE_ALARM

    @property
    def answered(self) -> bool:
        """Whether there is surely something that an autopilot answers.

        Of gusts too small to be named the answers bend what is told by as many of its sigmas.
        """
        more = self.seen and self.rms > APART * self.errors + SURE * self.sigma
        return self.found or more

    @property
    def found(self) -> bool:
        """Whether it is more than chance, and than errors of the velocity look like."""
        return self.seen and self.rms > self.floor + SURE * self.sigma


def turbulence_of(fit: Fit) -> Turbulence:
    """Gusts by how the lateral noise grows with the sensitivity to them.

    An airspeed sensor shows those along the flow directly: a plane's angles follow the gusts, so
    that its forces hide them.
    """
    if AirspeedScale.name in {e.name for e in fit.model.effects}:
        return _felt(fit)
    gust, sigma, evidence = _pushed(fit)
    errors = fit.model.flight.velocity_sigma
    # At a plane's speed what a heading is off by is an error of the velocity across it, too.
    copter = "rotor_drag" in {e.name for e in fit.model.effects}
    floor = math.hypot(RECEIVER_M_S if copter else UNCLEAR_M_S, errors)
    if any(u.name == "faster_gusts" for u in fit.model.unknowns):
        k = fit.model.index("faster_gusts")
        more, spread = float(fit.theta[k]), float(fit.sigma[k])
        if more > SURE * spread:
            whole = gust * math.exp(more)
            by_law = gust * _drag_doubt(fit)
            return Turbulence(
                gust, sigma, evidence, floor, errors, whole, whole * spread, by_law=by_law
            )
    doubt = _drag_doubt(fit) if copter else _side_doubt(fit)
    return Turbulence(gust, sigma, evidence, floor, errors, by_law=gust * doubt)


def _side_doubt(fit: Fit) -> float:
    """Sigma of a side force by sideslip, as a share of it: at most that before the flight."""
    names = [u.name for u in fit.model.unknowns]
    if SLIP not in names:
        return 0.0
    k = names.index(SLIP)
    known = min(float(fit.sigma[k]), fit.model.unknowns[k].plausible)
    return known / max(abs(float(fit.theta[k])), TINY)


def _pushed(fit: Fit) -> tuple[float, float, float]:
    """RMS of gusts by what they do sideways, its sigma, m/s, and the evidence of them.

    What of the coloured noise does not grow with the sensitivity is another thing, or gusts all the
    same, by a drag that is not quite the model's: each share of it is as likely.
    """
    model = fit.model
    lateral = (0, 1) if "rotor_drag" in {e.name for e in model.effects} else (1,)
    axes = [k for k, axis in enumerate(model.axes) if axis in lateral]
    if not axes:
        return 0.0, 0.0, 0.0
    sensitivity, gust = fit.sensitivity, 0.0
    for _ in range(2):
        each = np.array([_sideways(fit, k, sensitivity[:, k]) for k in axes])
        grown, whole = np.sqrt(each[:, :2].mean(axis=0)).tolist()
        gust = 0.5 * (grown + max(grown, whole))
        # What gusts of this size do, now that it is known.
        sensitivity = model.sensitivity_to(fit.theta, max(gust, RECEIVER_M_S))
    count, evidence = each[:, 2:].sum(axis=0).tolist()
    sigma = math.hypot(gust / math.sqrt(2.0 * count), (gust - grown) / math.sqrt(3.0))
    return gust, sigma, evidence


def _drag_doubt(fit: Fit) -> float:
    """Sigma of the drag that shows a copter's gusts, as a share of it.

    A force that is told to be of so much less drag is of so much more wind.
    """
    model = fit.model
    places = [*model.indices("rotor_drag"), *model.indices("body_drag")]
    if not places:
        return 0.0
    lateral = [k for k, axis in enumerate(model.axes) if axis in (0, 1)]
    here = rms(model.sensitivity(fit.theta)[:, lateral])
    slopes = []
    for k in places:
        step = fit.theta.copy()
        step[k] += DIFFERENCE * model.plausible[k]
        there = rms(model.sensitivity(step)[:, lateral])
        slopes.append((there - here) / (DIFFERENCE * model.plausible[k]))
    by, inside = np.array(slopes), fit.covariance[np.ix_(places, places)]
    return math.sqrt(max(float(by @ inside @ by), 0.0)) / max(here, math.sqrt(TINY))


def _sideways(fit: Fit, k: int, sensitivity: Array) -> tuple[float, float, float, float]:
    """Of axis k: squares of gusts, m^2/s^2, how many there were, and their evidence.

    Squares are by what grows with the ``sensitivity`` (n,), 1/s, and by all coloured noise.
    """
    flight = fit.model.flight
    data = fit.residual[:, k], sensitivity, flight.piece, flight.step_s
    noise = fitted_noise(*data, gusts=True)
    memory = noise.correlation_s * (1.0 - noise.white) + flight.step_s
    count = len(flight) * flight.step_s / (2.0 * memory)
    whole = (1.0 - noise.white) * rms(fit.residual[:, k]) ** 2 / max(rms(sensitivity) ** 2, TINY)
    return noise.gust**2, whole, count, gust_evidence(*data, noise)[0]


def _felt(fit: Fit) -> Turbulence:
    """Gusts by what the airspeed sensor reads beyond the model, as far as it is no white noise.

    Whether white noise is the sensor's or that of faster gusts nobody knows.
    """
    k, flight = len(fit.model.axes) - 1, fit.model.flight
    windows = windows_of(flight)
    residual = windows.mean(fit.residual[:, k])
    noise = fitted_noise(residual, np.ones(len(residual)), windows.piece, windows.length_s)
    data = residual, windows.piece, windows.length_s
    evidence = 2.0 * (likelihood(*data, noise) - likelihood(*data, AxisNoise(rms(residual))))
    scale = float(fit.theta[fit.model.indices(AirspeedScale.name)[0]])
    coloured = rms(residual) * math.sqrt(1.0 - noise.white)
    gust = coloured / (_kept(windows.length_s / noise.correlation_s) * max(abs(scale), 0.1))
    memory = 2.0 * (noise.correlation_s + windows.length_s)
    sigma = gust / math.sqrt(2.0 * max(len(flight) * flight.step_s / memory, 1.0))
    # What is read beyond the model is of the model's velocity, too.
    floor = math.hypot(SENSED_GUST_M_S, flight.velocity_sigma)
    return Turbulence(gust, sigma, evidence, floor, flight.velocity_sigma)


def _kept(x: float) -> float:
    """Share of the RMS of a Gauss-Markov process that its means over x correlation times have."""
    return math.sqrt(2.0 / x * (1.0 - (1.0 - math.exp(-x)) / x))
