"""Where a recording says that its vehicle stands: at which fixes, and by whose word."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence

import numpy as np

from onboard.core.inputs.airborne import Ground
from onboard.core.inputs.limits import GROUND_M
from onboard.core.inputs.samples import FIX_3D, GpsFix, Sample, VehicleState
from onboard.core.maths.arrays import Mask
from onboard.core.vehicle.limits import MARGIN_S

NO_FLIGHT = "no stretch of flight with trusted GPS, attitude and inertial data"


def fixes_of(samples: Sequence[Sample]) -> list[GpsFix]:
    """Fixes in three dimensions, each once, of the receiver that has the most of them.

    Telemetry may ask for them more often than a receiver makes them, and repeats the last one;
    and the height of one antenna is not that of another.
    """
    every = [s for s in samples if isinstance(s, GpsFix) and s.fix_type >= FIX_3D]
    if not every:
        return []
    receiver = Counter(f.receiver for f in every).most_common(1)[0][0]
    own = [f for f in every if f.receiver == receiver]
    return [own[0], *(f for before, f in itertools.pairwise(own) if f.t != before.t)]


def said_to_stand(samples: Sequence[Sample], fixes: Sequence[GpsFix]) -> Mask:
    """(n,) whether the autopilot said, at each of n fixes, that the vehicle is on the ground."""
    word, said = Ground(), list[bool]()
    for sample in samples:
        if isinstance(sample, VehicleState):
            word.feed(sample)
        elif len(said) < len(fixes) and sample is fixes[len(said)]:
            said.append(word.grounded is True)
    return np.array(said, dtype=bool)


def with_landings(samples: list[Sample], grounded: list[tuple[float, float]]) -> list[Sample]:
    """The samples, with the word that the vehicle has landed where it was on the ground.

    Args:
        samples: of the recording.
        grounded: from and to, s, with what margin a landing has: nothing before them is doubtful.
    """
    if not grounded:
        return samples
    out: list[Sample] = []
    was: bool | None = None
    for sample in samples:
        if isinstance(sample, GpsFix):
            now = any(a <= sample.t <= b for a, b in grounded)
            if now is not was:
                out.append(VehicleState(sample.t, landed=now, late_s=0.0))
                was = now
        if isinstance(sample, VehicleState) and sample.landed is not None and was is not None:
            sample = VehicleState(sample.t, sample.armed, was, sample.kind)  # noqa: PLW2901
        out.append(sample)
    return out


def without_flight(*, standing: bool, table: bool) -> str:
    """Why there is no flight to ask about: what was taken for the ground, if anything was."""
    if not standing:
        return f"{NO_FLIGHT} that is long enough"
    why = (
        f"{NO_FLIGHT}: where it stood, or was still within {GROUND_M:.0f} m of that height, is "
        f"none, nor are {MARGIN_S:.0f} s to either side"
    )
    what = "airborne = true in the map takes all of it for flight" if table else "fly above that"
    return f"{why}; {what}"
