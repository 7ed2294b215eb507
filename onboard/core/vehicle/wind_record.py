"""The wind of a flight, and how it went over time."""

from __future__ import annotations

import math

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.effects.own import Own
from onboard.core.vehicle.effects.rising_air import RISING
from onboard.core.vehicle.effects.wind_change import WindChange
from onboard.core.vehicle.effects.wind_height import WindByHeight
from onboard.core.vehicle.effects.wind_profile import WindProfile
from onboard.core.vehicle.limits import APART
from onboard.core.vehicle.matching import Matched
from onboard.core.vehicle.noise import rms
from onboard.core.vehicle.records import WindEstimate


def changing(m: Matched) -> Array | None:
    """(n, 2) wind towards north and east at each step, m/s; None where it is one for all."""
    change = next((e for e in m.model.effects if isinstance(e, WindChange)), None)
    if change is None:
        return None
    mean = m.fit.theta[m.model.indices("wind")]
    first = m.model.index(change.unknowns[0].name)
    values = m.fit.theta[first : first + len(change.unknowns)].tolist()
    out: Array = mean + change.wind(m.model.flight, values)
    return out


def change_sentence(m: Matched) -> str:
    """What a person is told of a wind that became another; empty where it did not."""
    wind = changing(m)
    if wind is None:
        return ""
    (north, east), (n, e) = wind[0].tolist(), wind[-1].tolist()
    return (
        f"the wind became another: towards north and east from {north:.1f} and {east:.1f} m/s to "
        f"{n:.1f} and {e:.1f}; its mean is told, and no setting makes it"
    )


def height_sentence(m: Matched) -> str:
    """What a person is told of a wind that is another one higher up; empty where it is not."""
    by_height = next((e for e in m.model.effects if isinstance(e, WindByHeight)), None)
    if by_height is None:
        return ""
    first = m.model.index(by_height.unknowns[0].name)
    north, east = (100.0 * m.fit.theta[first : first + 2]).tolist()
    return (
        f"the wind is another one higher up: by {north:.1f} and {east:.1f} m/s towards north and "
        f"east in 100 m; that at the mean height is told, and no setting makes the rest"
    )


def rising_sentence(m: Matched) -> str:
    """What a person is told of air that surely rose or sank in the mean of the first flight."""
    if RISING not in {u.name for u in m.model.unknowns}:
        return ""
    k = m.model.index(RISING)
    up, sigma = float(m.fit.theta[k]), float(m.fit.sigma[k])
    if abs(up) < m.model.unknowns[k].floor + APART * sigma:
        return ""
    rose = "rose" if up > 0.0 else "sank"
    return f"the air {rose} by {abs(up):.1f} m/s in the mean of the flight"


def wind_of(m: Matched, number: int = 0) -> WindEstimate:
    """The wind of one of the recordings, whether it was found to matter or not."""
    fit, flight = m.fit, m.model.flight
    its = flight.part == number
    places = m.model.indices("wind")[2 * number : 2 * number + 2]
    measured = np.zeros(2)
    if flight.measured_wind.shape[1]:
        measured = np.mean(np.nan_to_num(flight.measured_wind[its, :2]), axis=0)
    north, east = (fit.theta[places] + measured).tolist()
    sigmas = fit.sigma[places].tolist()
    exponent = None
    factor = np.ones(len(flight))
    if "wind_profile" in m.chosen.effects:
        k = m.model.indices("wind_profile")[number]
        exponent = float(fit.theta[k])
        profile = m.model.effect("wind_profile")
        law_of = profile.each if isinstance(profile, Own) else profile
        if isinstance(law_of, WindProfile):
            factor = law_of.factor(m.model.start(flight), exponent)
    numbers, since = np.unique(fit.block), flight.since_start
    changed = changing(m)
    series, spread, when, heights, ekf, law = [], [], [], [], [], []
    for block, block_number in zip(fit.blocks, numbers, strict=True):
        mine = fit.block == block_number
        if not its[mine].all():
            continue
        information, score = block.of(places)
        if np.linalg.cond(information) > 1e8:
            continue
        covariance = np.linalg.inv(information) * fit.scale
        here = float(np.mean(factor[mine]))  # the unknown is the wind at the mean height
        found = measured + fit.theta[places] + np.linalg.solve(information, score)
        series.append(here * found)
        spread.append(here * np.sqrt(np.diag(covariance)))
        law.append(here * (measured + fit.theta[places]))
        when.append(float(np.mean(since[mine])))
        heights.append(float(np.mean(flight.height[mine]) - flight.ground))
        if changed is not None:
            beside = np.mean(changed[mine], axis=0) - fit.theta[places]
            series[-1], law[-1] = series[-1] + beside, law[-1] + beside
        has = flight.ekf_wind.shape[1] == 2
        ekf.append(np.mean(flight.ekf_wind[mine], axis=0) if has else np.full(2, np.nan))
    return WindEstimate(
        north,
        east,
        sigmas[0],
        sigmas[1],
        float(np.mean(flight.height[its])) - flight.ground,
        exponent,
        m.turbulence.rms if m.turbulence.found else None,
        np.array(when),
        np.array(heights),
        np.array(series).reshape(-1, 2),
        np.array(spread).reshape(-1, 2),
        np.array(ekf).reshape(-1, 2),
        np.array(law).reshape(-1, 2),
        0.0 if changed is None else math.sqrt(2.0) * rms(changed - np.mean(changed, axis=0)),
    )
