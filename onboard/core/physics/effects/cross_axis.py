"""Accelerometer axes that are not square."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.model.regressors import Unknown
from onboard.core.physics.effect import Bearing
from onboard.core.physics.finding import Finding
from onboard.core.physics.proportional import Proportional
from onboard.core.physics.wording import each

PAIRS = ("xy", "xz", "yx", "yz", "zx", "zy")


class CrossAxis(Proportional):
    """Sensitivity of each axis to the others; ``xy`` is what x reads too much per unit of y."""

    effect = "cross_axis"
    code = 5
    title = "The accelerometer's axes are not square"
    sentence = "the accelerometer's axes are not square"
    meaning = "`xy` ... `zy`: what x reads too much per unit of y"
    bearing = Bearing.BESIDE
    source = "misalignment matrix without its diagonal, IEEE Std 1293"
    cure = "ArduPilot has no parameter for it: remount or replace the sensor"
    apart = "turn through all headings with bank and pitch: a tilt turns all axes alike"
    keys = PAIRS
    room_for = ("mount_tilt",)
    plausible = (0.25,) * 6
    unknowns = tuple(Unknown(f"cross_{p}", "1", 0.0, 0.15) for p in PAIRS)

    def amount(self, f_b: Array) -> Array:
        """``-e_i f_j``."""
        out = np.zeros((*f_b.shape, 6))
        for k, pair in enumerate(PAIRS):
            out[..., "xyz".index(pair[0]), k] = -f_b[..., "xyz".index(pair[1])]
        return out

    @classmethod
    def size(cls, found: Finding) -> str:
        """``xy 1.5, zx −0.8 %``."""
        return each(found.unknowns, 100.0, "%")
