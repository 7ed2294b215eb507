"""How much of what is claimed of the receiver's delay its velocities bear out.

The regressor of a delay is the acceleration that samples and attitude make of a flight.  Some of it
is false: the tilt wanders, the heading is off, samples are shaken, the receiver knows nothing of
what was flown indoors.  That is in the prediction, too, and goes with it to whatever delay is
taken, so that it asks for none, and the estimate is right in the mean.  But it counts as
information like motion does (regression dilution: Carroll et al., *Measurement Error in Nonlinear
Models*, 2006).  Of a copter whose fixes followed a tenth of what its accelerometer felt a delay was
claimed to 0.02 s that was wherever its search had begun.

What is borne out is asked of the flight.  About a delay that is some sigmas off, the sums ask for
all of the way back; the share that they do ask for is that by which the score changes with the
delay as they claim.  An estimate is as uncertain as its score over the slope of the score, and not
over what the sums call information (Huber 1967; Godambe 1960).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.limits import OFF_SIGMAS
from onboard.core.estimate.solution import Solution
from onboard.core.inputs.limits import DELAY_RANGE_S

DELAY: Final = "gps_delay"
TOLD: Final = math.sqrt(0.5) / OFF_SIGMAS
"""How well a share is told by both delays, each of whose answers errs by a sigma."""


def doubted(made: Examination) -> Solution:
    """What an examination has found, with no more claimed of the delay than is borne out.

    Raises:
        KeyError: no flight was processed.
    """
    i = made.model.index[DELAY]
    return widened(made.found(), i, share_borne_out(made), float(made.model.prior_sigma[i]))


def share_borne_out(made: Examination) -> float:
    """By what share of the way delays that are off come back, 0 to 1.

    One that is later or earlier, whichever there is more room for, where it comes back as far as
    can be told; else both, in the mean of which what bends is not.  What is known of the delay
    before the flight is borne out: it is no regressor's.

    Raises:
        KeyError: no flight was processed.
    """
    found, i = made.found(), made.model.index[DELAY]
    variance = float(found.covariance[i, i])
    known = variance / float(made.model.prior_sigma[i]) ** 2
    off = OFF_SIGMAS * math.sqrt(variance)
    here, (least, most) = made.point.delay, DELAY_RANGE_S
    ends = [max(here - off, least), min(here + off, most)]
    first, second = sorted(ends, key=lambda end: -abs(end - here))
    asked = _asked(made, first)
    share = known + (float(found.theta[i]) - asked) / (first - here)
    if share < 1.0 - TOLD and second != here:
        share = known + (_asked(made, second) - asked) / (first - second)
    return min(max(share, 0.0), 1.0)


def _asked(made: Examination, delay: float) -> float:
    """What the flight asks for beyond a delay, s, with the same noise and the same fixes."""
    other = Examination(
        made,
        made.families,
        t0=made.point.skew_from,
        start=made,
        point=replace(made.point, delay=delay),
        refused=made.refused_velocities(),
        traced=False,
    )
    other.once()
    return float(other.found().theta[made.model.index[DELAY]])


def widened(found: Solution, i: int, share: float, prior_sigma: float) -> Solution:
    """A solution in which less is known of one unknown; where that is held, all is as it was.

    Args:
        found: the solution.
        i: place of the unknown.
        share: of the slope of its score that is borne out, 0 to 1.
        prior_sigma: that is known of it without any flight.

    Returns:
        The same estimate with a wider covariance; its information is that of the sums.
    """
    variance = float(found.covariance[i, i])
    most = max(prior_sigma**2, variance)
    wide = min(variance / share**2, most) if share**2 * most > variance else most
    along = found.covariance[:, i] / variance
    return replace(found, covariance=found.covariance + (wide - variance) * np.outer(along, along))
