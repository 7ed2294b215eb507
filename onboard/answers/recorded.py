"""A recording as one flight that is asked once: behind replay, explain and fleet.

What is read is only kept and cut into segments; timing and noise are the diagnosis' own, and
estimating them while reading would be done twice.  Recordings that are explained together are one
flight, each following on the one before; a replay of several has one of these for each
(:mod:`onboard.answers.flights`).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from onboard.answers.answer import Answer, judged
from onboard.answers.chronicle import Chronicle
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.one_flight import Contradiction, contradiction
from onboard.core.diagnosis.procedure import examine
from onboard.core.diagnosis.records import Diagnosis, Mismatch, NotTestable, Series, Verdict
from onboard.core.diagnosis.together import Asked, asked_of
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.comparison import Comparison, compare
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.mean_force import in_the_mean
from onboard.core.estimate.result import Calibration, Coverage, Status
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.estimate.standing import Standing
from onboard.core.inputs.blocks import Block
from onboard.core.inputs.samples import GpsFix, ImuSample, Sample
from onboard.core.inputs.segments import Batch
from onboard.core.maths.compiling import prefer_compiled

PAUSE_S = 10.0
"""Between two recordings."""
NO_FLIGHT = "no stretch of flight with trusted GPS and inertial data"
SEE_TO_NUMBERS = "see to the recording's numbers: parameters, attitude and GPS are of no vehicle"
KEEPING_ALL = CalibratorSettings(refine=False, at_once=False, buffer_s=math.inf)


class Recorded:
    """An estimator for :func:`onboard.answers.replay.replay` whose calibrations are answers."""

    def __init__(
        self, wanted: Collection[int] = (), *, watched: bool = False, one_of_several: bool = False
    ) -> None:
        """Take what to read.

        Args:
            wanted: accelerometers to ask about (none named: all); each costs as much as another.
            watched: keep what a report draws.
            one_of_several: keep what the flight says of effects that it does not show by itself.
        """
        prefer_compiled()  # hundreds of passes pay for the import
        self.calibrator = Calibrator(KEEPING_ALL, only=wanted)
        self.chronicle = Chronicle(self.calibrator) if watched else None
        self._reader = self.chronicle or self.calibrator
        self._asked_of: dict[int, tuple[Asked, ...]] = {}
        self._one_of_several = one_of_several
        self._answers: dict[int, Answer] = {}
        self._engines: dict[int, Examination] = {}
        self._sampled: dict[int, tuple[Batch, ...]] = {}
        self._shift, self._newest, self._begins = 0.0, -math.inf, False
        self._recordings = [-math.inf]  # when each of them begins, on the clock of the first
        self._contradictions: dict[int, Contradiction] = {}
        self._standing = Standing()

    @property
    def imus(self) -> tuple[int, ...]:
        """Accelerometers that can be asked about."""
        return self.calibrator.imus

    @property
    def standing_s(self) -> float:
        """Time on the ground, which teaches nothing, s."""
        return self.calibrator.standing_s

    @property
    def refused(self) -> Mapping[str, int]:
        """Fixes that were refused, by reason, where GPS was never trusted; else empty."""
        trust = self.calibrator.trust
        return {} if trust.trusted_s > 0.0 else trust.rejected

    @property
    def parameters(self) -> Mapping[str, float]:
        """The autopilot's parameters as they were reported last, by name."""
        return self.calibrator.parameters.values

    def restart(self) -> object:
        """Another recording of the same vehicle begins."""
        self._begins = math.isfinite(self._newest)
        return self._reader.restart()

    def feed(self, sample: Sample) -> object:
        """Take a sample."""
        t = sample.t
        if t is not None and math.isfinite(t):
            if self._begins:
                self._shift, self._begins = self._newest + PAUSE_S - t, False
                self._recordings.append(self._newest + PAUSE_S / 2.0)
            if self._shift:
                sample = later(sample, t, self._shift)
            self._newest = max(self._newest, t + self._shift)
        if isinstance(sample, ImuSample):
            self._standing.hear_one(sample, self.calibrator.parameters)
        return self._reader.feed(sample)

    def feed_block(self, block: Block) -> object | None:
        """Take many samples at once; None, and none is taken, if they are to be fed one by one."""
        if self._begins or self._shift:
            return None
        taken = self._reader.feed_block(block)
        if taken is not None:
            self._newest = max(self._newest, block.latest)
            for columns in block.kept:
                self._standing.catch_up(columns.imu, self.calibrator.parameters)
                self._standing.hear(
                    columns.imu, columns.t, columns.rows[:, :6], self.calibrator.parameters
                )
        return taken

    def finish(self) -> object:
        """There are no more recordings."""
        return self._reader.finish()

    def calibration(self, imu: int) -> Calibration:
        """The answer's calibration."""
        return self.answer(imu).calibration

    def answer(self, imu: int) -> Answer:
        """What the recordings say of one accelerometer; worked out once.

        Raises:
            KeyError: that accelerometer has not been seen.
        """
        if imu not in self._answers:
            self._answers[imu] = self._asked(imu)
        return self._answers[imu]

    def effects(self, imu: int) -> tuple[Asked, ...]:
        """What it says, as one of several flights, of effects that are alike in all of them."""
        return self._asked_of.get(imu, ())

    def contradiction(self, imu: int) -> Contradiction | None:
        """Recordings that are no one flight, where an accelerometer that was asked shows it."""
        return self._contradictions.get(imu)

    def engine(self, imu: int) -> Engine | None:
        """Whose sums gave the answer; None where there is no diagnosis."""
        return self._engines.get(imu)

    def sampled(self, imu: int) -> tuple[Batch, ...]:
        """The flight of an accelerometer, without what its answer, if it has one, says is false."""
        return self._sampled.get(imu) or tuple(self.calibrator.engine(imu).batches)

    def compared(self, calibrations: Sequence[Calibration]) -> Comparison | None:
        """What the accelerometers say of each other; None if there is nothing to compare.

        Args:
            calibrations: of the accelerometers, as the answers have them.
        """
        try:
            whole = [
                c if (engine := self._engines.get(c.imu)) is None else in_the_mean(c, engine)
                for c in calibrations
            ]
            return compare(whole, (self.kept(),))
        except (ArithmeticError, ValueError):  # numbers that no model fits
            return None

    def kept(self) -> Mapping[int, Sequence[Batch]]:
        """The flight that each accelerometer has kept."""
        return {imu: self.calibrator.engine(imu).batches for imu in self.imus}

    def _asked(self, imu: int) -> Answer:
        try:
            beside = next(iter(self._engines.values()), None)
            found = examine(self.calibrator, imu, beside=beside)
            given = judged(self._with_rest(found.diagnosis()), self.parameters)
            if self._one_of_several:
                self._asked_of[imu] = asked_of(found.choice)
        except (ArithmeticError, LookupError, ValueError) as error:  # numbers that no model fits
            why = f"the flight could not be diagnosed ({error})"
            return unanswered(self._undiagnosed(imu, why), why)
        if len(self._recordings) > 1:
            apart = contradiction(found.engine, self._recordings)
            if apart is not None:
                self._contradictions[imu] = apart
        found.engine.let_epochs_go()  # a report asks for its sums and states
        self._engines[imu], self._sampled[imu] = found.engine, found.sampled
        if self.chronicle is not None:
            self.chronicle.take(imu, found.engine, found.left_open)
        return given

    def _undiagnosed(self, imu: int, why: str) -> Calibration:
        """What is known where there is no diagnosis; what spoils that may spoil this, too."""
        try:
            plain = self.calibrator.calibration(imu)
        except (ArithmeticError, ValueError):
            parameters = self.calibrator.parameters
            return Calibration.unanswered(
                imu,
                parameters.six(imu),
                why,
                parameters_known=parameters.known(imu),
                coverage=Coverage(0.0, (0.0,) * 6, "", SEE_TO_NUMBERS),
            )
        note = f"{why}. {plain.note}".rstrip()
        return replace(plain, status=Status.INSUFFICIENT, believed=False, note=note)

    def _with_rest(self, found: Diagnosis) -> Diagnosis:
        """With what the accelerometer reads at rest, which is no part of its estimate."""
        c = found.calibration
        dead_from = min((start for start, _ in self.calibrator.stuck(c.imu)), default=math.inf)
        at_rest = self._standing.of(c, self.calibrator.parameters, dead_from)
        return replace(found, calibration=replace(c, at_rest=at_rest))


