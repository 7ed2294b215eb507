"""Regressors: how each unknown enters what is measured.

A *family* is a few unknowns of one piece of physics.  It says, for one unit of each unknown, what
it adds to the predicted measurement, by any of these ways (all linear):

``acceleration``  a specific force in body axes at every node: integrated once into velocity and
                  twice into height;
``rate``          an angular rate in body axes at every node: turns the attitude, and through it
                  the specific force;
``velocity``      directly to the GPS velocity: part in body axes of the epoch, part in NED;
``position``      directly to the GPS position (only height is used), body part, NED part, and a
                  multiple of the velocity itself (delays);
``attitude``      directly to the recorded attitude (rotation vector, NED): body part, NED part.

The prediction is that of what the autopilot *recorded*; unknowns are errors of the recording
(effects: ``measured = true + ...``), so an acceleration error enters with a minus sign.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from onboard.core.inputs.segments import Segment, Signal
from onboard.core.maths.arrays import Array
from onboard.core.model.around import Around
from onboard.core.model.quadrature import Intervals, Signals
from onboard.errors import OnboardError


@dataclass(frozen=True, slots=True)
class Unknown:
    """One unknown: its name, unit, prior mean and prior standard deviation (all SI)."""

    name: str
    unit: str
    prior: float
    prior_sigma: float


@dataclass(frozen=True, slots=True)
class Direct:
    """Direct contributions at K epochs, m unknowns; None means no contribution.

    ``body`` and ``ned`` are (K, 3, m); ``along_velocity`` is (K, m), a factor of the velocity.
    """

    body: Array | None = None
    ned: Array | None = None
    along_velocity: Array | None = None


NOTHING = Direct()


class Family:
    """A piece of physics: unknowns and their regressors.  Subclasses override what applies.

    Attributes:
        name: of the family, unique in a model.
        unknowns: in the order of their regressors.
        instead_of: name of a nuisance that has the same regressors and gives way to this family.
        is_averaged: whether a receiver averages what its acceleration gains; not where that is in
            the response to the linearisation's force already, or a straight line.
        is_read: whether its acceleration is of what the accelerometer reads; not where it is that
            of gravity, or what an attitude that is off makes of the force.
        goes_below: unknowns of every model that are it with the other sign, and may be below
            their range beside it.
    """

    name: str = ""
    instead_of: str = ""
    is_averaged: ClassVar[bool] = True
    is_read: ClassVar[bool] = True
    goes_below: ClassVar[tuple[str, ...]] = ()
    unknowns: tuple[Unknown, ...] = ()

    @property
    def never_negative(self) -> tuple[str, ...]:
        """Names of unknowns that cannot be negative, by a law of nature."""
        return ()

    @property
    def alike(self) -> Array | None:
        """(3,) sigma, m/s^2, sensor axes, of what it takes for beta in all flights of the sensor.

        No flight tells it, and it is the same in each: None, if there is nothing of it.
        """
        return None

    def available(self, nodes: Signals) -> bool:  # noqa: ARG002 - subclasses look at the signals
        """True if the recording has the signals that the regressors need."""
        return True

    def remembers(self, segment: Segment, before: Signal | None) -> Signal | None:  # noqa: ARG002
        """A signal of this segment that depends on what was before it: an effect with a memory.

        It is looked up at nodes like any slow signal, under the name of the family.

        Args:
            segment: samples; segments overlap, so that ``before`` has a value at its start.
            before: the signal over the segment before, None after a gap.

        Returns:
            Times (j,) and values (j,) or (j, k).
        """
        return None

    def acceleration(self, nodes: Signals) -> Array | None:  # noqa: ARG002
        """(K, M + 1, 3, m) body axes, m/s^2 per unit; added to the predicted specific force."""
        return None

    def rate(self, nodes: Signals) -> Array | None:  # noqa: ARG002
        """(K, M + 1, 3, m) body axes, rad/s per unit; added to the true angular rate."""
        return None

    def velocity(self, around: Around) -> Direct:  # noqa: ARG002
        """Added to the predicted GPS velocity, m/s per unit."""
        return NOTHING

    def position(self, around: Around) -> Direct:  # noqa: ARG002
        """Added to the predicted GPS position (NED), m per unit."""
        return NOTHING

    def attitude(self, around: Around) -> Direct:  # noqa: ARG002
        """Added to the recorded attitude, rotation vector in NED, rad per unit."""
        return NOTHING


@dataclass(frozen=True, slots=True)
class SegmentRegressors:
    """Regressors of K intervals (index k: from epoch k to k + 1) and K + 1 epochs, m unknowns.

    Attributes:
        force1: (K, 3, m) velocity gained, body axes of the interval's start, m/s per unit.
        force2: (K, 3, m) the same integrated to the interval's end, m per unit.
        turn: (K, 3, m) turn of the attitude, body axes of the interval's start, rad per unit.
        velocity_body: (K + 1, 3, m) direct to the GPS velocity, body axes, m/s per unit.
        velocity_ned: (K + 1, 3, m) the same in NED.
        position_body: (K + 1, 3, m) direct to the GPS position, body axes, m per unit.
        position_ned: (K + 1, 3, m) the same in NED.
        along_velocity: (K + 1, m) the same as multiples of the velocity, s per unit.
        attitude_body: (K + 1, 3, m) direct to the recorded attitude, body axes, rad per unit.
        attitude_ned: (K + 1, 3, m) the same in NED.
    """

    force1: Array
    force2: Array
    turn: Array
    velocity_body: Array
    velocity_ned: Array
    position_body: Array
    position_ned: Array
    along_velocity: Array
    attitude_body: Array
    attitude_ned: Array


class Model:
    """An ordered set of families: which unknown is whose.

    Attributes:
        families: in order.
        unknowns: of all families, m, numbered in their order.
        slices: of the unknowns, by the name of their family.
        size: m.
        index: of an unknown, by its name.
        prior: (m,) means before the flight, each in its unit.
        prior_sigma: (m,) standard deviations of them.
    """

    def __init__(self, families: Sequence[Family]) -> None:
        """Take the families; their unknowns are numbered in this order.

        Raises:
            OnboardError: one has no unknowns (a jump without its moment, a product without its
                signals), so nothing of it can be estimated.
        """
        empty = [f.name or type(f).__name__ for f in families if not f.unknowns]
        if empty:
            raise OnboardError(f"nothing can be estimated of {', '.join(empty)}: no unknowns")
        self.families = tuple(families)
        self.unknowns = tuple(u for f in self.families for u in f.unknowns)
        self.slices: dict[str, slice] = {}
        at = 0
        for family in self.families:
            self.slices[family.name] = slice(at, at + len(family.unknowns))
            at += len(family.unknowns)
        self.size = at
        self.index = {u.name: i for i, u in enumerate(self.unknowns)}
        self.prior = np.array([u.prior for u in self.unknowns])
        self.prior_sigma = np.array([u.prior_sigma for u in self.unknowns])

    def taken_over(self, other: Model, theta: Array, covariance: Array) -> tuple[Array, Array]:
        """An estimate of another model's unknowns as one of these, by their names.

        Args:
            other: the model, of k unknowns.
            theta: (k,) estimate.
            covariance: (k, k) of it.

        Returns:
            (m,) and (m, m); what the other model does not have is as its prior has it.
        """
        mine = [i for i, u in enumerate(self.unknowns) if u.name in other.index]
        theirs = [other.index[self.unknowns[i].name] for i in mine]
        out, spread = self.prior.copy(), np.diag(self.prior_sigma**2)
        out[mine] = theta[theirs]
        spread[np.ix_(mine, mine)] = covariance[np.ix_(theirs, theirs)]
        return out, spread

    def remembering(self, segment: Segment, before: Mapping[str, Signal]) -> Segment:
        """The segment with what families remember among its slow signals.

        Args:
            segment: samples.
            before: slow signals of the segment before; empty after a gap.
        """
        remembered = {
            f.name: signal
            for f in self.families
            if (signal := f.remembers(segment, before.get(f.name))) is not None
        }
        return replace(segment, slow=segment.slow | remembered) if remembered else segment

    def regressors(self, intervals: Intervals, around: Around) -> SegmentRegressors:
        """Evaluate every family on one segment."""
        m, epochs = self.size, len(around.now.t)
        force1, force2, turn = (np.zeros((len(intervals.duration), 3, m)) for _ in range(3))
        direct = {key: np.zeros((epochs, 3, m)) for key in ("vb", "vn", "pb", "pn", "ab", "an")}
        along = np.zeros((epochs, m))
        for family in self.families:
            s = self.slices[family.name]
            if not family.available(around.now):
                continue
            a = family.acceleration(intervals.signals)
            if a is not None:
                force1[..., s], force2[..., s] = intervals.integrals(a)
                if family.is_averaged and around.spread is not None:
                    there = family.acceleration(around.spread.nodes)
                    if there is not None:
                        direct["vb"][..., s], direct["pb"][..., s] = around.spread.of(there)
            w = family.rate(intervals.signals)
            if w is not None:
                turn[..., s] = intervals.integrals(w)[0]
            for key, d in (
                ("v", family.velocity(around)),
                ("p", family.position(around)),
                ("a", family.attitude(around)),
            ):
                if d.body is not None:
                    direct[key + "b"][..., s] += d.body
                if d.ned is not None:
                    direct[key + "n"][..., s] = d.ned
                if d.along_velocity is not None:
                    along[:, s] = d.along_velocity
        return SegmentRegressors(
            force1,
            force2,
            turn,
            direct["vb"],
            direct["vn"],
            direct["pb"],
            direct["pn"],
            along,
            direct["ab"],
            direct["an"],
        )
