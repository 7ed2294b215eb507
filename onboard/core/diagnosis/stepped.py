"""A flight gone through once with a jump at each of many moments, for what each explains.

From its moment on a jump is an offset with the sign changed; before it, it is nothing.  So nothing
has to be evaluated for it: what the offsets add in each step of prediction is taken, and of the
step in which it jumps the share that is left of it.  What tells it is forgotten after a while; from
then on its columns in the sums are the offsets' own, and its place in the model is another jump's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from onboard.core.diagnosis.block_jumps import OFFSETS
from onboard.core.diagnosis.effort import FORGOTTEN_S
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.selection import Fitter
from onboard.core.estimate.calibration_model import calibration_model
from onboard.core.estimate.going_through import through
from onboard.core.filter.passes import Pass
from onboard.core.filter.preparations import Kept, Source
from onboard.core.filter.prepared import Prepared
from onboard.core.filter.whitening import Uses
from onboard.core.inputs.segments import Batch, Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block, total
from onboard.core.maths.sums import NormalSums
from onboard.core.model.nuisances import AXIS
from onboard.core.model.regressors import Family, Model, Unknown
from onboard.core.physics.effects.bias_step import LARGEST


class Places(Family):
    """Unknowns of jumps that are under way; what they add is written by :func:`jumping`."""

    name = "jumps"

    def __init__(self, count: int) -> None:
        """Take how many there are at once."""
        self.unknowns = tuple(
            Unknown(f"jump_{i}_{a}", "m/s^2", 0.0, LARGEST) for i in range(count) for a in AXIS
        )


class Stepped:
    """What one pass over a flight says of jumps at J moments, each beside nothing else.

    Attributes:
        gain: (J,) fall of chi-square by each.
        known: (J, 3) what the sums know of its size along each axis, the rest unknown.
    """

    def __init__(self, full: Examination, moments: Sequence[float]) -> None:
        """Go through the flight of ``full``, whose moments (s, in order) are asked for."""
        self._moments = np.asarray(moments)
        self._offsets = list(OFFSETS)
        places = self._places(full.batches)
        count = max((len(now) for now in places), default=0)
        model = calibration_model(
            full.point, full.prior, full.settings.needs, (*full.carried, Places(max(count, 1)))
        )
        self._m = m = model.slices[Places.name].start
        self._sums = NormalSums.zeros(m)
        J = len(self._moments)
        self._cross, self._own, self._b = np.zeros((J, 3, m)), np.zeros((J, 3, 3)), np.zeros((J, 3))
        self._since = np.zeros((J, 3, m + 1))
        self._go_through(full, model, places)
        self._go_on(full.batches[0].segment.R_bs)
        self.gain, self.known = self._fitted(model)

    def _places(self, batches: Sequence[Batch]) -> list[dict[int, int]]:
        """For each batch the jumps that are under way, by number, and which place each has."""
        out: list[dict[int, int]] = []
        now: dict[int, int] = {}
        begun = 0
        for batch in batches:
            first, last = float(batch.fixes.t[0]), float(batch.fixes.t[-1])
            now = {j: p for j, p in now.items() if first <= self._moments[j] + FORGOTTEN_S}
            while begun < len(self._moments) and self._moments[begun] <= last:
                now[begun] = next(p for p in range(len(now) + 1) if p not in now.values())
                begun += 1
            out.append(dict(now))
        return out

    def _go_through(self, full: Examination, model: Model, places: list[dict[int, int]]) -> None:
        """Add up each batch: the calibration's columns, and those of the jumps under way."""
        going = JumpingPass(full, model)
        before: dict[int, int] = {}
        for batch, now in zip(full.batches, places, strict=True):
            for j in before.keys() - now.keys():
                self._ended(j)
            columns = {j: self._m + 3 * place for j, place in now.items()}
            for j in now.keys() - before.keys():
                going.begin(columns[j])
            going.jumps = [(columns[j], float(self._moments[j])) for j in now]
            sums = through(going, batch, full.settings.coast_s).block.sums
            self._sums += sums.subset(range(self._m))
            for j, at in columns.items():
                mine = slice(at, at + 3)
                self._cross[j] += sums.N[mine, : self._m]
                self._own[j] += sums.N[mine, mine]
                self._b[j] += sums.b[mine]
            before = now
        for j in before:
            self._ended(j)

    def _ended(self, j: int) -> None:
        """Where the sums of the offsets are when those of a jump end."""
        self._since[j, :, :-1] = self._sums.N[self._offsets]
        self._since[j, :, -1] = self._sums.b[self._offsets]

    def _go_on(self, R_bs: Array) -> None:
        """From where its own sums end, a jump is what its sensor reads too much: an offset less."""
        all_ = np.column_stack([self._sums.N[self._offsets], self._sums.b[self._offsets]])
        rest = -R_bs @ (all_ - self._since)
        self._cross += rest[:, :, :-1]
        self._own -= rest[:, :, self._offsets] @ R_bs.T
        self._b += rest[:, :, -1]

    def _fitted(self, model: Model) -> tuple[Array, Array]:
        """Gain (J,) and information (J, 3) of each jump, from normal equations with it."""
        m, sums = self._m, self._sums
        prior, mean = model.prior_sigma[:m] ** -2.0, model.prior[:m]
        inverse = np.linalg.inv(sums.signal + np.diag(prior))
        alone = inverse @ (sums.b + prior * mean)
        cross = self._cross @ inverse
        S = self._own + np.eye(3) / LARGEST**2 - cross @ self._cross.swapaxes(1, 2)
        size = np.linalg.solve(S, (self._b - self._cross @ alone)[..., None])[..., 0]
        theta = alone - (size[:, None] @ cross)[:, 0]

        def chi2(theta: Array) -> Array:
            """(J,) of the other unknowns (J, m) without the jump, up to what does not change."""
            off = theta - mean
            out: Array = np.sum(theta * (theta @ sums.N - 2.0 * sums.b) + prior * off**2, axis=-1)
            return out

        beside = self._b - (self._cross @ theta[..., None])[..., 0]
        own = (self._own @ size[..., None])[..., 0] + size / LARGEST**2
        gain = chi2(alone) - chi2(theta) + np.sum(size * (2.0 * beside - own), axis=-1)
        return gain, np.einsum("jii->ji", S)


