"""Recordings through the diagnosis: read as for a replay, then asked what is missing."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from onboard.answers.advice import Advice, advise
from onboard.answers.answer import Answer
from onboard.answers.explain_document import ExplainDocument, explain_document
from onboard.answers.flights import distinct
from onboard.answers.flown_order import in_order
from onboard.answers.one_flight import no_answer
from onboard.answers.recorded import Recorded, unanswered
from onboard.answers.replay import Reading, read
from onboard.answers.together import named, takes_part
from onboard.core.diagnosis.records import Diagnosis
from onboard.recordings.recording import Recording


@dataclass(frozen=True, slots=True)
class Explanation:
    """An answer with its diagnosis, and what it was made from; ``notes`` are about the files."""

    answer: Answer
    source: Reading
    parameters: Mapping[str, float]
    notes: tuple[str, ...] = ()

    @property
    def diagnosis(self) -> Diagnosis:
        """What was found; its calibration is the answer's."""
        return self.answer.diagnosis

    @property
    def imu(self) -> int:
        """Which accelerometer."""
        return self.answer.imu

    @property
    def advice(self) -> Advice | None:
        """What to set; None for another autopilot than ArduPilot."""
        if self.source.autopilot != "ardupilot":
            return None
        return advise((self.answer,), self.parameters)[0]

    @property
    def files(self) -> list[str]:
        """Names of the recordings."""
        return [r.path.name for r in self.source.recordings]

    @property
    def duration_s(self) -> float:
        """Length of all recordings, s."""
        return self.source.duration_s

    def document(self) -> ExplainDocument:
        """``onboard.explain/1``."""
        return explain_document(
            self.diagnosis,
            files=self.files,
            autopilot=self.source.autopilot,
            duration_s=self.duration_s,
            damage=self.source.damage,
            notes=self.notes,
            samples={
                "imu": self.source.vehicle.counts.get(f"imu {self.imu}", 0),
                "gps": self.source.vehicle.counts.get("gps", 0),
            },
            advice=self.advice,
        )


def explain(
    paths: Sequence[str | Path | Recording],
    *,
    imu: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Explanation:
    """Read recordings of one vehicle and diagnose one accelerometer.

    Args:
        paths: at least one recording; files, or opened already; where they do not say when they
            were flown, in that order.
        imu: which accelerometer; the first that can be diagnosed if None.
        progress: told the share of the reading that is done.

    Raises:
        RecordingError: a file that cannot be used.
        UsageError: there is no such accelerometer; dates contradict the order given of recordings
            not all of which have one.
    """
    flown = in_order(paths)
    recorded = Recorded((imu or 1,))
    source = read(flown.recordings, recorded, imu=imu, progress=progress)
    if imu is None and 1 not in recorded.imus:
        recorded = Recorded()
        source = read(flown.recordings, recorded, progress=progress)
    if imu is None:
        imu = min(recorded.imus or source.vehicle.imus, default=1)
    known = imu in recorded.imus
    given = recorded.answer(imu) if known else unanswered(source.vehicle.unanswered(imu))
    if (apart := recorded.contradiction(imu)) is not None:
        given = no_answer(given, apart, distinct([r.path for r in source.recordings]))
    chosen = (f"{r.path.name}: {note}" for r in source.recordings for note in r.notes)
    beside = _beside(given, sorted({*source.vehicle.imus} - {imu}))
    return Explanation(given, source, recorded.parameters, (*flown.notes, *chosen, *beside))


def _beside(given: Answer, others: Sequence[int]) -> Iterator[str]:
    """That others felt the flight, too, where that would count."""
    if others and takes_part(given):
        yield (
            f"{named(others)} felt the same flight, and this is by {named([given.imu])} alone: "
            "what to set by all of them, onboard replay says"
        )
