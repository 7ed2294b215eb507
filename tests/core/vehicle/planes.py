"""Planes matched with the nominal one."""

from __future__ import annotations

import numpy as np

from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.core.vehicle.plane_match import match_plane

SIGMA = np.array([0.003, 0.003, 0.01])


def matched(flight):
    match = match_plane(flight, PlaneAirframe(), SIGMA)
    assert match is not None
    return match


def names(match):
    return {d.name for d in match.effects}
