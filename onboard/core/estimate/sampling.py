"""A part of a flight: noise levels that are far from where they belong are found there as well."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.estimate.limits import ROUGH_S, ROUGHLY_TOGETHER
from onboard.core.inputs.segments import Batch


def few_of(runs: Sequence[Sequence[Batch]]) -> list[Sequence[Batch]] | None:
    """Parts of some runs, spread evenly; None where they would be most of the flight."""
    whole = sum(batch.duration for run in runs for batch in run)
    if whole <= 1.5 * ROUGH_S:
        return None
    step = ROUGHLY_TOGETHER
    parts = [run[i : i + step] for run in runs for i in range(0, len(run), step)]
    count = max(1, round(len(parts) * ROUGH_S / whole))
    # In the middle of as many equal pieces of the flight: its ends are a launch and a landing.
    middle = (np.arange(count) + 0.5) * (len(parts) / count)
    return [parts[i] for i in middle.astype(int)]
