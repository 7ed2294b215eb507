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
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.segments import Segment, Signal
from onboard.core.maths.arrays import Array
from onboard.core.model.around import Around
from onboard.core.model.quadrature import Intervals, OfSensors, Signals
from onboard.core.model.spread import Spread
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
        taken_off: (k,) of its unknowns what has been taken off the samples, from which these count;
            None: nothing.
    """

    name: str = ""
    instead_of: str = ""
    is_averaged: ClassVar[bool] = True
    is_read: ClassVar[bool] = True
    goes_below: ClassVar[tuple[str, ...]] = ()
    unknowns: tuple[Unknown, ...] = ()
    taken_off: Array | None = None

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

    def gained(self, intervals: Intervals, of: OfSensors) -> Array | None:  # noqa: ARG002
        """(K, 2, 3, m) integrals of its acceleration, once and twice: :class:`SegmentRegressors`.

        Of an acceleration that is made of what is integrated anyway, which saves what it is at
        every node; None: it is integrated node by node.

        Args:
            intervals: K of them.
            of: integrals of what every model asks of the sensors.
        """
        return None

    def turned(self, of: OfSensors) -> Array | None:  # noqa: ARG002
        """(K, 3, m) integral of its rate, likewise."""
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

    They are made where the filter takes them from: stacks as of
    :mod:`onboard.core.filter.innovations`, whose column 0 is what is known.

    Attributes:
        gained: (K, 9, m + 1) three vectors in body axes of the interval's start per unit: velocity
            gained, m/s, the same integrated to the interval's end, m, and turn of the attitude,
            rad.
        body: (K + 1, 9, m + 1) direct to the GPS velocity, m/s per unit, to the GPS position, m,
            and to the recorded attitude, rad: body axes.
        ned: (K + 1, 9, m) the same in NED.
        along_velocity: (K + 1, m) of the position as multiples of the velocity, s per unit.
        of_sensors: integrals of what every model asks of the sensors.
        acting: (c,) unknowns that act in NED; the columns of all others are zero.
    """

    gained: Array
    body: Array
    ned: Array
    along_velocity: Array
    of_sensors: OfSensors
    acting: NDArray[np.int64]

    @property
    def force1(self) -> Array:
        """(K, 3, m) velocity gained, body axes of the interval's start, m/s per unit."""
        return self.gained[:, 0:3, 1:]

    @property
    def force2(self) -> Array:
        """(K, 3, m) the same integrated to the interval's end, m per unit."""
        return self.gained[:, 3:6, 1:]

    @property
    def turn(self) -> Array:
        """(K, 3, m) turn of the attitude, body axes of the interval's start, rad per unit."""
        return self.gained[:, 6:9, 1:]

    @property
    def velocity_body(self) -> Array:
        """(K + 1, 3, m) direct to the GPS velocity, body axes, m/s per unit."""
        return self.body[:, 0:3, 1:]

    @property
    def position_body(self) -> Array:
        """(K + 1, 3, m) direct to the GPS position, body axes, m per unit."""
        return self.body[:, 3:6, 1:]

    @property
    def attitude_body(self) -> Array:
        """(K + 1, 3, m) direct to the recorded attitude, body axes, rad per unit."""
        return self.body[:, 6:9, 1:]

    @property
    def velocity_ned(self) -> Array:
        """(K + 1, 3, m) as :attr:`velocity_body`, in NED."""
        return self.ned[:, 0:3]

    @property
    def attitude_ned(self) -> Array:
        """(K + 1, 3, m) as :attr:`attitude_body`, in NED."""
        return self.ned[:, 6:9]


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
        taken_off: (m,) what has been taken off the samples of each.
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
        self.taken_off = np.zeros(at)
        for family in self.families:
            if family.taken_off is not None:
                self.taken_off[self.slices[family.name]] = family.taken_off

    def whole(self, theta: Array) -> Array:
        """Unknowns (m,) as errors of the recording: with what was taken off its samples."""
        out: Array = theta + self.taken_off
        return out

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
        out[mine] = theta[theirs] + other.taken_off[theirs] - self.taken_off[mine]
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
        return segment.with_slow(segment.slow | remembered) if remembered else segment

    def regressors(self, intervals: Intervals, around: Around) -> SegmentRegressors:
        """Evaluate every family on one segment."""
        m, K, epochs = self.size, len(intervals.duration), len(around.now.t)
        gained, body = np.zeros((K, 9, m + 1)), np.zeros((epochs, 9, m + 1))
        ned, along = np.zeros((epochs, 9, m)), np.zeros((epochs, m))
        of = intervals.of_sensors()
        accelerations = _Accelerations(intervals, of, around.spread, gained, body)
        for family in self.families:
            if not family.available(around.now):
                continue
            s = self.slices[family.name]
            columns = slice(s.start + 1, s.stop + 1)
            accelerations.add(family, columns)
            turn = family.turned(of)
            if turn is not None:
                gained[:, 6:9, columns] = turn
            elif (w := family.rate(intervals.signals)) is not None:
                gained[:, 6:9, columns] = intervals.integrals(w)[0]
            for first, d in (
                (0, family.velocity(around)),
                (3, family.position(around)),
                (6, family.attitude(around)),
            ):
                if d.body is not None:
                    body[:, first : first + 3, columns] += d.body
                if d.ned is not None:
                    ned[:, first : first + 3, s] = d.ned
                if d.along_velocity is not None:
                    along[:, s] = d.along_velocity
        accelerations.spread_out()
        acting = np.flatnonzero((ned != 0.0).any(axis=(0, 1)))
        return SegmentRegressors(gained, body, ned, along, of, acting)


