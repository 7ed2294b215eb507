"""A flight made ready once, for jumps at any moment: their columns are those of the offsets.

From its moment on a jump is an offset with the sign changed; before it, it is nothing.  So nothing
has to be evaluated for it: what the offsets add in each step of prediction is taken, and of the
step in which it jumps the share that is left of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from operator import add, sub

import numpy as np
from numpy.typing import NDArray

from onboard.core.diagnosis.block_jumps import OFFSETS
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.selection import Fitter
from onboard.core.estimate.calibration_model import calibration_model
from onboard.core.estimate.solution import total
from onboard.core.filter.passes import Pass
from onboard.core.filter.preparations import Kept, Preparations, Source
from onboard.core.filter.prepared import Prepared
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block
from onboard.core.maths.sums import NormalSums
from onboard.core.model.regressors import Model
from onboard.core.physics.effects.bias_step import BiasStep


class ReadyFlight:
    """The flight of an examination with the calibration's own columns, as far as it is needed."""

    def __init__(self, full: Examination) -> None:
        """Take the flight and its linearisation."""
        model = calibration_model(full.point, full.prior, full.settings.needs, full.carried)
        self._pass = Pass(model, full.point, (full.noise,))
        self._last_bias_b = full.bias_b
        self._place = {_key(b): i for i, b in enumerate(full.batches)}
        self._kept: dict[int, Kept] = {}
        self._known = _known(full, model)
        self._whole = total(full.blocks)
        self._early: list[Block] = []
        self._sums = NormalSums.zeros(full.model.size)

    def known(self, model: Model) -> tuple[Array, Array]:
        """What is known without jumps, (m,) and (m, m), for a model that has them at its end."""
        theta, covariance = model.prior.copy(), np.diag(model.prior_sigma**2)
        n = len(self._known[0])
        theta[:n], covariance[:n, :n] = self._known
        return theta, covariance

    def far(
        self, early: Sequence[Block], near: Sequence[Block], late: Sequence[Block]
    ) -> tuple[NormalSums | None, NormalSums | None]:
        """Sums of the early blocks and of the late ones, which with the near ones are all.

        Moments come in order: what is early is added up once, not for each of them again.
        """
        if [*map(id, early[: len(self._early)])] != [*map(id, self._early)]:
            self._early, self._sums = [], NormalSums.zeros(self._whole.size)
        self._sums = reduce(add, (b.sums for b in early[len(self._early) :]), self._sums)
        self._early = list(early)
        rest = reduce(sub, (b.sums for b in near), self._whole - self._sums)
        return self._sums if early else None, rest if late else None

    def bias_b(self, first: Batch) -> Array:
        """(3,) of the gyroscope, rad/s, about that of a batch."""
        kept = self._kept.get(self._place[_key(first)])
        return self._last_bias_b if kept is None else kept.bias_b

    def forget_before(self, first: Batch) -> None:
        """What was before a batch is not asked for any more."""
        since = self._place[_key(first)]
        self._kept = {i: kept for i, kept in self._kept.items() if i >= since}

    def of(self, source: Source, bias_b: Array) -> Kept | None:
        """A batch made ready with a bias like this; None for one that is not of the flight."""
        i = self._place.get((id(source.segment), id(source.fixes)))
        if i is None or source.skipped:
            return None
        if i not in self._kept or not self._kept[i].serves(bias_b):
            self._pass.bias_b = bias_b
            self._kept[i] = self._pass.made_anew(source, source.segment)
        return self._kept[i]


class WithJumps(Preparations):
    """The same for a pass whose model has jumps after its other unknowns.

    Attributes:
        going: the pass.
    """

    going: Pass

    def __init__(self, flight: ReadyFlight, model: Model, jumps: Sequence[BiasStep]) -> None:
        super().__init__(0)
        self._flight, self._model, self._jumps = flight, model, jumps

    def of(self, source: Source) -> Kept | None:
        """With columns of the jumps."""
        made = self._flight.of(source, self.going.bias_b)
        if made is None:
            return None
        ready = jumping(made.ready, self._model, self._jumps, source.segment.R_bs)
        return replace(made, of=source, ready=ready)


def _known(full: Examination, model: Model) -> tuple[Array, Array]:
    """What the sums of ``full`` say of the unknowns of another model, (m,) and (m, m).

    Of those that it has, without the rest of its own; of others nothing is known.
    """
    source = places_of(full, model)
    mine = np.flatnonzero(source >= 0)
    theirs = source[mine].tolist()
    fitter = Fitter([Block(0.0, 0.0, total(full.blocks))], full.model, full.absent)
    theta, covariance = model.prior.copy(), np.diag(model.prior_sigma**2)
    fit = fitter.fit(theirs, held_out=False)
    theta[mine] = fit.theta[theirs]
    covariance[np.ix_(mine, mine)] = np.linalg.inv(fitter.informed(fit, theirs))
    return theta, covariance


def places_of(full: Examination, model: Model) -> NDArray[np.intp]:
    """(m,) where the unknowns of another model are among those of ``full``; -1: nowhere."""
    source = np.array([full.model.index.get(u.name, -1) for u in model.unknowns])
    for family in full.model.families:
        if family.instead_of in model.slices:
            theirs = full.model.slices[family.name]
            source[model.slices[family.instead_of]] = range(theirs.start, theirs.stop)
    return source


def _key(batch: Batch) -> tuple[int, int]:
    return id(batch.segment), id(batch.fixes)


def jumping(ready: Prepared, model: Model, jumps: Sequence[BiasStep], R_bs: Array) -> Prepared:
    """What is ready, with the columns of jumps after those that are there.

    Args:
        ready: with the calibration's own columns first.
        model: with the jumps after what those columns are of.
        jumps: some moments, s on the boot clock.
        R_bs: (3, 3) board orientation.
    """
    steps, epochs, m1 = ready.steps, ready.epochs, model.size + 1
    known = steps.columns.shape[2]
    columns = np.zeros((len(steps), 9, m1))
    columns[:, :, :known] = steps.columns
    first, last = 1 + OFFSETS[0], 1 + OFFSETS[-1]
    # The offsets' columns are along the sensor's axes, and what is added to a reading.
    stays = -steps.columns[:, :, first : last + 1] @ R_bs.T
    ends = ready.start + np.cumsum(steps.duration)
    for jump in jumps:
        at = model.slices[jump.name]
        left = np.clip((ends - jump.moment) / steps.duration, 0.0, 1.0)[:, None, None]
        columns[:, 0:3, at.start + 1 : at.stop + 1] = left * stays[:, 0:3]
        columns[:, 3:6, at.start + 1 : at.stop + 1] = left**2 * stays[:, 3:6]

    def wider(x: Array, width: int) -> Array:
        out = np.zeros((*x.shape[:-1], width))
        out[..., : x.shape[-1]] = x
        return out

    return Prepared(
        replace(steps, columns=columns),
        ready.measured,
        replace(
            epochs,
            body=wider(epochs.body, m1),
            ned=wider(epochs.ned, m1),
            along_velocity=wider(epochs.along_velocity, m1 - 1),
        ),
    )
