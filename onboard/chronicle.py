"""How a calibration came about: its course over the flight, kept while a recording is replayed.

A :class:`Chronicle` stands before a calibrator and passes everything on; what goes by is what a
live service would have shown at that moment.  Times are seconds since the first inertial sample,
recordings of several flights one after the other.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from onboard.core.calibrator import Advanced, Calibrator, Event, Restarted
from onboard.core.deadreckoning import free_errors, intervals
from onboard.core.engine import Engine
from onboard.core.observability import Observability, assess
from onboard.core.report import six_covariance, six_information
from onboard.core.result import Calibration
from onboard.core.samples import GpsFix, ImuSample, Sample

Array = NDArray[np.float64]
Item = TypeVar("Item")

POINT_S = 5.0
"""Between two points of a course."""
SPEED_S = 0.4
"""Between two points of the speed."""
PAUSE_S = 10.0
"""Drawn between two recordings, or before and after a reboot."""
FREE_S = 10.0
"""How long velocity is integrated freely before it begins anew from the filter's."""
CLOCK_MARGIN_S = 2.0


@dataclass(frozen=True, slots=True)
class Span:
    """A time of one state of trust; ``reason`` is empty while GPS is trusted."""

    start: float
    end: float
    reason: str

    @property
    def seconds(self) -> float:
        """Its length, s."""
        return self.end - self.start


@dataclass(frozen=True, slots=True)
class Course:
    """Estimates as they were known then: ``t`` (n,) s, the others (n, 6) in order of SIX_NAMES.

    ``coverage`` in percent; ``in_force`` are the parameters that the autopilot used.
    """

    t: Array
    value: Array
    sigma: Array
    in_force: Array
    coverage: Array


@dataclass(frozen=True, slots=True)
class Curve:
    """Values over time, s."""

    t: Array
    y: Array


@dataclass(frozen=True, slots=True)
class Figures:
    """What one accelerometer's report draws.

    ``before`` and ``after``: velocity error (m/s) of free integration over :data:`FREE_S` with
    the parameters in force and with the estimate; ``innovation``: length of the filter's velocity
    residual (m/s), which the certificate bounds; both of the flight that is still buffered.
    """

    course: Course
    before: Curve
    after: Curve
    innovation: Curve
    seen: Observability | None


@dataclass(frozen=True, slots=True)
class _Piece:
    """One run of the boot clock: its first and last inertial sample, and where it is drawn."""

    first: float
    last: float
    drawn: float

    def time(self, t: Array) -> Array:
        shown: Array = t - self.first + self.drawn
        return shown


