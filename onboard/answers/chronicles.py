"""How the calibrations of several flights came about, drawn one after the other.

Each flight is drawn by itself, with its own estimate: where their bands do not overlap, flights
contradict each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from onboard.answers.chronicle import Chronicle, Course, Curve, Figures, Span
from onboard.core.estimate.observability import Observability

LEAST_PAUSE_S: Final = 45.0
"""Drawn between two flights at least, s: a chart shows a gap that is longer than four usual steps,
and the points of a short flight's course are a batch of 10 s apart [bound]."""
PAUSE_SHARE: Final = 0.1
"""The same as a share of the longest flight: four steps of a course of 60 points are 4 / 60 of it
[bound]."""


class Chronicles:
    """The chronicles of several flights as one."""

    def __init__(self, flights: Sequence[Chronicle], seen: Mapping[int, Observability]) -> None:
        """Take the flights (at least one), and what they show together, by accelerometer."""
        self._flights, self._seen = tuple(flights), seen
        longest = max(flight.duration_s for flight in flights)
        pause = max(LEAST_PAUSE_S, PAUSE_SHARE * longest)
        self._begins: list[float] = []
        at = 0.0
        for flight in flights:
            self._begins.append(at)
            at += flight.duration_s + pause
        self.duration_s = at - pause

    @property
    def spans(self) -> tuple[Span, ...]:
        """Trust over time."""
        return tuple(
            Span(s.start + begin, s.end + begin, s.reason)
            for begin, flight in zip(self._begins, self._flights, strict=True)
            for s in flight.spans
        )

    @property
    def speed(self) -> Curve:
        """Speed over ground that GPS reported, m/s."""
        return self._joined([flight.speed for flight in self._flights])

    def figures(self, imu: int) -> Figures:
        """The figures of one accelerometer: each flight's own, and what all show together."""
        every = [flight.figures(imu) for flight in self._flights]
        courses = [f.course for f in every]
        return Figures(
            course=Course(
                np.concatenate([c.t + at for c, at in zip(courses, self._begins, strict=True)]),
                np.concatenate([c.value for c in courses]),
                np.concatenate([c.sigma for c in courses]),
                np.concatenate([c.in_force for c in courses]),
                np.concatenate([c.coverage for c in courses]),
            ),
            before=self._joined([f.before for f in every]),
            after=self._joined([f.after for f in every]),
            innovation=self._joined([f.innovation for f in every]),
            seen=self._seen.get(imu, every[-1].seen),
        )

    def _joined(self, curves: Sequence[Curve]) -> Curve:
        shifted = [c.t + at for c, at in zip(curves, self._begins, strict=True)]
        return Curve(np.concatenate(shifted), np.concatenate([c.y for c in curves]))
