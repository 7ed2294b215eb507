"""Effects that only make up for a constant that is none.

Of a latency that steps from flight to flight, clocks that run at different rates make the best of
it, on flight that was not fitted, too.  So where a constant of a flight is surely or probably none
(:mod:`onboard.core.diagnosis.constancy`), every effect is asked again with that constant free in
every piece of the flight.  What then explains no more than chance was its shadow.

*Within a piece.*  A constant that steps does so within a piece, where a number of its own is no
more what it was than the one number was in the flight: growth makes the best of that step again,
with all the lever of a step by tenths of a second in ten.  So what an effect is in a piece is asked
to be what it is in the others, as constants are: where it is surprisingly another one there, that
piece has a size of its own of it, and tells nothing of the effect.  An effect that is there loses
no pieces but by chance, and those that are left know it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.diagnosis.candidates import Candidate
from onboard.core.diagnosis.constancy import Pieces, changes
from onboard.core.diagnosis.final_model import FinalModel
from onboard.core.diagnosis.flight_constants import constants_of
from onboard.core.diagnosis.jumps import candidate_of
from onboard.core.diagnosis.score import least, surprise
from onboard.core.maths.arrays import Array
from onboard.core.physics.effect import Effect


def without_shadows(final: FinalModel) -> list[Effect]:
    """Families of a model that are needed beside the constants that are none."""
    engine, families = final.engine, list(final.families)
    if not families:
        return families
    found = changes(engine.all_blocks, engine.model, constants_of(final))
    changing = [i for c in found for i in c.constant.index]
    if not changing:
        return families
    pieces = Pieces.of(engine.all_blocks, engine.model).freed(changing)[0]
    # The place of the antenna may be an effect's: of itself it is no shadow.
    asked = [candidate_of(engine, f) for f in families]
    asked = [c for c in asked if not set(c.index) & set(changing)]
    gone = {id(c.columns) for c in needless(pieces, asked, engine.absent)}
    return [f for f in families if id(f) not in gone]


def needless(pieces: Pieces, asked: Sequence[Candidate], absent: Array) -> list[Candidate]:
    """Effects that explain no more than chance beside the others, the least needed first.

    Args:
        pieces: of the flight, with the changing constants free in each.
        asked: the effects, which are unknowns of the pieces.
        absent: (m,) values of the unknowns that mean that an effect is not there.
    """
    pieces = _agreeing(pieces, asked)
    variance = _variance(pieces)
    A = pieces.N.sum(axis=0) + np.diag(pieces.prior)
    b = A @ pieces.theta
    free, kept, gone = np.ones(len(b), dtype=bool), list(asked), []
    while kept:
        at = np.flatnonzero(free)
        C = np.linalg.inv(A[np.ix_(at, at)])
        theta = C @ (b[at] - A[np.ix_(at, np.flatnonzero(~free))] @ absent[~free])
        worst, lowest = None, np.inf
        for c in kept:
            place = np.searchsorted(at, c.index)
            off = theta[place] - absent[list(c.index)]
            gain = float(off @ np.linalg.solve(C[np.ix_(place, place)], off))
            score = surprise(gain, len(c.index), c.places, variance)
            if score < lowest:
                worst, lowest = c, score
        if worst is None or lowest >= least():
            break
        kept.remove(worst)
        gone.append(worst)
        free[list(worst.index)] = False
    return gone


def _agreeing(pieces: Pieces, asked: Sequence[Candidate]) -> Pieces:
    """The same where no piece says of an effect what the others contradict."""
    while asked:
        variance, places = _variance(pieces), float(len(pieces.s))
        found = [
            (surprise(float(gain), len(c.index), places, variance), piece, c)
            for c in asked
            for piece, gain in enumerate(pieces.apart(c.index))
        ]
        score, piece, c = max(found, key=lambda f: f[0])
        if score < least():
            break
        pieces = pieces.silenced(piece, c.index)
    return pieces


def _variance(pieces: Pieces) -> float:
    """Of what the pieces differ by, over what the sums say."""
    return pieces.scatter(max(1.0, pieces.square / max(pieces.rows, 1.0)))
