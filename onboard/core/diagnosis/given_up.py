"""Flight in which the autopilot's filter gave its receiver up: which of the two was wrong.

That filter leans on the accelerometers.  Where one jumps by a third of gravity, what the receiver
says is far from what it expects, and it complains of the receiver; so its complaint is no reason
not to hear the receiver.  An error of the receiver is asked first
(:mod:`~onboard.core.diagnosis.receiver_errors`).  Where none explains these velocities, and they
are far from what the accelerometer makes of the flight before, the flight is examined once more
with them.  A model that most of them fit, and that does not contradict itself, stands: no error of
a receiver is, in all the directions that a vehicle turns to, what an offset of its accelerometer
would make of it.  Else the numbers are those of the flight before, and of no use for what is flown
now.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.records import Unused
from onboard.core.diagnosis.refusals import Refused, contradicted, refused
from onboard.core.diagnosis.screening import heard
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.gps.distrust import Distrust
from onboard.core.inputs.segments import Batch

ACCUSED: Final = frozenset({Distrust.EKF_GPS_GLITCH, Distrust.EKF_UNHEALTHY})
"""Complaints of a filter that leans on the accelerometers; what a receiver says of itself it does
not say because of them."""


class GivenUp:
    """The part of a flight for which the autopilot's filter gave its receiver up.

    Attributes:
        stretches: that part, s on the boot clock.
    """

    def __init__(self, calibrator: Calibrator, flight: Sequence[Batch], t0: float) -> None:
        """Take the flight, and s on the boot clock from which times count."""
        every = refused(flight, calibrator.trust.refusals)
        self.stretches: tuple[Refused, ...] = tuple(r for r in every if r.reason in ACCUSED)
        self._t0 = t0

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self.stretches)

    def heard(self, flight: Sequence[Batch]) -> list[Batch]:
        """The flight with the receiver believed there."""
        return heard(flight, self.stretches)

    def contradicted(self, made: Examination) -> tuple[Unused, ...]:
        """Where velocities are far from a model, as its gates judge them; s since ``t0``.

        Args:
            made: gone through with the receiver believed.
        """
        far = contradicted(made.batches, made.refused_velocities(), None, self._t0)
        spans = [(r.start - self._t0, r.end - self._t0) for r in self.stretches]
        return tuple(u for u in far if any(a < u.end_s and b > u.start_s for a, b in spans))

    def gone_through(self, final: Examination) -> Examination:
        """A model with the receiver believed there, from where it has come to: its gates judge."""
        batches = self.heard(final.as_read)
        made = Examination(
            final, final.families, t0=final.point.skew_from, batches=batches, start=final
        )
        made.once()
        return made

    def believed(self, full: Examination) -> Examination:
        """Everything that is asked of a flight, of one with the receiver believed there."""
        batches = self.heard(full.as_read)
        return Examination(
            full, full.families, t0=full.point.skew_from, batches=batches, start=full
        ).with_noise()
