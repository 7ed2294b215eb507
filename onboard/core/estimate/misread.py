"""What an accelerometer reads wrong beside scale and offset, taken off the samples of a flight.

Scale and offset are those of a model with other physics in it (a curve of the scale, axes that are
askew, an offset that jumps, drifts or follows the throttle), found from the same sums.  Alone they
give no force that was ever felt: where the scale changes with the load, its value at no load stands
beside a curve that makes up for it.  So either all of it is undone, or nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onboard.core.estimate.engine import Engine
from onboard.core.inputs.segments import Segment
from onboard.core.maths.arrays import Array
from onboard.core.model.nuisances import Six
from onboard.core.model.quadrature import NodeMaker
from onboard.core.model.regressors import Model


@dataclass(frozen=True, slots=True)
class Misread:
    """Everything that a model has of an accelerometer's reading beside the six.

    Attributes:
        model: whose families it is of.
        theta: (m,) its unknowns, of samples as they were read.
    """

    model: Model
    theta: Array

    def taken_off(self, segment: Segment, before: Segment | None) -> tuple[Array, Segment]:
        """What is to be added to the force of a segment's samples, as in ``f += a theta``.

        Args:
            segment: samples.
            before: what was returned for the segment before it, for effects with a memory; None
                after a gap.

        Returns:
            (n, 3) m/s^2, body axes, and the segment with what effects remember of it.
        """
        segment = self.model.remembering(segment, {} if before is None else before.slow)
        six = self.theta[self.model.slices[Six.name]]
        nodes = NodeMaker(segment, np.zeros(3), six).signals(segment.t[None])
        out = np.zeros((len(segment.t), 3))
        for family in self.model.families:
            if family.name == Six.name or not family.is_read or not family.available(nodes):
                continue
            added = family.acceleration(nodes)
            if added is not None:
                out += added[0] @ self.theta[self.model.slices[family.name]]
        return out, segment


def attitude_error(engine: Engine) -> tuple[Array, Array] | None:
    """By which the recorded attitude is off all flight long, and how surely; None without sums.

    Returns:
        (3,) roll and pitch of the body, and heading, rad, and (3,) their sigmas.
    """
    solution, index = engine.solution(), engine.model.index
    if solution is None:
        return None
    places = [index[n] for n in ("tilt_roll", "tilt_pitch", "heading")]
    off = solution.theta[places]
    off += (*engine.point.tilt, engine.point.heading)
    return off, np.sqrt(np.diag(solution.covariance)[places])


def misread_of(engine: Engine) -> Misread | None:
    """What an engine's sums say of it; None where there are none."""
    solution = engine.solution()
    return None if solution is None else Misread(engine.model, engine.model.whole(solution.theta))
