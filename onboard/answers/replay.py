"""Recordings of one vehicle through the core, and what they gave."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, runtime_checkable

import msgspec

from onboard.answers.advice import Advice, advise
from onboard.answers.answer import Answer
from onboard.answers.calibration_document import advice_document
from onboard.answers.compared import accelerometers_document, remarks
from onboard.answers.flight_document import FlightsDocument, flight_document
from onboard.answers.recorded import KEEPING_ALL, unanswered
from onboard.answers.recorded_vehicle import Vehicle
from onboard.answers.replay_document import RecordingDocument, ReplayDocument, imu_document
from onboard.answers.same_flight import refuse_copies, refuse_one_flight_twice, refuse_other_boards
from onboard.answers.together import together
from onboard.core.estimate.comparison import Comparison
from onboard.core.estimate.result import Calibration
from onboard.core.inputs.blocks import Block
from onboard.core.inputs.samples import Sample
from onboard.errors import RecordingError, UsageError
from onboard.recordings.opening import open_recording
from onboard.recordings.recording import Recording, damage_by_file

Progress = Callable[[float], None]
"""Told the share of the work that is done, 0 ... 1, now and then."""

PROGRESS_EVERY = 1024


class Reader(Protocol):
    """What is fed with recordings (:class:`onboard.core.estimate.calibrator.Calibrator` can be)."""

    def feed(self, sample: Sample) -> object:
        """Take a sample."""

    def restart(self) -> object:
        """Another recording of the same vehicle begins."""

    def finish(self) -> object:
        """Process what is pending: there are no more recordings."""

    @property
    def standing_s(self) -> float:
        """Time on the ground, which teaches nothing, s."""


@runtime_checkable
class Gatherer(Protocol):
    """A reader that can take many samples at once."""

    def feed_block(self, block: Block) -> object | None:
        """Take samples; None, and none is taken, if they are to be fed one by one."""


@runtime_checkable
class Judging(Protocol):
    """A reader that judges fixes."""

    @property
    def refused(self) -> Mapping[str, int]:
        """Fixes that were refused, by reason, where GPS was never trusted; else empty."""


class Estimator(Reader, Protocol):
    """What replay needs of a recording, or of several (:mod:`onboard.answers.flights`)."""

    @property
    def imus(self) -> tuple[int, ...]:
        """Accelerometers seen."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """The autopilot's parameters as they were reported last, by name."""

    def answer(self, imu: int) -> Answer:
        """The answer for one of them."""

    def compared(self, calibrations: Sequence[Calibration]) -> Comparison | None:
        """What the accelerometers say of each other; None if there is nothing to compare."""


@dataclass(frozen=True, slots=True)
class Reading:
    """Recordings that were read; ``vehicle`` knows what was in them."""

    recordings: tuple[Recording, ...]
    vehicle: Vehicle

    @property
    def autopilot(self) -> str:
        """The kind of autopilot that all of them come from."""
        return self.recordings[0].autopilot

    @property
    def duration_s(self) -> float:
        """Length of all recordings together, s."""
        return sum(recording.duration_s for recording in self.recordings)

    @property
    def damage(self) -> list[str]:
        """What was skipped of damaged files, in sentences."""
        return damage_by_file(self.recordings)


@dataclass(frozen=True, slots=True)
class Replay:
    """Recordings and what they gave.

    ``counts`` are samples fed, ``imu <n>`` and ``gps``; ``notes`` says what is left out;
    ``parameters`` are the autopilot's as they were reported last; ``comparison`` is of the
    accelerometers with each other, if there are several.
    """

    recordings: tuple[Recording, ...]
    answers: tuple[Answer, ...]
    counts: dict[str, int]
    notes: tuple[str, ...] = ()
    parameters: Mapping[str, float] = field(default_factory=dict)
    comparison: Comparison | None = None

    @property
    def calibrations(self) -> tuple[Calibration, ...]:
        """The calibration of each answer."""
        return tuple(answer.calibration for answer in self.answers)

    @property
    def advice(self) -> tuple[Advice | None, ...]:
        """What to set of each answer; None for another autopilot than ArduPilot."""
        if self.autopilot != "ardupilot":
            return (None,) * len(self.answers)
        return advise(self.answers, self.parameters)

    @property
    def autopilot(self) -> str:
        """The kind of autopilot that all of them come from."""
        return self.recordings[0].autopilot

    @property
    def duration_s(self) -> float:
        """Length of all recordings together, s."""
        return sum(recording.duration_s for recording in self.recordings)

    def document(self) -> ReplayDocument:
        """The result as other programs read it."""
        return ReplayDocument(
            recording=RecordingDocument(
                files=[str(recording.path) for recording in self.recordings],
                autopilot=self.autopilot,
                duration_s=self.duration_s,
                samples=self.counts,
                damage=damage_by_file(self.recordings),
                notes=[f"{r.path.name}: {note}" for r in self.recordings for note in r.notes]
                + list(self.notes),
            ),
            imus=[
                imu_document(c, self.autopilot, advice=advice_document(advice))
                for c, advice in zip(self.calibrations, self.advice, strict=True)
            ],
            accelerometers=accelerometers_document(self.comparison),
            flights=self._flights(),
        )

    def _flights(self) -> list[FlightsDocument] | msgspec.UnsetType:
        """Each recording by itself; unset for a single one."""
        if not any(a.flights for a in self.answers):
            return msgspec.UNSET
        return [
            FlightsDocument(
                file=str(recording.path),
                imus=[flight_document(a.imu, a.flights[i]) for a in self.answers if a.flights],
            )
            for i, recording in enumerate(self.recordings)
        ]


