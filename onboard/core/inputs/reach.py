"""How far from fixes inertial samples are needed.

A receiver says what was true a latency ago, of a span about that moment.  What it makes of its own
fixes, a mean of two of them or a line between them, reaches from one to the next.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from onboard.core.inputs.limits import (
    AROUND_S,
    AROUND_SLOW_S,
    DELAY_RANGE_S,
    PAST_MARGIN_S,
    REACH_MARGINS_S,
    RESOLVED_ENDS_S,
)
from onboard.core.maths.arrays import Array
from onboard.core.maths.medians import middle


@dataclass(frozen=True, slots=True)
class Reach:
    """What is needed around a fix.

    Attributes:
        around: s to either side of the moment that it tells of.
    """

    around: float

    @property
    def before(self) -> float:
        """How long before a fix's stamp, s."""
        return DELAY_RANGE_S[1] + self.around + REACH_MARGINS_S[0]

    @property
    def ahead(self) -> float:
        """How long after it, s."""
        return self.around - DELAY_RANGE_S[0] + REACH_MARGINS_S[1]

    @property
    def after(self) -> float:
        """Without which after the last fix of a piece nothing of it is taken, s."""
        return self.around + PAST_MARGIN_S

    @property
    def longest_window(self) -> float:
        """Span of a receiver, s, that can be told from what is known around its fixes."""
        return 2.0 * (self.around - RESOLVED_ENDS_S)

    def tells(self, apart: float) -> bool:
        """Whether fixes so far ``apart``, s, have their neighbours within it."""
        return apart <= self.around


NEAR = Reach(AROUND_S)
"""Around fixes of most receivers."""
FAR = Reach(AROUND_SLOW_S)
"""Around those that are further apart than that."""


def reach_of(apart: float) -> Reach:
    """What is needed around fixes that are ``apart``, s, from one to the next."""
    return NEAR if NEAR.tells(apart) else FAR


def apart_of(t: Array) -> float:
    """How far fixes at ``t`` (n,), s, are apart from one to the next, s; inf of a single one."""
    return middle(np.diff(t)) if len(t) > 1 else math.inf
