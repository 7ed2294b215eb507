"""How much the air moved in a flight, as the noise of its forces shows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.chi_square import survival
from onboard.core.vehicle.effects.airspeed_scale import AirspeedScale
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.limits import (
    FALSE_ALARM,
    SENSED_GUST_M_S,
    SURE,
    TURBULENCE_FLOOR_M_S,
)
from onboard.core.vehicle.noise import (
    AxisNoise,
    fitted_noise,
    gust_evidence,
    likelihood,
    rms,
)
from onboard.core.vehicle.windows import windows_of


@dataclass(frozen=True, slots=True)
class Turbulence:
    """Gusts along an axis.

    Attributes:
        rms: of those that the noise shows, slower than the steps, m/s.
        sigma: of it, as the air's: a flight meets some gusts, not all.
        evidence: twice the log-likelihood that it adds.
        whole: RMS by what all gusts, fast ones too, do to the mean of the drag, m/s; None where
            that is not known.
        whole_sigma: of it.
        floor: what other things than gusts look like, m/s.
    """

    rms: float
    sigma: float
    evidence: float
    whole: float | None = None
    whole_sigma: float = math.nan
    floor: float = TURBULENCE_FLOOR_M_S

    @property
    def seen(self) -> bool:
        """Whether it is more than chance."""
        return survival(self.evidence, 1) < FALSE_ALARM

    @property
    def found(self) -> bool:
        """Whether it is more than chance, and than errors of the velocity look like."""
        return self.seen and self.rms > self.floor + SURE * self.sigma


def turbulence_of(fit: Fit) -> Turbulence:
    """Gusts by how the lateral noise grows with the sensitivity to them.

    An airspeed sensor shows those along the flow directly: a plane's angles follow the gusts, so
    that its forces hide them.
    """
    flight = fit.model.flight
    if AirspeedScale.name in {e.name for e in fit.model.effects}:
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
    if any(u.name == "gust_variance" for u in fit.model.unknowns):
        k = fit.model.index("gust_variance")
        variance, spread = float(fit.theta[k]), float(fit.sigma[k])
        if variance > max(SURE * spread, gust**2):
            whole = math.sqrt(variance)
            return Turbulence(gust, sigma, evidence, whole, spread / (2.0 * whole))
    return Turbulence(gust, sigma, evidence)


def _felt(fit: Fit) -> Turbulence:
    """Gusts by what the airspeed sensor reads beyond the model, as far as it is no white noise."""
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
    return Turbulence(gust, sigma, evidence, gust, sigma, SENSED_GUST_M_S)


def _kept(x: float) -> float:
    """Share of the RMS of a Gauss-Markov process that its means over x correlation times have."""
    return math.sqrt(2.0 / x * (1.0 - (1.0 - math.exp(-x)) / x))
