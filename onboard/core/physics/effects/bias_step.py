"""An offset that jumped."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from onboard.core.inputs.segments import Segment
from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import Unknown
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import Bearing, Cure, Effect, on_axes
from onboard.core.physics.finding import Finding
from onboard.core.physics.wording import jumped

LARGEST = 3.0
"""m/s^2, a sigma: a sensor that jumps by more is broken and not miscalibrated, which is seldom."""

RANGE = 157.0
"""m/s^2; a sensor that breaks may read all that it can, 16 g [data sheet]."""

SHARED_CURE = Cure(
    "look at what all accelerometers share, for each asks for this jump: the mount of "
    "the autopilot, GPS, the compass, a blow"
)
SWITCHED_CURE = Cure(
    "nothing gave way: the correction for temperature (INS_TCALn_ENABLE) was switched then; set it "
    "as it is to stay, and calibrate again"
)


@dataclass(frozen=True, slots=True)
class Witness:
    """What the other accelerometers of the vehicle say of a jump.

    Attributes:
        gain: twice the rise of the log-likelihood of their differences by it.
        places: moments at which it was looked for.
        blame: by how much that is more than by a jump of any other one of them.
        size: (3,) what this one reads too much, m/s^2, if it is this one.
        sigma: (3,) of that.
    """

    gain: float
    places: int
    blame: float
    size: Array
    sigma: Array

    def against(self, size: Array) -> float:
        """What they say against another size (3,), m/s^2: by how much their gain is less.

        The level of their noise is found with it, so that is a logarithm.
        """
        n = self.places
        return float(n * np.sum(np.log1p(((size - self.size) / self.sigma) ** 2 / n)))


class BiasStep(Effect):
    """Offset that jumps at one moment; without one (:meth:`at`) it is no candidate yet."""

    effect = "bias_step"
    code = 11
    title = "The offset jumped"
    sentence = "the offset jumped during the flight"
    meaning = "`time`, s; `x`, `y`, `z`, m/s²"
    bearing = Bearing.NO_ONE_NUMBER
    source = "step in the offset: a shock, a mount that gave way"
    cure = "inspect the mount of the autopilot; recalibrate on the ground"
    apart = "fly on: a step stays"
    of_flight = True
    tilts_ekf = True
    changes_force = True
    response = curves.Response(
        "time",
        "s",
        "offset error",
        "m/s^2",
        curves.time,
        curves.begun,
    )

    witness: Witness | None = None
    """Its prior, where other accelerometers have seen it."""

    def at(self, moment: float, witness: Witness | None = None, sigma: float | None = None) -> Self:
        """The jump at a moment.

        Args:
            moment: s on the boot clock.
            witness: what other accelerometers say of it; None: what was known of that.
            sigma: of the moment, s; None: what was known of that.
        """
        made = copy(self)
        made.onset = moment
        made.onset_sigma = self.onset_sigma if sigma is None else sigma
        made.name = f"bias_step_{moment:.3f}"
        made.take_axes("m/s^2", LARGEST)
        made.plausible = (RANGE,) * 3
        made.witness = witness or self.witness
        if made.witness is not None:
            seen = zip(made.unknowns, made.witness.size, made.witness.sigma, strict=True)
            made.unknowns = tuple(
                Unknown(u.name, u.unit, float(size), min(float(sigma), LARGEST))
                for u, size, sigma in seen
            )
        return made

    @property
    def moment(self) -> float:
        """When it jumped, s on the boot clock.

        Raises:
            ValueError: it has no moment yet.
        """
        if self.onset is None:
            raise ValueError("a jump without its moment")
        return self.onset

    def about(self, size: Array, beside: Sequence[tuple[Effect, Array]] = ()) -> Self:  # noqa: ARG002
        """The same jump, of which ``size`` (3,) is taken off the samples: it counts from there.

        The force that was read turns what an attitude errs by into a velocity.  With a jump of a
        third of gravity in it, a third of that is wrong.
        """
        made = copy(self)
        more = size if self.taken_off is None else size - self.taken_off
        made.taken_off = size
        made.unknowns = tuple(
            replace(u, prior=u.prior - float(x)) for u, x in zip(self.unknowns, more, strict=True)
        )
        return made

    def off_samples(self, segment: Segment, scale: Array) -> Segment:
        """A segment without what is taken off it, by a calibration's scale (3,)."""
        if self.taken_off is None:
            return segment
        after = (segment.t >= self.moment)[:, None]
        raw = segment.raw_s - after * (self.taken_off @ segment.R_bs / scale)
        return replace(segment, raw_s=raw)

    def acceleration(self, nodes: Signals) -> Array:
        """``-e_i`` from the moment on."""
        after = (nodes.t >= self.moment).astype(np.float64)
        return on_axes(after[..., None])

    @classmethod
    def size(cls, found: Finding) -> str:
        """``at 84 s by x 0.31 m/s²``."""
        return jumped(found.unknowns)

    @classmethod
    def condition(cls, found: Finding, offset: float, change: float) -> str:
        """The offset before the jump and after it."""
        t = found.unknowns["time"].value
        return f"{offset:.4f} until {t:.0f} s, {offset + change:.4f} from then on"
