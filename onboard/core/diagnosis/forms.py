"""Effects by those of their unknowns that they need: what acts on one axis pays for one.

Which of two effects a flight is rather about depends on how many unknowns each has, and of what is
plain to see one more costs a logarithm of the evidence.  Axes that are not square are six, and now
and then one of them is not zero: against a throttle that shifts one offset of three they then lose
by what the others cost, on a copter, whose force along z is what the throttle makes of it.  Each is
therefore taken in its likeliest form, which pays for having been sought among all: any number of
unknowns is as likely, and so are all choices of that many (Scott and Berger, 2010).
"""

from __future__ import annotations

from dataclasses import replace
from math import comb

import numpy as np

from onboard.core.diagnosis.candidates import Candidate
from onboard.core.diagnosis.selection import Fit, Fitter
from onboard.core.maths.arrays import Array


def score_in_best_form(
    fitter: Fitter, before: Fit, after: Fit, c: Candidate, held: Array | None = None
) -> float:
    """The score, for rivals, of those unknowns of an effect that make it most surprising.

    They are let go one by one, that which explains least first.  An effect that other
    accelerometers have seen, or whose unknowns are not each a size, stays whole.

    Args:
        fitter: has the columns.
        before: the fit without it.
        after: the fit with all of it.
        c: the effect, whole.
        held: (m,) values of what is not in the model.
    """
    best = c.common_score(fitter, before, after)
    if c.witness is not None or len(c.index) != len(c.plausible):
        return best
    form, most = c, len(c.index)
    for k in range(most - 1, 0, -1):
        form = _without_least(fitter, after, form)
        form = replace(form, places=c.places * most * comb(most, k))
        after = fitter.fit([*before.free, *form.index], held, held_out=False)
        best = max(best, form.common_score(fitter, before, after))
    return best


def _without_least(fitter: Fitter, fit: Fit, c: Candidate) -> Candidate:
    """An effect without that of its unknowns that explains least beside the others."""
    index = list(c.index)
    size = fit.theta[index] - fitter.absent[index]
    variance = np.diag(np.linalg.inv(fitter.informed(fit, index)))
    least = int(np.argmin(size**2 / variance))
    kept = [i for i in range(len(index)) if i != least]
    return replace(
        c,
        index=tuple(c.index[i] for i in kept),
        plausible=tuple(c.plausible[i] for i in kept),
    )
