"""Samples to nodes as loops that numba compiles: curves, turns in a row, integrals.

Equal to numpy's way to rounding (no fast-math): :class:`~onboard.core.maths.interpolation.Hermite`,
:func:`~onboard.core.maths.frames.rotation_from_vector` and their callers, which are what these are
held to.  :func:`~onboard.core.maths.compiling.compiled_loops` is the way in.
"""

from onboard.core.maths.loops.bounded import bounded
from onboard.core.maths.loops.curves import cubics, dragged, signals, straight, values
from onboard.core.maths.loops.integrals import (
    OWN,
    averaging,
    integrals,
    late,
    own,
    seen,
    spread,
    twice,
)
from onboard.core.maths.loops.kalman import kalman_errors
from onboard.core.maths.loops.nodes import followed, inside, turned_on
from onboard.core.maths.loops.turns import attitudes

__all__ = [
    "OWN",
    "attitudes",
    "averaging",
    "bounded",
    "cubics",
    "dragged",
    "followed",
    "inside",
    "integrals",
    "kalman_errors",
    "late",
    "own",
    "seen",
    "signals",
    "spread",
    "straight",
    "turned_on",
    "twice",
    "values",
]
