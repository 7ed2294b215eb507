"""Flights of one sensor together: which of them count, what they say, and what all leave open.

The one way from flights to a mean, of a few recordings and of a fleet's vehicle alike: who counts
(:mod:`~onboard.core.estimate.merged_flights`), and beside the mean what no flight shows by itself
and all of them may have (:mod:`~onboard.core.diagnosis.together`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.diagnosis.together import Asked, Told, undecided_together
from onboard.core.diagnosis.undecided import Undecided, left_open
from onboard.core.estimate.merged_flights import (
    FlightSix,
    Merged,
    Prior,
    Reconciled,
    merged,
    reconciled,
)

WHO = "The flights together leave"
"""Open what :func:`~onboard.core.diagnosis.undecided.in_words` says."""


@dataclass(frozen=True, slots=True)
class Heard:
    """What one flight says: of the six, and of effects that are alike in all flights."""

    six: FlightSix
    effects: Sequence[Asked] = ()


@dataclass(frozen=True, slots=True)
class Joined:
    """Flights merged.

    Attributes:
        found: which of them count.
        merged: what those say, with what they leave open in the covariance; None: none counts.
        open: models that may be right instead.
    """

    found: Reconciled
    merged: Merged | None
    open: tuple[Undecided, ...]


def joined(flights: Sequence[Heard], prior: Prior) -> Joined:
    """Merge flights; the cost is linear in their number, as long as they agree.

    Args:
        flights: at least one, of one sensor, in the order in which they were flown.
        prior: of the six.
    """
    found = reconciled([f.six for f in flights], prior)
    if not found.counted:
        return Joined(found, None, ())
    counted, none = set(found.counted), np.zeros((6, 6))
    told = [
        Told(f.effects, f.six.information if k in counted else none) for k, f in enumerate(flights)
    ]
    open_ = undecided_together(told, prior.sigma)
    made = merged([flights[k].six for k in found.counted], prior)
    made = replace(made, covariance=made.covariance + left_open(open_))
    return Joined(found, made, tuple(open_))
