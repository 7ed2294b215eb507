"""Flight in which the autopilot's filter gave its receiver up: which of the two was wrong.

That filter leans on the accelerometers.  Where one jumps by a third of gravity, what the receiver
says is far from what it expects, and it complains of the receiver; so its complaint is no reason
not to hear the receiver.  Errors of the receiver are asked first
(:mod:`~onboard.core.diagnosis.receiver_errors`).  Where they do not explain these velocities, and
these are far from what the accelerometer makes of the flight before, the flight is examined once
more with all of them.  A model that most of them fit, and that does not contradict itself, stands:
no error of a receiver is, in all the directions that a vehicle turns to, what an offset of its
accelerometer would make of it.  Else the numbers are those of the flight before, and of no use for
what is flown now.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from onboard.core.diagnosis.cleared import Cleared
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.records import Unused
from onboard.core.diagnosis.refusals import Refused, contradicted, overlaps, refused
from onboard.core.diagnosis.screening import heard, unbelieved
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.engine import Engine
from onboard.core.gps.distrust import Distrust
from onboard.core.model.ekf_misled import EkfMisled

ACCUSED: Final = frozenset({Distrust.EKF_GPS_GLITCH, Distrust.EKF_UNHEALTHY})
"""Complaints of a filter that leans on the accelerometers; what a receiver says of itself it does
not say because of them."""


class GivenUp:
    """The part of a flight for which the autopilot's filter gave its receiver up.

    Attributes:
        stretches: that part, s on the boot clock.
    """

    def __init__(self, calibrator: Calibrator, clear: Cleared, t0: float) -> None:
        """Take the flight without what must not be fitted; s on the boot clock of times' zero."""
        every = refused(clear.sampled, calibrator.trust.refusals)
        self.stretches: tuple[Refused, ...] = tuple(r for r in every if r.reason in ACCUSED)
        self._clear, self._t0 = clear, t0

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self.stretches)

    def contradicted(self, made: Examination) -> tuple[Unused, ...]:
        """Where velocities are far from a model, as its gates judge them; s since ``t0``.

        Args:
            made: gone through with the receiver believed.
        """
        far = contradicted(made.batches, made.refused_velocities(), None, self._t0)
        spans = [(r.start - self._t0, r.end - self._t0) for r in self.stretches]
        return tuple(u for u in far if overlaps(u.start_s, u.end_s, spans))

    def gone_through(self, final: Examination) -> Examination:
        """A model with the receiver believed there, but for what is known to be false of it.

        It begins where it has come to; its gates judge.
        """
        batches = heard(final.as_read, self.stretches)
        if (fault := self._clear.fault) is not None:
            batches = unbelieved(final, batches, fault, self._t0)
        made = Examination(
            final, final.families, t0=final.point.skew_from, batches=batches, start=final
        )
        made.once()
        return made

    def believed(self, like: Engine) -> Cleared:
        """The flight with the receiver believed there, and nothing false of it; its sums are made.

        Args:
            like: the accelerometer's engine.
        """
        clear, full = self._clear, self._clear.full
        sampled = heard(clear.sampled, self.stretches)
        pairs = zip(full.as_read, sampled, strict=True)
        made = Examination(
            like,
            full.families,
            t0=full.point.skew_from,
            batches=[replace(b, trusted=as_sampled.trusted) for b, as_sampled in pairs],
            start=full,
            carried=[f for f in full.carried if not isinstance(f, EkfMisled)],
        ).with_noise()
        return replace(clear, full=made, fault=None, sampled=sampled, heard=self.stretches)
