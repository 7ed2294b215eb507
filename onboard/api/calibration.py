"""``onboard.calibrate``: the six numbers of every accelerometer, from recordings or columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from onboard.answers.calibrated import calibrated
from onboard.answers.replay import Progress, Replay
from onboard.answers.replay_document import ReplayDocument
from onboard.api.accelerometer import Accelerometer, Row, accelerometer
from onboard.api.figures import draw_courses
from onboard.api.result import Result
from onboard.api.sources import Source, opened
from onboard.errors import UsageError
from onboard.report.parameters import replay_text
from onboard.report.replay import replay_html
from onboard.report.replay_charts import Drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CalibrationResult(Result):
    """What :func:`calibrate` gives: one entry for each accelerometer, in their order.

    It keeps what the report draws, which is the flight: some 5 MB for each minute.

    Attributes:
        accelerometers: the entries; iterating over the result gives them, too.
        files: names of the recordings, as they were given.
        autopilot: ``ardupilot``, ``px4`` or ``unknown``.
        duration_s: length of all recordings, s.
        notes: what was skipped, chosen or left out, in words.
    """

    accelerometers: tuple[Accelerometer, ...]
    files: tuple[str, ...]
    autopilot: str
    duration_s: float
    notes: tuple[str, ...]
    _replay: Replay = field(repr=False)
    _drawn: Drawn = field(repr=False)

    def __iter__(self) -> Iterator[Accelerometer]:
        return iter(self.accelerometers)

    def __len__(self) -> int:
        return len(self.accelerometers)

    def imu(self, number: int) -> Accelerometer:
        """The entry of accelerometer ``number``, counted from 1 as the autopilot does.

        Raises:
            UsageError: there is none.
        """
        for entry in self.accelerometers:
            if entry.imu == number:
                return entry
        there = ", ".join(str(entry.imu) for entry in self.accelerometers)
        raise UsageError(f"no accelerometer {number} in the result (there: {there})")

    def rows(self) -> list[Row]:
        """Six records for each accelerometer; scales are factors, offsets m/s^2.

        ``imu``, ``status``, ``number``, ``parameter``, ``in_force``, ``estimate``, ``sigma``,
        ``known`` and ``to_set``, which is NaN where the number stays as it is.
        """
        return [row for entry in self.accelerometers for row in entry.rows()]

    def plot(self, figure: Figure | None = None, *, imu: int | None = None) -> Figure:
        """Draw how the six numbers converged, with bands of two sigma.

        Args:
            figure: of matplotlib, to draw into; a new one without.
            imu: this accelerometer only.

        Raises:
            ExtraError: matplotlib is not installed.
            UsageError: there is no such accelerometer.
        """
        chosen = self.accelerometers if imu is None else (self.imu(imu),)
        courses = {entry.imu: self._drawn.figures(entry.imu).course for entry in chosen}
        return draw_courses(courses, figure)

    def __str__(self) -> str:
        minutes = f"{', '.join(self.files)}: {self.autopilot}, {self.duration_s:.0f} s"
        return "\n".join([minutes, *self.notes, *map(str, self.accelerometers)])

    def _html(self, base: str) -> str:
        return replay_html(self._replay, self._drawn, base)

    def _settings(self, file: str) -> str:
        return replay_text(self._replay, file)

    def _document(self) -> ReplayDocument:
        return self._replay.document()


def calibrate(
    source: Source | Sequence[Source],
    *,
    imu: int | None = None,
    progress: Progress | None = None,
) -> CalibrationResult:
    """Calibrate the accelerometers of a flight, as ``onboard replay`` does.

    Args:
        source: a recording (.BIN, .tlog, .ulg), :class:`onboard.Arrays`, or several of one vehicle
            (where they have no dates, in the order in which they were flown): these are merged.
        imu: this accelerometer only, 1 to 5; all of them without.
        progress: told the share of the reading that is done, 0 to 1.

    Raises:
        RecordingError: a file that cannot be used, or one of another vehicle.
        UsageError: something else was given, one is given twice, or there is no such accelerometer.
    """
    made = calibrated(opened(source), imu=imu, watched=True, progress=progress)
    result = made.replay
    if made.chronicle is None:
        raise AssertionError("what is watched has a chronicle")
    recordings = result.recordings
    first = recordings[0].path.name
    entries = zip(result.answers, result.advice, strict=True)
    return CalibrationResult(
        accelerometers=tuple(
            accelerometer(given, advice, autopilot=result.autopilot, recording=first)
            for given, advice in entries
        ),
        files=tuple(str(r.path) for r in recordings),
        autopilot=result.autopilot,
        duration_s=result.duration_s,
        notes=(
            *(f"{r.path.name}: {n}" for r in recordings for n in (*r.damage, *r.notes)),
            *result.notes,
        ),
        _replay=result,
        _drawn=made.chronicle,
    )
