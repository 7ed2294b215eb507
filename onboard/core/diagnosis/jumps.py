"""When the offsets jumped: to the half second, from one pass with a jump at every moment.

A jump stays.  A shock that the samples do not resolve (a touch-down, a bump) gives velocity and
attitude a kick that dead reckoning knows nothing of; with little flight after it, it looks alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from onboard.core.diagnosis.block_jumps import settled_from
from onboard.core.diagnosis.candidates import Candidate
from onboard.core.diagnosis.companions import Companions
from onboard.core.diagnosis.effort import (
    FINER,
    FORGOTTEN_S,
    FURTHEST,
    MOST_AT_ONCE,
    ONCE_MORE,
    SPACINGS_S,
)
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.limits import (
    CLEARLY,
    CONTACT_S,
    MATTERS_OFFSET,
    MATTERS_SCALE,
    SCAN_S,
)
from onboard.core.diagnosis.onsets import fitted, gains
from onboard.core.diagnosis.score import Peak, least, needed, surprise
from onboard.core.diagnosis.shocks import Shock
from onboard.core.diagnosis.stepped import Stepped
from onboard.core.estimate.pool import Pool
from onboard.core.maths.arrays import Array
from onboard.core.physics.effect import Effect, Origin
from onboard.core.physics.effects.bias_step import BiasStep
from onboard.core.physics.effects.scale_step import ScaleStep


@dataclass(frozen=True, slots=True)
class Looked:
    """A jump at one moment (s) beside nothing else: its gain, what the sums know of it (3,)."""

    moment: float
    gain: float
    known: Array


def jumps_anywhere(full: Examination) -> list[Looked]:
    """Jumps at moments all over the flight, as it is without any."""
    moments = np.arange(settled_from(full.blocks), full.blocks[-1].end - SCAN_S, SCAN_S).tolist()
    if not moments:
        return []
    found = Stepped(full, moments)
    return [Looked(*x) for x in zip(moments, found.gain.tolist(), found.known, strict=True)]


def surprising(full: Examination, looked: Sequence[Looked], score: float) -> list[Looked]:
    """A scan in which a jump is as surprising as ``score``, looked at again; else nothing of it.

    Between its moments a jump may explain twice what it explains at either (:data:`SCAN_S`).
    """
    if not looked or surprise(2.0 * best_of(looked).gain, 3, len(looked)) < score:
        return []
    again = _looked_again(full, looked)
    return [] if surprise(best_of(again).gain, 3, len(again)) < score else again


def _looked_again(full: Examination, looked: Sequence[Looked]) -> list[Looked]:
    """A scan whose moments about the best one are looked at as the flight is with a jump there.

    What is far from nothing bends a flight that is taken for one without jumps, and another moment
    may be better.
    """
    best = int(np.argmax([at.gain for at in looked]))
    about = slice(max(best - ONCE_MORE // 2, 0), best + ONCE_MORE // 2 + 1)
    moments = [at.moment for at in looked[about]]
    jump = BiasStep(Origin(full.point.skew_from))
    fitter, before, fits = fitted(full, (), [jump.at(t) for t in moments])
    out = list(looked)
    out[about] = [
        Looked(t, fitter.gain(before, after), np.diag(fitter.informed(after, index)))
        for t, (index, after) in zip(moments, fits, strict=True)
    ]
    return out


def best_of(looked: Sequence[Looked]) -> Looked:
    """The one of a scan, not empty, that explains most."""
    return max(looked, key=lambda at: at.gain)


def shown_from(
    full: Examination, looked: Sequence[Looked], pool: Pool, companions: Companions, imu: int
) -> Array | None:
    """Sizes (3,) from which a jump would have been found at half of the moments; None: at none."""
    if not looked:
        return None
    places = full.trusted_s / SPACINGS_S[0]
    known = np.median([at.known for at in looked], axis=0)
    out: Array = np.sqrt(needed(3, places, pool.variance, pool.freedom) / known)
    with_others = companions.shown_from(imu, known, pool.variance)
    return out if with_others is None else np.minimum(out, with_others)


def reach_of_scan(looked: Sequence[Looked]) -> float:
    """How far (s) from the best moment of a scan, not empty, there may be a better one.

    Between two of its moments a jump may explain twice what it explains at either
    (:data:`~onboard.core.diagnosis.limits.SCAN_S`), where an EKF that follows the accelerometer
    makes one that comes later look nearly as good.  So all that explain half of the best one are
    looked at again, as far as a jump is told.
    """
    best = best_of(looked)
    apart = [abs(at.moment - best.moment) for at in looked if at.gain >= best.gain / 2.0]
    return min(max(SCAN_S, *apart), FORGOTTEN_S)


def jump_near(full: Examination, chosen: Sequence[Effect], centre: float, reach: float) -> BiasStep:
    """The jump near ``centre`` (s) that explains most beside ``chosen``.

    One that is found at the edge of where it was looked for is looked for further there.

    Args:
        full: the flight with every column.
        chosen: effects that are in the model.
        centre: s.
        reach: s to either side in which it is looked for first: how well the centre is known.  A
            flight may have another one further off.
    """
    coarse, fine = SPACINGS_S
    jump = BiasStep(Origin(full.point.skew_from))
    first = settled_from(full.blocks)

    def like(t: Array) -> Array:
        return _scaled(full, chosen, [jump.at(float(x)) for x in t])

    def about(centre: float, width: float, spacing: float) -> Array:
        times = np.arange(centre - width, centre + width + 1e-6, spacing)
        inside: Array = np.unique(np.maximum(times, first))
        return inside

    for _ in range(FURTHEST):
        t = about(centre, reach, coarse)
        peak = Peak(t, like(t), coarse)
        at_edge = abs(peak.best - centre) > reach - 2.0 * coarse
        centre = peak.best
        if not at_edge:
            break
    t = about(centre, 1.5 * coarse, fine)
    peak = _resolved(full, like, peak.closer(t, like(t), fine))
    return jump.at(peak.best, None, peak.sigma)


def placed(full: Examination, seen: BiasStep) -> BiasStep:
    """A jump that other accelerometers have seen, where they and GPS together like it best.

    They may know when it was to half a minute only, so that it is looked for coarsely first.
    """
    coarse, fine = SPACINGS_S
    reach = 2.0 * seen.onset_sigma  # 95 % of what they say
    t = _moments(full, seen.moment - reach, seen.moment + reach, coarse)
    like = _liked(full, seen, t)
    near = t[like > like.max() - CLEARLY]
    t = _moments(full, near[0] - coarse, near[-1] + coarse, fine)
    liked = partial(_liked, full, seen)
    peak = _resolved(full, liked, Peak(t, liked(t), fine))
    return seen.at(peak.best, None, peak.sigma)


def _resolved(full: Examination, like: Callable[[Array], Array], peak: Peak) -> Peak:
    """A peak that was looked at ever closer, until moments are closer than it is wide.

    Where neighbours are no likelier than chance, they are too far apart to tell how well a moment
    is known.  Between two samples nothing is told.

    Args:
        full: the flight.
        like: chi-square (n,) that speaks for moments (n,), s.
        peak: what is known of it.
    """
    sample = float(np.median(np.diff(full.batches[0].segment.t)))
    while peak.sigma < peak.spacing and peak.spacing > sample:
        closer = peak.spacing / FINER
        t = peak.best + closer * np.arange(1 - FINER, FINER, dtype=np.float64)
        peak = peak.closer(t, like(t), closer)
    return peak


def _moments(full: Examination, first: float, last: float, spacing: float) -> Array:
    """Moments within the flight, s; one at least."""
    start, end = full.blocks[0].start, full.blocks[-1].end
    t = np.arange(first, last + 1e-6, spacing)
    inside: Array = t[(t > start) & (t < end)]
    return inside if len(inside) else np.clip([0.5 * (first + last)], start, end)


def _liked(full: Examination, seen: BiasStep, t: Array) -> Array:
    """Chi-square (n,) by which GPS and those that have seen a jump speak for it at each moment."""
    apart = (t - seen.moment) / seen.onset_sigma
    out: Array = _scaled(full, (), [seen.at(float(m)) for m in t]) - apart**2
    return out


def halved(seen: BiasStep) -> BiasStep:
    """A jump of this accelerometer or of another one, as likely: its mean and its spread."""
    w = seen.witness
    if w is None:
        return seen
    half = replace(w, size=0.5 * w.size, sigma=np.hypot(0.5 * w.size, w.sigma))
    return seen.at(seen.moment, half)


def alike(full: Examination, jump: BiasStep, own: BiasStep, variance: float) -> bool:
    """Whether a jump is rather one of all accelerometers than, as others saw it, of one alone.

    Args:
        full: the flight with every column.
        jump: found without the others.
        own: the same as the others have seen it.
        variance: of gains over what the sums say.
    """
    if own.witness is None:
        return False
    # One after the other: they have the same name.
    (as_all,), (as_one,) = gains(full, (), [jump]), gains(full, (), [own])
    return (as_all - as_one) / max(variance, 1.0) - own.witness.gain > CLEARLY


def shock_instead(full: Examination, jump: BiasStep) -> Shock | None:
    """A shock that is less of a chance than a jump at the end of the flight; None: none is.

    Nothing hits a vehicle in the air: a jump before the last :data:`CONTACT_S` is none.
    """
    start, end = full.blocks[-1].end - CONTACT_S, full.blocks[-1].end
    if jump.moment < start:
        return None
    for spacing in SPACINGS_S:
        shocks = [Shock(float(t), spacing) for t in np.arange(start, end, spacing)]
        own, *theirs = gains(full, (), [jump, *shocks])
        best = shocks[int(np.argmax(theirs))]
        start, end = best.moment - spacing, best.moment + spacing
    likelier = surprise(max(theirs), len(best.unknowns)) > surprise(own, len(jump.unknowns))
    return best if likelier else None


def explains(full: Examination, chosen: Sequence[Effect], shock: Shock) -> bool:
    """Whether what a shock explains beside ``chosen`` effects is no chance at all its moments."""
    (gain,) = gains(full, chosen, [shock])
    return surprise(gain, len(shock.unknowns), full.trusted_s / SPACINGS_S[-1]) >= least()


def _scaled(full: Examination, chosen: Sequence[Effect], jumps: Sequence[BiasStep]) -> Array:
    """Gain of each jump alone, by the variance of gains over what the sums say.

    What a pass takes for known with its jumps decides what it refuses, so that only gains of one
    pass compare.  Where it takes several, each has the best of those before it among its own, and
    the others are counted from that one.
    """
    out: list[float] = []
    while len(out) < len(jumps):
        best = [int(np.argmax(out))] if out else []
        some = jumps[len(out) : len(out) + MOST_AT_ONCE - len(best)]
        fitter, before, fits = fitted(full, chosen, [*some, *(jumps[k] for k in best)])
        variance = max(fitter.pool.variance, 1.0)
        gained = [fitter.gain(before, after) / variance for _, after in fits]
        more = sum(out[k] for k in best) - sum(gained[len(some) :])
        out += [gain + more for gain in gained[: len(some)]]
    return np.array(out)


def candidates_of(made: Examination, family: Effect) -> list[Candidate]:
    """A family of an examination as candidates: simpler forms of it, and all of it."""
    whole = candidate_of(made, family)
    return [
        *(
            replace(whole, index=whole.index[: len(s.unknowns)], columns=s)
            for s in family.simpler()
        ),
        whole,
    ]


def candidate_of(made: Examination, family: Effect) -> Candidate:
    """A family of an examination as a candidate."""
    jump, of_scale = family.onset is not None, isinstance(family, ScaleStep)
    witness = family.witness if isinstance(family, BiasStep | ScaleStep) else None
    return Candidate(
        family.effect,
        tuple(made.indices(family)),
        family.plausible,
        family,
        places=made.trusted_s / SPACINGS_S[0] if jump else 1.0,
        jump=jump,
        worth=MATTERS_SCALE if of_scale else MATTERS_OFFSET,
        rare=of_scale,
        witness=witness,
        felt=_felt_since(made, family.onset) if of_scale and witness is not None else None,
        room_for=family.room_for,
        positive=family.positive,
        mirrored=family.goes_below,
    )


def _felt_since(made: Examination, moment: float | None) -> Array:
    """(3,) what the accelerometer read on average from a moment (s) on, m/s^2: sensor axes."""
    scale, beta = np.split(made.point.six, 2)
    parts = [b.segment.raw_s[b.segment.t >= (moment or 0.0)] for b in made.batches]
    out: Array = scale * np.concatenate(parts).mean(axis=0) + beta
    return out