class Chronicle:
    """A calibrator that is watched; give it to :func:`onboard.replay.replay` in its place."""

    def __init__(self, calibrator: Calibrator) -> None:
        self.calibrator = calibrator
        self._pieces: list[_Piece] = []
        self._piece: _Piece | None = None
        self._points: dict[int, list[tuple[Array, ...]]] = {}
        self._next_point = -np.inf
        self._spans: list[Span] = []
        self._speed: list[tuple[float, float]] = []

    # What replay calls

    @property
    def imus(self) -> tuple[int, ...]:
        """Accelerometers seen."""
        return self.calibrator.imus

    def feed(self, sample: Sample) -> tuple[Event, ...]:
        """Pass a sample on, and note what came of it."""
        events = self.calibrator.feed(sample)
        if any(isinstance(event, Restarted) for event in events):
            self._begin_anew()
        if isinstance(sample, ImuSample):
            self._tick(sample.t)
        elif isinstance(sample, GpsFix):
            self._fix(sample)
        if self._piece is not None and any(isinstance(event, Advanced) for event in events):
            self._note(self._piece.last)
        return events

    def restart(self) -> tuple[Event, ...]:
        """Another recording of the same vehicle begins."""
        events = self.calibrator.restart()
        self._begin_anew()
        return events

    def finish(self) -> tuple[Event, ...]:
        """There are no more recordings."""
        events = self.calibrator.finish()
        if self._piece is not None:
            self._next_point = -np.inf
            self._note(self._piece.last)
        self._begin_anew()
        return events

    def calibration(self, imu: int) -> Calibration:
        """The calibrator's answer."""
        return self.calibrator.calibration(imu)

    # What a report asks

    @property
    def duration_s(self) -> float:
        """Where the drawn time ends, s."""
        return max((p.drawn + p.last - p.first for p in self._pieces), default=0.0)

    @property
    def spans(self) -> tuple[Span, ...]:
        """Trust over time; neighbours differ in their reason."""
        return tuple(self._spans)

    @property
    def speed(self) -> Curve:
        """Speed over ground that GPS reported, m/s."""
        return Curve(np.array([t for t, _ in self._speed]), np.array([v for _, v in self._speed]))

    def figures(self, imu: int) -> Figures:
        """The figures of one accelerometer; empty curves where nothing was learned."""
        engine = self.calibrator.engine(imu) if imu in self.calibrator.imus else None
        nothing = Curve(np.zeros(0), np.zeros(0))
        if engine is None or engine.solution() is None:
            return Figures(self._course(imu), nothing, nothing, nothing, None)
        before, after = self._free(imu, engine)
        return Figures(
            self._course(imu), before, after, self._innovation(engine), self._observability(engine)
        )

    # How

    def _tick(self, t: float) -> None:
        if self._piece is None:
            drawn = self.duration_s + PAUSE_S if self._pieces else 0.0
            self._piece = _Piece(t, t, drawn)
        elif t > self._piece.last:
            self._piece = _Piece(self._piece.first, t, self._piece.drawn)

    def _begin_anew(self) -> None:
        if self._piece is not None:
            self._pieces.append(self._piece)
        self._piece = None
        self._next_point = -np.inf

    def _shown(self, t: float) -> float:
        piece = self._piece
        return 0.0 if piece is None else t - piece.first + piece.drawn

    def _fix(self, fix: GpsFix) -> None:
        """Trust goes in spans from fix to fix; a gap in the fixes shows as its reason."""
        trust = self.calibrator.trust
        if self._piece is None or fix.receiver != trust.receiver:
            return
        now = self._shown(min(fix.t, self._piece.last + 1.0))
        if now < 0.0:
            return
        reason = "" if trust.is_open else (trust.reason.value if trust.reason else "waiting")
        last = self._spans[-1] if self._spans else Span(0.0, 0.0, reason)
        if now < last.end:
            return
        if last.reason == reason and self._spans:
            self._spans[-1] = Span(last.start, now, reason)
        else:
            self._spans.append(Span(last.end, now, reason))
        if not self._speed or now - self._speed[-1][0] >= SPEED_S:
            self._speed.append((now, float(np.hypot(fix.v_n, fix.v_e))))

    def _note(self, t: float) -> None:
        if t < self._next_point:
            return
        self._next_point = t + POINT_S
        for imu in self.calibrator.imus:
            engine = self.calibrator.engine(imu)
            solution = engine.solution()
            if solution is None:
                continue
            scale = solution.theta[:3]
            held = self.calibrator.parameters.six(imu)
            sigma = np.sqrt(np.diag(six_covariance(solution)))
            seen = assess(six_information(solution), engine.settings.needs)
            self._points.setdefault(imu, []).append(
                (
                    np.array([self._shown(t)]),
                    np.concatenate([scale, -solution.theta[3:6] / scale]),
                    sigma,
                    np.array([*held.scale, *held.offset]),
                    np.array(seen.coverage.per_parameter),
                )
            )

    def _observability(self, engine: Engine) -> Observability | None:
        solution = engine.solution()
        if solution is None:
            return None
        return assess(six_information(solution), engine.settings.needs, self.calibrator.kind)

    def _course(self, imu: int) -> Course:
        points = self._points.get(imu, [])
        if not points:
            return Course(np.zeros(0), *(np.zeros((0, 6)) for _ in range(4)))
        t, *six = (np.array(column) for column in zip(*points, strict=True))
        return Course(t[:, 0], *six)

    def _free(self, imu: int, engine: Engine) -> tuple[Curve, Curve]:
        solution = engine.solution()
        if solution is None:
            raise KeyError(imu)
        held = self.calibrator.parameters.six(imu)
        scale = np.array(held.scale)
        sixes = (np.concatenate([scale, -scale * np.array(held.offset)]), solution.theta[:6])
        chain = intervals([(c.stretch, c.fixes) for c in engine.chunks], engine.point)
        states = list(engine.states)
        runs = _runs(chain, [x.start for x in chain])
        # Both end with the newest flight; states may reach further back.
        of_runs = _runs(states, [s.t for s in states])[-len(runs) :]
        places = self._places([(run[0].start, run[-1].end) for run in runs])
        times, errors = [np.zeros(0)], [np.zeros((2, 0))]
        for run, of_run, piece in zip(runs[-len(of_runs) :], of_runs, places, strict=False):
            if piece is not None:
                got = free_errors(run, of_run, sixes, horizon_s=FREE_S)
                times.append(piece.time(got.t))
                errors.append(got.error)
        t, both = np.concatenate(times), np.concatenate(errors, axis=1)
        return Curve(t, both[0]), Curve(t, both[1])

    def _innovation(self, engine: Engine) -> Curve:
        states = list(engine.states)
        runs = _runs(states, [s.t for s in states])
        times, lengths = [np.zeros(0)], [np.zeros(0)]
        for run, piece in zip(runs, self._places([(r[0].t, r[-1].t) for r in runs]), strict=True):
            if piece is not None:
                times.append(piece.time(np.array([s.t for s in run])))
                residual = np.nan_to_num(np.array([s.innovation for s in run]))
                lengths.append(np.linalg.norm(residual, axis=1))
        return Curve(np.concatenate(times), np.concatenate(lengths))

    def _places(self, ranges: list[tuple[float, float]]) -> list[_Piece | None]:
        """The run of the clock that each time range is of, the latest possible, in order."""
        left = list(self._pieces)
        placed: list[_Piece | None] = []
        for start, end in reversed(ranges):
            piece = None
            while left and piece is None:
                last = left.pop()
                if last.first - CLOCK_MARGIN_S <= start and end <= last.last + CLOCK_MARGIN_S:
                    piece = last
            placed.insert(0, piece)
        return placed


def _runs(items: list[Item], times: list[float]) -> list[list[Item]]:
    """Cut where the clock goes back: a reboot, or another recording."""
    back = [i for i in range(1, len(times)) if times[i] < times[i - 1]]
    cuts = [0, *back, len(items)]
    return [items[a:b] for a, b in itertools.pairwise(cuts) if b > a]
