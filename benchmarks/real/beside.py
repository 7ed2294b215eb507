"""What the effects that a diagnosis names add to the mean force of an accelerometer in the air.

Scale and offset alone are not what a flight says of an accelerometer: where vibration shifts its
offset, the mean force has that shift in it, and another accelerometer on the same board has not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.estimate.engine import Engine
from onboard.core.inputs.segments import Segment
from onboard.core.model.quadrature import NodeMaker

Array = NDArray[np.float64]
SIX = "six"


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


def beside(engine: Engine, faster_m_s: float, until: float) -> Beside:
    """What an engine's effects push, on the mean over flight faster than that, until a time, s."""
    model, solution = engine.model, engine.found()
    columns, count = np.zeros((3, model.size)), 0
    before: dict[str, tuple[Array, Array]] = {}
    for batch in engine.batches:
        fixes = batch.fixes
        segment = model.remembering(batch.segment, {} if batch.fresh else before)
        before = segment.slow
        speed = np.hypot(fixes.v_n[:, 0], fixes.v_n[:, 1])
        t = segment.t[(segment.t >= fixes.t[0]) & (segment.t < min(fixes.t[-1], until))]
        t = t[np.interp(t, fixes.t, speed) > faster_m_s]
        if len(t):
            columns += _pushed(engine, segment, t).sum(axis=0)
            count += len(t)
    if count == 0:
        return NOTHING
    A = columns / count
    six = np.zeros_like(A)
    six[:, model.slices[SIX]] = A[:, model.slices[SIX]]
    C = solution.covariance
    return Beside((A - six) @ solution.theta, A @ C @ A.T - six @ C @ six.T)


def _pushed(engine: Engine, segment: Segment, t: Array) -> Array:
    """(n, 3, m) what each unknown adds to the force at times ``t`` (n,), sensor axes."""
    nodes = NodeMaker(segment, np.zeros(3), engine.point.six).signals(t[None])
    out = np.zeros((len(t), 3, engine.model.size))
    for family in engine.model.families:
        pushed = family.acceleration(nodes) if family.available(nodes) else None
        if pushed is not None:
            out[:, :, engine.model.slices[family.name]] = segment.R_bs.T @ pushed[0]
    return out