def later(sample: Sample, t: float, by: float) -> Sample:
    """A sample of ``t``, s, with all that it has of the boot clock later by ``by``, s."""
    t += by
    if isinstance(sample, GpsFix) and sample.t_message is not None:
        return replace(sample, t=t, t_message=sample.t_message + by)
    return replace(sample, t=t)


def unanswered(calibration: Calibration, why: str = NO_FLIGHT) -> Answer:
    """The answer where there is no diagnosis: of a recording without a usable segment of flight."""
    nan = float("nan")
    empty = np.zeros((0, 3))
    return Answer(
        Diagnosis(
            imu=calibration.imu,
            verdict=Verdict.INSUFFICIENT,
            calibration=calibration,
            timing=calibration.timing,
            mismatch=Mismatch(
                detected=False,
                whitened_rms_before=nan,
                whitened_rms_after=nan,
                p_value=1.0,
                velocity_rms_before=nan,
                velocity_rms_after=nan,
                held_out_before=nan,
                held_out_after=nan,
            ),
            effects=(),
            ambiguous=(),
            not_testable=(NotTestable("everything", why),),
            ladder=(),
            regimes=(),
            series=Series(np.zeros(0), empty, empty, np.zeros(0, dtype=bool)),
            note=calibration.note
            if calibration.note.startswith(why)
            else f"{why}. {calibration.note}",
        )
    )
