"""What the effects that a diagnosis names add to the mean force of an accelerometer in the air.

Scale and offset alone are not what a flight says of an accelerometer: where vibration shifts its
offset, the mean force has that shift in it, and another accelerometer on the same board has not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onboard.core.diagnosis.examination import Examination
from onboard.core.estimate.mean_force import SIX, mean_columns
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array, Mask


@dataclass(frozen=True, slots=True)
class Beside:
    """Mean force beside scale and offset, sensor axes, m/s^2.

    Attributes:
        force: (3,).
        covariance: (3, 3) what it adds to the covariance of the mean force, which is correlated
            with it: not a covariance by itself.
    """

    force: Array
    covariance: Array


NOTHING = Beside(np.zeros(3), np.zeros((3, 3)))


def beside(engine: Examination, faster_m_s: float, until: float) -> Beside:
    """What an engine's effects push, on the mean over flight faster than that, until a time, s."""

    def flown(batch: Batch, t: Array) -> Mask:
        speed = np.hypot(batch.fixes.v_n[:, 0], batch.fixes.v_n[:, 1])
        out: Mask = (np.interp(t, batch.fixes.t, speed) > faster_m_s) & (t < until)
        return out

    A = mean_columns(engine, flown)
    if A is None:
        return NOTHING
    six = np.zeros_like(A)
    six[:, engine.model.slices[SIX]] = A[:, engine.model.slices[SIX]]
    solution = engine.found()
    C = solution.covariance
    return Beside((A - six) @ engine.model.whole(solution.theta), A @ C @ A.T - six @ C @ six.T)
