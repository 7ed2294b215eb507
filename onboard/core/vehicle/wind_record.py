"""The wind of a flight, and how it went over time."""

from __future__ import annotations

import numpy as np

from onboard.core.vehicle.effects.wind_profile import WindProfile
from onboard.core.vehicle.matching import Matched
from onboard.core.vehicle.records import WindEstimate


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
        profile = m.model.effect("wind_profile")
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
        m.turbulence.rms if m.turbulence.found else None,
        np.array(when),
        np.array(heights),
        np.array(series).reshape(-1, 2),
        np.array(spread).reshape(-1, 2),
        np.array(ekf).reshape(-1, 2),
        np.array(law).reshape(-1, 2),
    )
