"""The examiner: has every flight diagnosed before anything of it may be written.

It lives on the learner's thread.  A diagnosis goes several times over the flight that is kept
and costs some seconds: it is made after the landing, one accelerometer at a time, so that what
comes over the link is taken in between.  Where small steps may be written in flight it is made
in flight, too, as seldom as the budget asks.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Iterable

import msgspec
import numpy as np

from onboard.answer import answer, diagnosed
from onboard.core.calibrator import Calibrator
from onboard.core.diagnosis import since_reboot
from onboard.core.findings import Diagnosis
from onboard.explain_document import explain_document
from onboard.push.physics import Diagnosed

logger = logging.getLogger(__name__)

IN_FLIGHT_SHARE = 0.02
"""Of a core: after a diagnosis in flight that took 5 s, the next one is due 250 s later."""


class Examiner:
    """Diagnoses the accelerometers that wait for it; ``clock`` is monotonic, s.

    ``diagnosed`` is what was found on the last flight (in flight: so far), by accelerometer.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self.autopilot = "ardupilot"
        self.diagnosed: dict[int, Diagnosed] = {}
        self.waiting: tuple[int, ...] = ()
        self.counters: Counter[str] = Counter()
        self._clock = clock
        self._not_before = -np.inf

    def took_off(self) -> None:
        """A flight begins: what was found on the one before is not about it."""
        self.diagnosed = {}
        self.waiting = ()

    def landed(self, imus: Iterable[int]) -> None:
        """A flight has ended."""
        self.diagnosed = {}
        self.waiting = tuple(imus)

    def flying(self, calibrator: Calibrator, imus: Iterable[int]) -> None:
        """In flight, and these could be written now, if they are diagnosed."""
        if not self.waiting and self._clock() >= self._not_before:
            self.waiting = tuple(imu for imu in imus if imu in calibrator.imus)

    def examine_next(self, calibrator: Calibrator) -> None:
        """Diagnose the first accelerometer that waits; the calibrator stays as it is."""
        if not self.waiting:
            return
        imu, *rest = self.waiting
        self.waiting = tuple(rest)
        began = self._clock()
        try:
            given = answer(calibrator, imu, latest=True)
            document = msgspec.to_builtins(self._document(calibrator, given.diagnosis))
            self.diagnosed[imu] = diagnosed(given, document)
        except (ArithmeticError, LookupError, ValueError) as error:  # numbers no model fits
            self.counters["diagnosis_failed"] += 1
            logger.warning("IMU %d: the flight could not be diagnosed: %s", imu, error)
        self.counters["diagnoses"] += 1
        took = self._clock() - began
        self._not_before = began + took / IN_FLIGHT_SHARE

    def _document(self, calibrator: Calibrator, found: Diagnosis) -> msgspec.Struct:
        chunks = since_reboot(calibrator.engine(found.imu).chunks)
        return explain_document(
            found,
            files=(),
            autopilot=self.autopilot,
            duration_s=sum(c.duration for c in chunks),
            samples={
                "imu": sum(len(c.stretch.t) for c in chunks),
                "gps": sum(len(c.fixes) for c in chunks),
            },
        )
