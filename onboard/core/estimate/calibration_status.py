"""What a calibration deserves to be called.

It is one where what the flight determines can be set: where the force over the loads flown is then
known as well as it is needed, or surely better than it was.  That takes no number by itself, and no
manoeuvre: a hover knows the z axis at one load, and flies at no other.  It is none where the flight
contradicts the model, for then its sigmas say nothing.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from onboard.core.estimate.calibration_model import beyond_range
from onboard.core.estimate.determined import Determined, determine, force_moments
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.limits import LEAST_CHANGE, SURE
from onboard.core.estimate.observability import Needs
from onboard.core.estimate.result import Calibration, Status
from onboard.core.estimate.solution import Solution
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.reach import FAR, NEAR

HOVERED = "hovering or standing: fly fast, brake hard, turn both ways"
"""What to do about a flight that went nowhere."""


def judged(
    made: Calibration, engine: Engine, solution: Solution, parameters: ParametersInForce
) -> Calibration:
    """The record with the status that the flight deserves.

    Args:
        made: with the status of a flight that shows too little.
        engine: has its sums.
        solution: of them.
        parameters: in force.
    """
    if not parameters.representable:
        note = (
            "AHRS_ORIENTATION is unknown or not a multiple of 90 degrees: scale and offset of the "
            "sensor's axes cannot be separated from here. "
        )
        return replace(made, status=Status.INVALID, note=note + made.note)
    if doubt := doubt_of(engine, solution):
        return replace(made, note=f"{doubt}. {made.note}")
    if not engine.moving:
        made = replace(made, note=f"{HOVERED}. {made.note}".rstrip())
    if engine.trusted_s < engine.settings.minimum_s:
        return made
    made = replace(made, believed=True)
    done = good_enough(made, engine.settings.needs)
    return replace(made, status=Status.CALIBRATED) if done else made


def doubt_of(engine: Engine, solution: Solution) -> str:
    """Why the sigmas of a flight may not be believed, in words; empty if they may."""
    if solution.contradicts:
        return (
            "the flight contradicts itself: something is missing from the model, "
            "see onboard explain"
        )
    if beyond := too_far(engine, solution):
        return f"{' and '.join(beyond)}: something is missing from the model, see onboard explain"
    return ""


def too_far(engine: Engine, solution: Solution) -> list[str]:
    """What the flight wants further off than anything of it can be, in words."""
    found = solution.theta, solution.covariance
    # Sums of earlier flights alone have followed what their fixes showed: long spans, slow ones.
    slow = engine.point.window > NEAR.longest_window
    apart = engine.apart if engine.batches else FAR.around if slow else NEAR.around
    steps = [float(np.median(np.diff(b.segment.t))) for b in engine.batches]
    step = float(np.median(steps)) if steps else math.inf
    return beyond_range(engine.point, engine.model, *found, apart=apart, step=step)


def good_enough(made: Calibration, needs: Needs) -> bool:
    """Whether there is something to set, with which the force is known well, or surely better."""
    found = _determined(made)
    if found is None:
        return False
    surely = found.probability >= SURE and found.change >= LEAST_CHANGE
    return surely or _known(found, made, needs)


def force_known(made: Calibration, needs: Needs) -> bool:
    """Whether the force over the loads flown is known as well as from numbers known well enough."""
    found = _determined(made)
    return found is not None and _known(found, made, needs)


def _determined(made: Calibration) -> Determined | None:
    """What there is to set; None if there is nothing."""
    try:
        found = determine(made, made.in_force_scale + made.in_force_offset)
    except ValueError:  # numbers that are none
        return None
    return found if found.directions else None


def _known(found: Determined, made: Calibration, needs: Needs) -> bool:
    M = force_moments(made.load_mean, made.load_square, made.in_force_scale + made.in_force_offset)
    return found.error_after**2 <= float(np.diag(M) @ needs.target**2)
