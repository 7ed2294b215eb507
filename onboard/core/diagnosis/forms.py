"""Which of two effects a flight is rather about, each by those of its unknowns that it needs.

A score is a probability by chance, along the columns of its own effect and with the freedom with
which the scatter along these is known.  That is right for whether something is there.  Of what is
there beyond doubt, two scores differ by how well the scatter is known, and not by what the flight
says of the two: that is by how much more one explains of the same flight, each beyond what it would
need to count as found.

And an unknown more costs some five.  Axes that are not square are six, and now and then one of them
is not zero; against a throttle that shifts one of three offsets they were told as that, fifteen
behind, on a copter, whose force along z is what the throttle makes of it.  So each effect is in the
form that explains most beyond its need, which is larger for having been sought among all forms: any
number of unknowns is as likely, and so are all choices of that many (Scott and Berger, 2010).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import comb

import numpy as np

from onboard.core.diagnosis.candidates import Candidate, possible
from onboard.core.diagnosis.limits import CLEARLY
from onboard.core.diagnosis.selection import Fit, Fitter
from onboard.core.maths.arrays import Array


def beyond_need(
    fitter: Fitter,
    beside: Sequence[int],
    c: Candidate,
    held: Array | None = None,
) -> float:
    """What an effect explains beyond what it needs to count as found, in its best form.

    Unknowns are let go one by one, that which explains least first.  An effect that other
    accelerometers have seen, or whose unknowns are not each a size, stays whole.

    Args:
        fitter: has the columns.
        beside: columns that are in the model anyway.
        c: the effect, whole.
        held: values of what is not in the model.

    Returns:
        In units of chi-square (:meth:`~.candidates.Candidate.beyond_need`).
    """
    before = fitter.fit(beside, held, held_out=False)
    after = fitter.fit([*beside, *c.index], held, held_out=False)
    best = c.beyond_need(fitter, before, after)
    if c.witness is not None or len(c.index) != len(c.plausible):
        return best
    form, most = c, len(c.index)
    for k in range(most - 1, 0, -1):
        form = _without_least(fitter, after, form)
        form = replace(form, places=c.places * most * comb(most, k))
        after = fitter.fit([*beside, *form.index], held, held_out=False)
        best = max(best, form.beyond_need(fitter, before, after))
    return best


def merit(
    fitter: Fitter,
    beside: Sequence[int],
    c: Candidate,
    after: Fit,
) -> float:
    """The same; of what cannot be only by as much as it is clearly more than of what can.

    Args:
        fitter: has the columns.
        beside: columns that are in the model anyway.
        c: the effect, whole.
        after: the fit with it in.
    """
    beyond = beyond_need(fitter, beside, c)
    return beyond if possible(fitter, after, c) else beyond - CLEARLY


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