class JumpingPass(Pass):
    """A pass with jumps under way; gates and attitude follow what is known without them.

    Attributes:
        jumps: the first unknown and the moment (s) of each.
    """

    def __init__(self, full: Examination, model: Model) -> None:
        theta, covariance = known_without(full, model)
        uses = Uses(height=full.uses.height)
        super().__init__(
            model, full.point, (full.noise,), uses=uses, theta=theta, covariance=covariance
        )
        self.keep_states = False
        self.bias_b = full.bias_b
        self.jumps: list[tuple[int, float]] = []

    def begin(self, column: int) -> None:
        """A jump begins in a place that another one may have had."""
        self.filter.carried[:, :, 1 + column : 4 + column] = 0.0

    def made_anew(self, source: Source, segment: Segment) -> Kept:
        """With the columns of the jumps under way."""
        made = super().made_anew(source, segment)
        jumping(made.ready, self.jumps, segment.R_bs)
        return made


def jumping(ready: Prepared, jumps: Sequence[tuple[int, float]], R_bs: Array) -> None:
    """Write the columns of jumps into a segment that is ready.

    Args:
        ready: with the calibration's own columns first.
        jumps: place of the first unknown, and moment, s on the boot clock.
        R_bs: (3, 3) board orientation.
    """
    steps = ready.steps
    # The offsets' columns are along the sensor's axes, and what is added to a reading.
    stays = -steps.columns[:, :, 1 + OFFSETS[0] : 2 + OFFSETS[-1]] @ R_bs.T
    ends = ready.start + np.cumsum(steps.duration)
    for column, moment in jumps:
        left = np.clip((ends - moment) / steps.duration, 0.0, 1.0)[:, None, None]
        at = slice(1 + column, 4 + column)
        steps.columns[:, 0:3, at] = left * stays[:, 0:3]
        steps.columns[:, 3:6, at] = left**2 * stays[:, 3:6]


def known_without(full: Examination, model: Model) -> tuple[Array, Array]:
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
