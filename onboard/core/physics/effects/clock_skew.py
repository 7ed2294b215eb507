"""Clocks of GPS and IMU that run at different rates."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.model.around import Around
from onboard.core.model.regressors import Direct, Unknown
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import Bearing, Effect, Origin
from onboard.core.physics.finding import Finding
from onboard.core.physics.wording import first, measured

PARTS_PER_MILLION = 1e6
MOST: Final = 3e-3
"""A sigma of what drivers, transports and logs of two clocks make of a rate; where a receiver's
own time is known, its stamps say [cost]."""


class ClockSkew(Effect):
    """Receiver stamps that drift against the IMU's clock."""

    effect = "clock_skew"
    code = 17
    title = "The GPS and IMU clocks run at different rates"
    sentence = "GPS and IMU clocks run at different rates"
    meaning = "`rate`"
    bearing = Bearing.BESIDE
    source = "delay that grows: rate (t - t0)"
    cure = "look at the time stamps: driver, transport, or a log put together from two clocks"
    apart = "fly longer"
    of_flight = True
    keys = ("rate",)
    plausible = (0.01,)
    unknowns = (Unknown("clock_rate", "1", 0.0, MOST),)
    response = curves.Response("time", "s", "GPS late by", "ms", curves.time, lambda x, _: 1e3 * x)

    def __init__(self, origin: Origin) -> None:
        """Take what it counts from, and what stamps leave room for."""
        super().__init__(origin)
        if origin.latency_growth is not None:
            (rate,) = self.unknowns
            self.unknowns = (replace(rate, prior_sigma=min(origin.latency_growth, MOST)),)

    def velocity(self, around: Around) -> Direct:
        """``-a (t - t0)``, at the antenna, averaged as the velocity is."""
        age = around.now.t - self.origin.t0
        body = -around.f_mean[..., None] * age[:, None, None]
        ned = np.zeros_like(body)
        ned[:, 2, 0] = -STANDARD_GRAVITY * age
        return Direct(body=body, ned=ned)

    def position(self, around: Around) -> Direct:
        """``-v (t - t0)``."""
        return Direct(along_velocity=-(around.now.t - self.origin.t0)[:, None])

    @classmethod
    def size(cls, found: Finding) -> str:
        """``by 120 ± 9 ppm``."""
        return f"by {measured(first(found.unknowns), PARTS_PER_MILLION, 'ppm')}"
