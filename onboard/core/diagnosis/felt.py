"""The force that samples let one expect, as far as the receiver says that they are noise.

What may be noise in the samples may be real, too, and the flight is taken as its velocity is
likelier.  Of noise there is about as much as the velocity walks by.  Where it matters to the six,
its level is estimated, each axis by itself: a filter that takes too little leaves a scale too
small, one that takes too much makes it too large, and of noise that is most of a force the walk
tells no more than an octave.  A level is found as every unknown is, by a column of its own
(:class:`~onboard.core.model.noise_level.NoiseLevel`), step by step as a filter is not linear in it,
and what is left open of it is in the sigmas of the scales.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.limits import MOST_TONES
from onboard.core.diagnosis.toneless import Beside, heard, unseen
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.limits import WORTH_A_SEARCH
from onboard.core.filter.limits import LIMITS
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.shaken import walk_s
from onboard.core.inputs.expected_force import (
    drowned,
    expected,
    levelled,
    spectrum,
    white,
)
from onboard.core.inputs.segments import Batch
from onboard.core.inputs.tones import Tone, density_of, stretches_of, without
from onboard.core.maths.arrays import Array
from onboard.core.model.noise_level import DOUBT, NoiseLevel
from onboard.core.model.regressors import Family
from onboard.core.physics.effect import Effect

MOST_STEPS = 4
"""Of the search for levels: each is three times what was thought at the most, and the spectrum of
samples spans fifty times [cost]."""
AFRESH, EITHER = (False,), (True, False)
"""Whether the receiver's average is looked for from where it was found before."""
FURTHEST = 1.5 * DOUBT
"""Of one step, as a logarithm: to first order only is a filter what its column says [bound]."""


@dataclass(frozen=True, slots=True)
class Asked:
    """Of a flight: whose sensor's, with which effects from when on, what else there is."""

    engine: Engine
    testable: Sequence[Effect]
    t0: float
    carried: Sequence[Family]
    beside: Examination | None

    def examined(self, batches: Sequence[Batch], start: Examination | None = None) -> Examination:
        """The flight with its own noise and timing, looked for from those of ``start``."""
        made = self.tuned(batches, start)
        made.once()
        return made

    def tuned(self, batches: Sequence[Batch], start: Examination | None = None) -> Examination:
        """The same without its sums yet.

        Else from those of the accelerometer beside it: it has flown the same flight with the same
        receiver, and a search takes a third of the passes from there.  Else from where they are
        likeliest with nothing but scale, offset and timing: with every effect at once, a search
        that knows nothing yet is led away by what effects make up for, and does not come back.  A
        heading that seemed worse than usual may have been one of them, though.
        """
        plain = self.plain(batches) if start is None and self.beside is None else None
        start = start or plain
        made = Examination(
            self.engine,
            self.testable,
            t0=self.t0,
            batches=batches,
            start=start,
            carried=self.carried,
        )
        if plain is not None and plain.noise != (usual := plain.noise.with_usual_heading):
            made.noise = usual
            made.with_rows()  # what it is linear about would pass for noise
        if start is None and self.beside is not None:
            made.begin_as(self.beside)
        return made.tuned()

    def levelled(
        self,
        batches: Sequence[Batch],
        level: NoiseLevel,
        start: Examination,
        *,
        averaging: bool,
    ) -> Examination:
        """The flight beside levels of noise that are not known, with its own noise and timing.

        Args:
            batches: the flight, with what is expected of its samples.
            level: about what they were thought to be.
            start: where noise and timing are looked for from.
            averaging: whether the receiver's average is looked for from there, too.  One that was
                found for the sake of noise does not go by itself.
        """
        point = start.point
        if not averaging:
            point = replace(point, window=0.0, shapes=(0.0,) * 4)
        return Examination(
            self.engine,
            self.testable,
            t0=self.t0,
            batches=batches,
            start=start,
            point=point,
            carried=(*self.carried, level),
        ).with_noise()

    def plain(self, batches: Sequence[Batch]) -> Examination:
        """The flight without any effect, noise and timing at their likeliest; no sums."""
        made = Examination(
            self.engine, (), t0=self.t0, batches=batches, carried=self.carried, traced=False
        )
        made.tune()
        return made


