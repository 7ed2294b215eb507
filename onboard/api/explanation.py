"""``onboard.explain``: which physics a recording has that the model lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from onboard.answers import verdict
from onboard.answers.explain import Explanation
from onboard.answers.explain import explain as explain_recordings
from onboard.answers.explain_document import ExplainDocument
from onboard.answers.replay import Progress
from onboard.api.accelerometer import Accelerometer, Effect, Row, accelerometer, fixed_array
from onboard.api.figures import draw_residuals
from onboard.api.result import Result
from onboard.api.sources import Source, opened
from onboard.core.maths.arrays import Array
from onboard.core.physics.catalogue import title_of
from onboard.report.explain import explanation_html
from onboard.report.parameters import explanation_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ExplanationResult(Result):
    """What :func:`explain` gives.

    Attributes:
        verdict: ``clean``, ``explained``, ``partly_explained``, ``unexplained`` or
            ``insufficient``.
        headline: the same as a sentence.
        effects: what was found.
        accelerometer: the calibration with these effects beside it; its ``parameters`` have their
            cures, too.
        to_do: what to change, in sentences.
        to_fly: what this flight did not show, with the manoeuvre that would.
        not_testable: effects of which this recording says nothing, by name, and why.
        files: names of the recordings.
        duration_s: their length, s.
        t: (n,) times of the velocity residual, s since the first inertial sample.
        before: (n, 3) velocity that GPS measured less the predicted one, north, east, down, m/s,
            with scale and offset only; NaN where it was not measured.
        after: (n, 3) the same with timing and all that was found.
    """

    verdict: str
    headline: str
    effects: tuple[Effect, ...]
    accelerometer: Accelerometer
    to_do: tuple[str, ...]
    to_fly: tuple[str, ...]
    not_testable: dict[str, str]
    files: tuple[str, ...]
    duration_s: float
    t: Array
    before: Array
    after: Array
    _explanation: Explanation = field(repr=False)

    def rows(self) -> list[Row]:
        """One record for each number of each effect that was found.

        ``recording``, ``effect``, ``unknown``, ``value``, ``sigma``, ``unit``.
        """
        return [row for effect in self.effects for row in effect.rows()]

    def plot(self, figure: Figure | None = None) -> Figure:
        """Draw the velocity residual over time, before and after, and where effects act.

        Args:
            figure: of matplotlib, to draw into; a new one without.

        Raises:
            ExtraError: matplotlib is not installed.
        """
        return draw_residuals(self._explanation.diagnosis, figure)

    def __str__(self) -> str:
        d, a = self._explanation.diagnosis, self._explanation.advice
        head = f"{', '.join(self.files)}: accelerometer {d.imu}, {self.duration_s:.0f} s"
        damage = [f"damage: {note}" for note in self._explanation.source.damage]
        said = [*verdict.missing(d), verdict.proof(d), *verdict.cures(d, a), *verdict.remarks(d)]
        for unclear in d.ambiguous:
            names = " / ".join(title_of(name) for name in unclear.names)
            said.append(f"Not told apart: {names}. To tell: {unclear.tell_apart}.")
        shown = [f"{self.verdict}: {self.headline}", *(f"  {sentence}" for sentence in said)]
        return "\n".join([head, *damage, *shown])

    def _html(self, base: str) -> str:
        return explanation_html(self._explanation, base)

    def _settings(self, file: str) -> str:
        return explanation_text(self._explanation, file)

    def _document(self) -> ExplainDocument:
        return self._explanation.document()


def explain(
    source: Source | Sequence[Source],
    *,
    imu: int | None = None,
    progress: Progress | None = None,
) -> ExplanationResult:
    """Find the physics that a flight has and the model lacks, as ``onboard explain`` does.

    Args:
        source: a recording (.BIN, .tlog, .ulg), :class:`onboard.Arrays`, or several of one vehicle:
            these are explained as one flight.
        imu: this accelerometer, 1 to 5; the first that can be diagnosed without.
        progress: told the share of the reading that is done, 0 to 1.

    Raises:
        RecordingError: a file that cannot be used, or one of another vehicle.
        UsageError: something else was given, one is given twice, or there is no such accelerometer.
    """
    made = explain_recordings(opened(source), imu=imu, progress=progress)
    d, series = made.diagnosis, made.diagnosis.series
    entry = accelerometer(
        made.answer,
        made.advice,
        autopilot=made.source.autopilot,
        recording=made.files[0],
        cures=d.effects,
    )
    return ExplanationResult(
        verdict=d.verdict.value,
        headline=verdict.headline(d),
        effects=entry.effects,
        accelerometer=entry,
        to_do=tuple(verdict.cures(d, made.advice)),
        to_fly=tuple(verdict.to_fly(d)),
        not_testable={n.name: n.why for n in d.not_testable},
        files=tuple(made.files),
        duration_s=made.duration_s,
        t=fixed_array(series.t),
        before=fixed_array(series.before),
        after=fixed_array(series.after),
        _explanation=made,
    )