def replay(
    paths: Sequence[str | Path | Recording],
    estimator: Estimator,
    *,
    imu: int | None = None,
    progress: Progress | None = None,
) -> Replay:
    """Feed files to one estimator and ask it.

    Args:
        paths: at least one recording, all of the same vehicle; files, or opened already.
        estimator: a fresh one; restarted between files, finished after the last.
        imu: answer for this accelerometer only.
        progress: called every few thousand samples.

    Raises:
        RecordingError: a file that cannot be used, or one of another vehicle.
        UsageError: there is no such accelerometer in the recordings.
    """
    source = read(paths, estimator, imu=imu, progress=progress)
    vehicle, answered = source.vehicle, estimator.imus
    # A stream too slow to calibrate from is not worth a table, unless asked for or alone.
    wanted = (imu,) if imu is not None else answered or vehicle.imus
    answers = tuple(
        estimator.answer(n) if n in answered else unanswered(vehicle.unanswered(n)) for n in wanted
    )
    compared = estimator.compared([a.calibration for a in answers]) if len(answers) > 1 else None
    answers = together(answers, compared, KEEPING_ALL.needs)
    quiet = () if imu is not None else sorted({*vehicle.imus} - {*wanted})
    notes = (*map(vehicle.silence, quiet), *remarks(compared))
    return Replay(source.recordings, answers, vehicle.counts, notes, estimator.parameters, compared)


def read(
    paths: Sequence[str | Path | Recording],
    reader: Reader,
    *,
    imu: int | None = None,
    progress: Progress | None = None,
) -> Reading:
    """Feed files, one after the other, to one reader.

    Args:
        paths: at least one recording, all of the same vehicle; files, or opened already.
        reader: a fresh one; restarted between files, finished after the last.
        imu: an accelerometer that must be there.
        progress: called every few thousand samples.

    Raises:
        RecordingError: a file that cannot be used, or one of another vehicle.
        UsageError: there is no such accelerometer in the recordings.
    """
    if not paths:
        raise UsageError("no recording given")
    recordings = tuple(p if isinstance(p, Recording) else open_recording(p) for p in paths)
    refuse_copies(recordings)
    _refuse_mixture(recordings)
    refuse_other_boards(recordings)
    total = sum(sum(recording.counts.values()) for recording in recordings)
    vehicle = Vehicle()
    gatherer = reader if isinstance(reader, Gatherer) else None
    fed = 0
    for recording in recordings:
        if recording is not recordings[0]:
            reader.restart()
        vehicle.begin()
        told = fed
        for piece in recording.samples() if gatherer is None else recording.pieces():
            vehicle.check(piece, recording)
            if not isinstance(piece, Block):
                reader.feed(piece)
                fed += 1
            else:
                if gatherer is None or gatherer.feed_block(piece) is None:
                    for sample in piece.samples():
                        reader.feed(sample)
                fed += len(piece)
            if progress is not None and fed >= told + PROGRESS_EVERY:
                told = fed
                progress(min(1.0, fed / total))
        refuse_one_flight_twice(vehicle.tracks)
    reader.finish()
    vehicle.standing_s = reader.standing_s
    if isinstance(reader, Judging):
        vehicle.refused = reader.refused
    if progress is not None:
        progress(1.0)
    _refuse_absent(imu, vehicle, recordings[0])
    # Of those that were opened here nothing is read again: of a day's flight, places are much.
    given = [isinstance(p, Recording) for p in paths]
    kept = (r if mine else r.closed() for r, mine in zip(recordings, given, strict=True))
    return Reading(tuple(kept), vehicle)


def _refuse_absent(imu: int | None, vehicle: Vehicle, recording: Recording) -> None:
    if imu is not None and imu not in vehicle.imus:
        there = ", ".join(map(str, vehicle.imus))
        raise UsageError(f"no accelerometer {imu} in {recording.path} (there: {there})")


def _refuse_mixture(recordings: Sequence[Recording]) -> None:
    first = recordings[0]
    for other in recordings[1:]:
        if other.autopilot != first.autopilot:
            raise RecordingError(
                f"{other.path}: of another vehicle than {first.path} "
                f"(autopilot {other.autopilot}, there {first.autopilot})"
            )
