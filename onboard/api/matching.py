"""``onboard.match``: what a real vehicle has that its simulation lacks."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from onboard.answers import match_words
from onboard.answers.match import Match
from onboard.answers.match import match as match_recordings
from onboard.answers.match_document import MatchDocument, match_document
from onboard.answers.match_files import checked_frame, frame_text, read_frame, settings_text
from onboard.answers.replay import Progress
from onboard.api.accelerometer import Row
from onboard.api.figures import draw_forces
from onboard.api.result import Result
from onboard.api.sources import Source, opened
from onboard.core.physics.finding import Quantity
from onboard.errors import RecordingError, UsageError
from onboard.recordings.recording import because_of
from onboard.report.files import save
from onboard.report.match import match_html

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MatchResult(Result):
    """What :func:`match` gives.

    Attributes:
        verdict: ``clean``, ``explained``, ``partly_explained``, ``unexplained`` or
            ``insufficient``.
        headline: the same as a sentence.
        vehicle: ``copter`` or ``plane``.
        effects: names of what differs.
        settings: parameters of the simulator that are proven, with their sigmas, by name.
        frame: keys of a frame or coefficient file.
        wind: the wind of the flight in words; empty: nothing is known.
        not_testable: effects of which this recording says nothing, by name, and why.
        files: names of the recordings, the simulation's first where there is one.
        flight_s: flight that was used, s.
    """

    verdict: str
    headline: str
    vehicle: str
    effects: tuple[str, ...]
    settings: Mapping[str, Quantity]
    frame: Mapping[str, float | list[float]]
    wind: str
    not_testable: Mapping[str, str]
    files: tuple[str, ...]
    flight_s: float
    _match: Match = field(repr=False)

    def rows(self) -> list[Row]:
        """One record for each number of each effect.

        ``effect``, ``level`` (``vehicle`` or ``sensor``), ``number``, ``simulation``, ``real``,
        ``sigma``, ``unit``.
        """
        return [
            {
                "effect": effect.name,
                "level": effect.level,
                "number": name,
                "simulation": value.simulation,
                "real": value.real,
                "sigma": value.sigma,
                "unit": value.unit,
            }
            for effect in self._match.effects
            for name, value in effect.values.items()
        ]

    def plot(self, figure: Figure | None = None) -> Figure:
        """Draw the error of the predicted force over time, before and after.

        Args:
            figure: of matplotlib, to draw into; a new one without.

        Raises:
            ExtraError: matplotlib is not installed.
        """
        return draw_forces(self._match.vehicle, figure)

    def frame_file(self, path: str | os.PathLike[str]) -> Path:
        """Write the frame or coefficient file that SITL loads; returns its path.

        Raises:
            UsageError: the file cannot be written.
        """
        return save(frame_text(self._match), os.fspath(path))

    def __str__(self) -> str:
        against = " against ".join(self.files)
        lines = [
            f"{against}: {self.vehicle}, {self.flight_s:.0f} s in the air",
            *(f"damage: {note}" for note in self._match.damage),
            f"{self.headline}.",
        ]
        for effect in self._match.effects:
            for name, value in effect.values.items():
                simulation, real, sigma, unit = match_words.compared(value)
                said = f"simulation {simulation}, recording {real} (sigma {sigma})"
                lines.append(f"  {effect.name}, {name}: {said} {unit}".rstrip())
        return "\n".join([*lines, *([f"  wind: {self.wind}"] if self.wind else [])])

    def _html(self, base: str) -> str:
        return match_html(self._match, base=base)

    def _settings(self, file: str) -> str:
        del file  # one format for every name
        return settings_text(self._match)

    def _document(self) -> MatchDocument:
        return match_document(self._match)


def match(
    *recordings: Source,
    frame: Mapping[str, object] | str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> MatchResult:
    """Say what a vehicle has that its simulation lacks, as ``onboard match`` does.

    Args:
        recordings: the real flight's; or the simulation's and then the real flight's.  Files or
            :class:`onboard.Arrays`.
        frame: keys of a frame of SITL, or its file, to compare with; the nominal one without.
        progress: told the share of the reading that is done, 0 to 1.

    Raises:
        RecordingError: a file that cannot be used, or one in which nothing flew.
        UsageError: none or three recordings, or a frame that cannot be used.
    """
    if len(recordings) not in (1, 2):
        raise UsageError("match takes one recording, or a simulation's and a real one")
    given = opened(recordings)
    simulation = given[0] if len(given) > 1 else None
    if isinstance(frame, str | os.PathLike):
        keys = read_frame(frame)
    else:
        keys = checked_frame(frame or {}, "frame")
    made = match_recordings(given[-1], simulation, frame=keys, progress=progress)
    vehicle = made.vehicle
    if made.silent:
        path, why = made.real.source.recordings[0].path, because_of(made.damage)
        raise RecordingError(f"{path}: {vehicle.note}{why}")
    return MatchResult(
        verdict=made.verdict.value,
        headline=match_words.headline(made),
        vehicle=vehicle.vehicle,
        effects=tuple(d.name for d in made.effects),
        settings={s.name: Quantity(s.value, s.sigma, "") for s in made.settings},
        frame=dict(made.frame),
        wind=match_words.wind_sentence(made),
        not_testable={n.name: n.why for n in made.not_testable},
        files=tuple(r.name for r in (made.simulation, made.real) if r is not None),
        flight_s=vehicle.seconds,
        _match=made,
    )
