"""Several recordings of one vehicle: each is diagnosed by itself, then they are merged.

A flight has its own noise, timing, antenna and attitude errors, and its own missing physics; what
the flights share are the six numbers of each accelerometer.  Which of them count is said in
:mod:`onboard.answers.flight_share` and :mod:`onboard.core.estimate.merged_flights`.

A recording that does not say which parameters were in force flew with those of the recording
before it (or, for the first ones, after it).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from onboard.answers.answer import Answer, FlightAnswer
from onboard.answers.chronicles import Chronicles
from onboard.answers.flight_share import NOT_COMPARED, Share, share_of
from onboard.answers.flight_words import agreement, contradiction, left_out, others
from onboard.answers.recorded import KEEPING_ALL, NO_FLIGHT, Recorded
from onboard.core.diagnosis.joined import WHO, Heard, joined
from onboard.core.diagnosis.undecided import in_words
from onboard.core.estimate.comparison import Comparison, compare
from onboard.core.estimate.merged_flights import Prior, Reconciled
from onboard.core.estimate.merged_record import merged_calibration, unknown_six
from onboard.core.estimate.observability import Observability
from onboard.core.estimate.result import Calibration, Status
from onboard.core.inputs.blocks import Block
from onboard.core.inputs.samples import Sample
from onboard.core.maths.accelerometer import SixParameters


class Flights:
    """An estimator for :func:`onboard.answers.replay.replay` of several recordings."""

    def __init__(
        self, names: Sequence[str], wanted: Collection[int] = (), *, watched: bool = False
    ) -> None:
        """Take what to read.

        Args:
            names: of the recordings, in the order in which they are read and were flown.
            wanted: accelerometers to ask about (none named: all).
            watched: keep what a report draws.
        """
        self._names, self._wanted, self._watched = tuple(names), wanted, watched
        self._flights = [self._another()]
        self._answers: dict[int, Answer] = {}
        self._seen: dict[int, Observability] = {}

    @property
    def imus(self) -> tuple[int, ...]:
        """Accelerometers that can be asked about."""
        return tuple(sorted({imu for flight in self._flights for imu in flight.imus}))

    @property
    def standing_s(self) -> float:
        """Time on the ground, which teaches nothing, s."""
        return sum(flight.standing_s for flight in self._flights)

    @property
    def refused(self) -> Mapping[str, int]:
        """Fixes that were refused, by reason, where GPS was never trusted; else empty."""
        every = [flight.refused for flight in self._flights]
        return sum(map(Counter, every), Counter[str]()) if all(every) else {}

    @property
    def parameters(self) -> Mapping[str, float]:
        """The autopilot's parameters as they were reported last, by name."""
        every: dict[str, float] = {}
        for flight in self._flights:
            every.update(flight.parameters)
        return every

    @property
    def chronicle(self) -> Chronicles | None:
        """What a report draws, if it was kept."""
        kept = [flight.chronicle for flight in self._flights]
        watched = [chronicle for chronicle in kept if chronicle is not None]
        return Chronicles(watched, self._seen) if watched else None

    def restart(self) -> object:
        """Another recording of the same vehicle begins."""
        done = self._flights[-1].finish()
        self._flights.append(self._another())
        return done

    def _another(self) -> Recorded:
        return Recorded(self._wanted, watched=self._watched, one_of_several=True)

    def feed(self, sample: Sample) -> object:
        """Take a sample."""
        return self._flights[-1].feed(sample)

    def feed_block(self, block: Block) -> object | None:
        """Take many samples at once; None, and none is taken, if they are to be fed one by one."""
        return self._flights[-1].feed_block(block)

    def finish(self) -> object:
        """There are no more recordings."""
        return self._flights[-1].finish()

    def answer(self, imu: int) -> Answer:
        """What the recordings say of one accelerometer; worked out once.

        Raises:
            KeyError: that accelerometer has not been seen.
        """
        if imu not in self._answers:
            self._answers[imu] = self._merged(imu)
        return self._answers[imu]

    def compared(self, calibrations: Sequence[Calibration]) -> Comparison | None:
        """What the accelerometers say of each other; None if there is nothing to compare.

        Flights in which one of them contradicts others are left out.

        Args:
            calibrations: of the accelerometers, as the answers have them.
        """
        odd = {
            i
            for c in calibrations
            for i, flight in enumerate(self.answer(c.imu).flights if c.imu in self.imus else ())
            if flight.contradicted
        }
        agreeing = [f for i, f in enumerate(self._flights) if i not in odd]
        told = [f for f in agreeing if all(map(f.calibrator.parameters.known, f.imus))]
        try:
            return compare(calibrations, [f.kept() for f in told or agreeing])
        except (ArithmeticError, ValueError):  # numbers that no model fits
            return None

    def _merged(self, imu: int) -> Answer:
        applied = self._in_force(imu)
        in_force = next(
            (f.calibrator.parameters.six(imu) for f in reversed(self._flights) if _known(f, imu)),
            SixParameters(),
        )
        flights = [
            share_of(f, imu, applied[k], in_force) if imu in f.imus else None
            for k, f in enumerate(self._flights)
        ]
        there = [i for i, f in enumerate(flights) if f is not None]
        if not there:
            raise KeyError(imu)
        counting = [i for i in there if (f := flights[i]) is not None and f.said is not None]
        last = [f for f in flights if f is not None and (f.said is not None or not counting)][-1]
        said = [
            Heard(f.said, [f.of_raw(a) for a in recorded.effects(imu)])
            for f, recorded in zip(flights, self._flights, strict=True)
            if f is not None and f.said is not None
        ]
        if not said:
            answers = self._listed(flights, counting, None)
            note = f"no flight counts: {left_out(answers)}. {last.given.calibration.note}".rstrip()
            return _with(last.given, replace(last.given.calibration, note=note), answers)
        prior = Prior(in_force.as_linear(), KEEPING_ALL.needs.prior)
        together = joined(said, prior)
        found = together.found
        answers = self._listed(flights, counting, found)
        if together.merged is None:
            made = unknown_six(last.judged, in_force)
            note = f"{contradiction(answers, found)}. {others(answers)}".rstrip()
            return _with(last.given, replace(made, note=note), answers)
        chosen = [counting[i] for i in found.counted]
        judged = [f.judged for i in chosen if (f := flights[i]) is not None]
        made, self._seen[imu] = merged_calibration(
            judged,
            together.merged,
            in_force,
            KEEPING_ALL.needs,
            next((k for f in reversed(self._flights) if (k := f.calibrator.kind)), ""),
        )
        claimed = np.array(made.covariance).diagonal()
        open_ = in_words(together.open, SixParameters(made.scale, made.offset), claimed, WHO)
        notes = (agreement(answers, found), others(answers), open_, made.note)
        note = " ".join(x for x in notes if x)
        return _with(last.given, replace(made, note=note), answers)

    def _in_force(self, imu: int) -> list[SixParameters | None]:
        """By recording what was in force in it, where only another recording says it."""
        told = [f.calibrator.parameters.six(imu) if _known(f, imu) else None for f in self._flights]
        first = next((six for six in told if six is not None), None)
        out: list[SixParameters | None] = []
        latest = first
        for six in told:
            latest = six or latest
            out.append(None if six is not None else latest)
        return out

    def _listed(
        self, flights: Sequence[Share | None], counting: Sequence[int], found: Reconciled | None
    ) -> tuple[FlightAnswer, ...]:
        out = []
        for i, (name, flight) in enumerate(zip(self._names, flights, strict=True)):
            if flight is None:
                out.append(FlightAnswer(name, None, NOT_COMPARED, why=NO_FLIGHT))
                continue
            if found is None or i not in counting:
                out.append(FlightAnswer(name, flight.given, NOT_COMPARED, why=flight.why))
                continue
            k = counting.index(i)
            odd, counted = k in found.contradicted, k in found.counted
            why = "" if counted else "it contradicts other flights"
            if not (counted or odd):
                why = "flights contradict each other"
            out.append(FlightAnswer(name, flight.given, found.apart[k], counted, odd, why))
        return tuple(out)


def distinct(paths: Sequence[object]) -> tuple[str, ...]:
    """Names of files that tell them apart: as short as that allows."""
    whole = [str(path) for path in paths]
    short = [name.replace("\\", "/").rsplit("/", 1)[-1] for name in whole]
    return tuple(short if len(set(short)) == len(short) else whole)


def _known(flight: Recorded, imu: int) -> bool:
    return flight.calibrator.parameters.known(imu)


def _with(last: Answer, calibration: Calibration, answers: tuple[FlightAnswer, ...]) -> Answer:
    """The merged answer: what was found in a flight stays with that flight."""
    diagnosis = replace(
        last.diagnosis,
        calibration=calibration,
        timing=calibration.timing,
        effects=(),
        ambiguous=(),
        note=calibration.note,
        plain=None,
    )
    beside = [
        f"{f.name}: {f.given.missing}"
        for f in answers
        if f.counted and f.given is not None and f.given.missing
    ]
    missing = "; ".join(beside)
    if not any(f.counted for f in answers):
        missing = last.missing
    done = calibration.status is Status.CALIBRATED
    return Answer(diagnosis, missing, modelled=bool(beside) and done, flights=answers)
