"""What a recording lets ask for: the signals that an effect needs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.diagnosis.records import NotTestable
from onboard.core.inputs.segments import Batch
from onboard.core.physics.effect import Effect


def testable_of(
    everything: Sequence[Effect], batches: Sequence[Batch]
) -> tuple[list[Effect], list[NotTestable]]:
    """Effects whose signals are there and change, and why the others cannot be asked for."""
    present: list[Effect] = []
    absent = [NotTestable(e.effect, e.untestable) for e in everything if e.untestable]
    names = set.intersection(*(set(c.segment.slow) for c in batches)) if batches else set()
    for effect in everything:
        if not effect.unknowns:
            continue  # in every model, in the data themselves, or not placed yet
        missing = [n for n in effect.needs if n not in names]
        if missing:
            absent.append(
                NotTestable(effect.effect, f"no {' and '.join(missing)} in the recording")
            )
            continue
        still = [n for n in effect.needs if not _changes(batches, n)]
        if still:
            absent.append(NotTestable(effect.effect, f"{' and '.join(still)} did not change"))
            continue
        present.append(effect.told_by(batches))
    return present, absent


def _changes(batches: Sequence[Batch], name: str) -> bool:
    values = np.concatenate([np.atleast_2d(c.segment.slow[name][1].T) for c in batches], axis=1)
    # Of a wild sample or two, no change is made.
    low, high = np.percentile(values, (2, 98), axis=1)
    return bool(np.any(high > low))
