"""An accelerometer whose readings come in coarse steps."""

from __future__ import annotations

import numpy as np

from onboard.core.physics.effect import Bearing, Effect
from onboard.core.physics.finding import Finding
from onboard.core.physics.wording import fixed


class AccelerometerResolution(Effect):
    """Readings on a lattice: what lies between its points was rounded or cut off, nobody knows."""

    effect = "accelerometer_resolution"
    code = 25
    title = "The accelerometer is read in coarse steps"
    sentence = "the accelerometer is read in coarse steps"
    meaning = "`x`, `y`, `z`, m/s²: the step; 0 where an axis has none that matters"
    bearing = Bearing.HARMLESS
    source = "spacing of the values that were read; error of integer conversion"
    cure = "have it sent or logged with finer steps: HIGHRES_IMU, RAW_IMU unscaled, the onboard log"
    apart = "log the same flight on board: there readings are finer"
    excluded = True
    treated = "what the steps may have done to the numbers is estimated, and is in their sigmas"

    @classmethod
    def size(cls, found: Finding) -> str:
        """``of 0.049 m/s²``."""
        most = max((q.value for q in found.unknowns.values()), default=np.nan)
        return f"of {fixed(most, 3)} m/s²"