def felt(asked: Asked, batches: Sequence[Batch]) -> Examination:
    """A flight examined with the force that its samples let one expect, or as it was sampled.

    Without tones that they have, if its velocity is likelier so.  Then without the noise, whose
    levels are looked for where it moves one of the six.  Where it only may drown what an antenna or
    a delay is told by, it is the least that white noise can be.
    """
    density = spectrum(batches)
    if density is None:
        return asked.examined(batches)
    sampled, tones = _listened(asked, batches)
    if tones:
        toneless = asked.examined(without(batches, tones), sampled)
        if toneless.log_likelihood > sampled.log_likelihood:
            tone = density_of(tones, density, stretches_of(batches))
            sampled, batches = toneless, toneless.batches
            density = np.maximum(density - tone, np.min(density, axis=0))
    walk = mean_walk_s(sampled.noise, batches)
    least = np.minimum(white(density), walk)
    if sampled.found_noisy:
        levels = [least, walk] if np.any(least < walk) else [walk]
        found = _levels_found(asked, batches, density, sampled, levels)
    elif np.any(white(density) > LIMITS["force_walk"][0] ** 2) or drowned(batches, density):
        found = asked.examined(expected(batches, density, least), sampled)
    else:
        return sampled
    return max(sampled, found, key=_likelihood)


def _listened(asked: Asked, batches: Sequence[Batch]) -> tuple[Examination, list[Tone]]:
    """The flight as it was sampled, and tones of the samples that its receiver knows nothing of."""
    audible, sampled, beside = heard(batches), asked.tuned(batches), None
    if audible and not sampled.noisy:
        beside = Beside.of(sampled, audible[:MOST_TONES])  # without a pass of their own
    else:
        sampled.once()
    return sampled, unseen(sampled, audible, beside)


def mean_walk_s(levels: NoiseLevels, batches: Sequence[Batch]) -> Array:
    """(3,) variance by which the velocity walks in a second of all batches, (m/s)^2."""
    out: Array = np.mean([walk_s(levels, batch.segment) for batch in batches], axis=0)
    return out


def _levels_found(
    asked: Asked,
    batches: Sequence[Batch],
    density: Array,
    start: Examination,
    levels: Sequence[Array],
) -> Examination:
    """The flight with the likeliest levels of noise.

    Args:
        asked: of it.
        batches: the flight as it was sampled.
        density: (bins, 3) of its samples.
        start: an examination of it, whose noise and timing are where each is looked for first.
        levels: (3,) each; the search begins at the likeliest.
    """

    def examined(level: Array, start: Examination, averaging: Sequence[bool]) -> Examination:
        made = levelled(batches, density, level)
        about = NoiseLevel(level)
        found = (asked.levelled(made, about, start, averaging=way) for way in averaging)
        return max(found, key=_likelihood)

    # An average that is found beside all of the noise has been found for its sake.
    tried = [(examined(level, start, AFRESH), level) for level in levels]
    best, level = max(tried, key=lambda found: _likelihood(found[0]))
    for _ in range(MOST_STEPS):
        step, worth = _step(best)
        if worth < WORTH_A_SEARCH:
            break
        level = level * np.exp(step)
        made, before = examined(level, best, EITHER), best
        best = max(best, made, key=_likelihood)
        if best.log_likelihood < before.log_likelihood + WORTH_A_SEARCH:
            break
    return best


def _step(made: Examination) -> tuple[Array, float]:
    """(3,) by which the logarithms of the levels are off, and what that is worth in likelihood."""
    found, at = made.found(), made.model.slices[NoiseLevel.name]
    step = found.theta[at]
    worth = 0.5 * float(step @ np.linalg.solve(found.covariance[at, at], step))
    return np.clip(step, -FURTHEST, FURTHEST), worth


def _likelihood(made: Examination) -> float:
    """Of what the receiver measured."""
    return made.log_likelihood