class _Accelerations:
    """What accelerations of families gain, and what a receiver makes of that, in their columns."""

    def __init__(
        self,
        intervals: Intervals,
        of: OfSensors,
        spread: Spread | None,
        gained: Array,
        body: Array,
    ) -> None:
        """Take where they are asked for, and what they are written to.

        Args:
            intervals: K of them.
            of: integrals over these of what every model asks of the sensors.
            spread: what a receiver makes of accelerations; None if it averages over nothing.
            gained: (K, 9, m + 1) stack of what is gained.
            body: (K + 1, 9, m + 1) stack of what a receiver reports.
        """
        self._intervals, self._of, self._spread = intervals, of, spread
        self._gained, self._body = gained, body
        self._both: Signals | None = None
        self._columns: list[int] = []
        self._seen: list[Array] = []

    def add(self, family: Family, columns: slice) -> None:
        """Integrate the acceleration of a family, and keep what a receiver averages of it."""
        out, spread = self._gained[:, :, columns], self._spread if family.is_averaged else None
        known = family.gained(self._intervals, self._of)
        if known is not None:
            out[:, 0:3], out[:, 3:6] = known[:, 0], known[:, 1]
            seen = None if spread is None else family.acceleration(spread.nodes)
        else:
            a, seen = self._at_all_nodes(family, spread)
            if a is not None:
                self._intervals.integrate(a, out[:, 0:3], out[:, 3:6])
        if seen is not None:
            self._columns += range(columns.start, columns.stop)
            self._seen.append(seen)

    def _at_all_nodes(
        self, family: Family, spread: Spread | None
    ) -> tuple[Array | None, Array | None]:
        """Acceleration at the nodes of the intervals, and at those of what is averaged.

        Asked for at once: there are so few that some of them take as long as all.
        """
        own = self._intervals.signals
        if spread is None:
            return family.acceleration(own), None
        if self._both is None:
            self._both = own.and_at(spread.nodes)
        a = family.acceleration(self._both)
        if a is None:
            return None, None
        return a[: own.t.size].reshape(*own.t.shape, 3, -1), a[own.t.size :]

    def spread_out(self) -> None:
        """Add what a receiver makes of all of them, at once."""
        if self._seen and self._spread is not None:
            there = np.concatenate(self._seen, axis=-1)
            self._seen.clear()
            self._spread.add(there, np.array(self._columns), self._body)
