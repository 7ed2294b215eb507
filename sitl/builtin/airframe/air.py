"""The air that a vehicle flies in: its density over height, and the wind with all that it does.

Wind is given as ArduPilot's SITL takes it (SIM_WIND_SPD, SIM_WIND_DIR *from* which it blows,
SIM_WIND_T for the profile) and kept as a vector of where the air goes to.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from sitl.builtin.smoothing import DT, RATE, Array, moving_average, smooth

SEA_LEVEL_DENSITY = 1.225
SEA_LEVEL_TEMPERATURE = 288.15
LAPSE = 0.0065
GAS_CONSTANT = 287.05287
EARTH_RADIUS = 6_356_766.0
"""The standard atmosphere's own, m."""
GRAVITY = 9.80665
PROFILE_HEIGHT = 60.0
"""Above it the wind is what it is told to be, m; SIM_WIND_T_ALT's default."""
SQUARE_ROOT = 0.5
"""Exponent of ArduPilot's default profile, SIM_WIND_T 0."""
GUST_SMOOTHING_S = (0.1, 0.07, 0.05, 0.03)
"""A vehicle feels the mean over its own size: keeps what a gust does to its attitude finite."""
UPWARDS = 0.5
"""Near the ground air moves less up and down than to and fro."""
EDGE_S = (0.4, 0.25, 0.15)


def density(altitude: Array) -> Array:
    """Air density of the standard atmosphere at altitudes over sea level (m, below 11 km)."""
    geopotential = EARTH_RADIUS * altitude / (EARTH_RADIUS + altitude)
    ratio = 1.0 - LAPSE * geopotential / SEA_LEVEL_TEMPERATURE
    out: Array = SEA_LEVEL_DENSITY * ratio ** (GRAVITY / (LAPSE * GAS_CONSTANT) - 1.0)
    return out


@dataclass(frozen=True, slots=True, kw_only=True)
class Air:
    """Wind and density.

    Attributes:
        north, east: mean wind where the profile does not lessen it, towards, m/s.
        exponent: of the profile ``(h / 60 m)^exponent`` below 60 m; 0 is uniform, and 0.5 is
            SIM_WIND_T 0.
        change_north, change_east: by how much the wind grows each second, m/s^2.
        turbulence: standard deviation of each horizontal axis, m/s; half of it upwards.
        turbulence_time: correlation time of a first-order process, s.
        gust_north, gust_east: a gust on top between ``gust_start`` and ``gust_end`` (s since
            the start of the flight), m/s.
        density_ratio: density over that of the standard atmosphere.
        seed: of the turbulence.
    """

    north: float = 0.0
    east: float = 0.0
    exponent: float = 0.0
    change_north: float = 0.0
    change_east: float = 0.0
    turbulence: float = 0.0
    turbulence_time: float = 1.5
    gust_north: float = 0.0
    gust_east: float = 0.0
    gust_start: float = 0.0
    gust_end: float = 0.0
    density_ratio: float = 1.0
    seed: int = 0

    @classmethod
    def from_settings(cls, speed: float, direction: float, exponent: float = 0.0) -> Air:
        """Wind as SIM_WIND_SPD (m/s) and SIM_WIND_DIR (degrees, from) give it."""
        toward = np.radians(direction + 180.0)
        north, east = speed * float(np.cos(toward)), speed * float(np.sin(toward))
        return cls(north=north, east=east, exponent=exponent)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Air:
        """Of the fields' names and values; other names are left out."""
        known = {f.name for f in fields(cls)}
        return cls(**{k: v for k, v in values.items() if k in known})

    def as_dict(self) -> dict[str, Any]:
        """Fields by their names."""
        return asdict(self)

    def steady(self, height: Array, t: Array) -> Array:
        """Wind without turbulence and gust, (n, 3) NED, m/s.

        Args:
            height: (n,) over home, m.
            t: (n,) since the start of the flight, s.
        """
        share = profile(height, self.exponent)
        out = np.zeros((len(t), 3))
        out[:, 0] = share * (self.north + self.change_north * t)
        out[:, 1] = share * (self.east + self.change_east * t)
        return out

    def unsteady(self, n: int) -> Array:
        """Turbulence and gust, (n, 3) NED, m/s, smooth at the scale of a vehicle."""
        out = np.zeros((n, 3))
        if self.turbulence:
            for axis, share in enumerate((1.0, 1.0, UPWARDS)):
                rng = np.random.default_rng([self.seed, 71, axis])
                sigma = share * self.turbulence
                out[:, axis] = turbulence(rng, n, sigma, self.turbulence_time)
        if self.gust_north or self.gust_east:
            t = np.arange(n) * DT
            inside = ((t >= self.gust_start) & (t < self.gust_end)).astype(np.float64)
            rise = smooth(inside, EDGE_S)
            out[:, 0] += self.gust_north * rise
            out[:, 1] += self.gust_east * rise
        return out


def profile(height: Array, exponent: float) -> Array:
    """Share of the wind that blows at a height over home (m); all of it from 60 m on."""
    if exponent == 0.0:
        return np.ones_like(height)
    out: Array = np.clip(height / PROFILE_HEIGHT, 0.0, 1.0) ** exponent
    return out


def turbulence(rng: np.random.Generator, n: int, sigma: float, time: float) -> Array:
    """(n,) first-order coloured noise, stationary from its first sample.

    Dryden's spectrum along the wind, ``sigma^2 2 T / (1 + (w T)^2)``, seen by something of a
    vehicle's size.

    Args:
        rng: of white numbers.
        n: samples at 1 kHz.
        sigma: standard deviation, m/s.
        time: correlation time T, s.
    """
    before = round(8.0 * time * RATE)
    decay = np.exp(-np.arange(before) * (DT / time))
    impulse = np.concatenate([decay, np.zeros(round(sum(GUST_SMOOTHING_S) * RATE))])
    impulse = _smooth_from_rest(impulse)
    impulse /= np.sqrt(np.sum(impulse**2))
    # What came before the flight is drawn first: a shorter flight is the start of a longer one.
    white = rng.standard_normal(before + len(impulse) + n)
    return sigma * convolved(white, impulse)[-n:]


def _smooth_from_rest(x: Array) -> Array:
    """Smoothing of a signal that was zero before it began."""
    padded = np.concatenate([[0.0], x])
    for window in GUST_SMOOTHING_S:
        padded = moving_average(padded, window)
    return padded[1:]


def convolved(x: Array, impulse: Array) -> Array:
    """(n,) causal convolution, zero before the first sample."""
    size = 1 << (len(x) + len(impulse) - 1).bit_length()
    spectrum = np.fft.rfft(x, size) * np.fft.rfft(impulse, size)
    out: Array = np.fft.irfft(spectrum, size)[: len(x)]
    return out
