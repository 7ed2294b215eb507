"""How a calibration came about: its course over the flight, kept while a recording is read.

A :class:`Chronicle` stands before a calibrator and passes everything on; when GPS was trusted, how
fast the vehicle was, and which parameters were in force it notes as they go by.  Estimates are
those of the answer's own sums, cut off at each moment: what was known with what had been flown by
then, so that a course ends at the answer.  Times are seconds since the first inertial sample,
recordings of several flights one after the other.
"""

from __future__ import annotations

import itertools
import math
from array import array
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.estimate.calibration_record import claimed_covariance, six_information
from onboard.core.estimate.calibrator import OF_ACCELEROMETER, Calibrator
from onboard.core.estimate.dead_reckoning import free_errors
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.events import Event, Restarted
from onboard.core.estimate.gyro_axes import gyro_sigma
from onboard.core.estimate.observability import Observability, assess
from onboard.core.estimate.solution import solve
from onboard.core.inputs.blocks import Block
from onboard.core.inputs.samples import GpsFix, ImuSample, ParameterValue, Sample
from onboard.core.maths.accelerometer import parameters_of

Array = NDArray[np.float64]

MOST_POINTS = 60
"""Of a course: each is a solution of its own."""
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
    """What was known with the flight up to then: ``t`` (n,) s, the others (n, 6), as SIX_NAMES.

    ``coverage`` in percent; ``in_force`` are the parameters that the autopilot used.  Timing and
    noise are those of the whole flight: the last row is the answer.
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
    residual (m/s), which the certificate bounds; both of the flight whose states are kept.
    """

    course: Course
    before: Curve
    after: Curve
    innovation: Curve
    seen: Observability | None


@dataclass(slots=True, eq=False)
class _Piece:
    """One run of the boot clock: its first and last inertial sample, and where it is drawn."""

    first: float
    last: float
    drawn: float

    def time(self, t: Array) -> Array:
        shown: Array = t - self.first + self.drawn
        return shown


class Chronicle:
    """A calibrator that is watched: samples go through it."""

    def __init__(self, calibrator: Calibrator) -> None:
        self.calibrator = calibrator
        self._pieces: list[_Piece] = []
        self._piece: _Piece | None = None
        self._engines: dict[int, Engine] = {}
        self._left_open: dict[int, Array] = {}
        self._held: dict[int, list[tuple[float, Array]]] = {}
        self._spans: list[Span] = []
        self._speed = (array("d"), array("d"))

    # What goes by

    def feed(self, sample: Sample) -> tuple[Event, ...]:
        """Pass a sample on, and note what came of it."""
        events = self.calibrator.feed(sample)
        if events and any(isinstance(event, Restarted) for event in events):
            self._begin_anew()
        if isinstance(sample, ImuSample):
            self._tick(sample.t)
        else:
            self._note(sample)
        return events

    def feed_block(self, block: Block) -> tuple[Event, ...] | None:
        """Pass many samples on at once; None, and none was, if they are to be fed one by one."""
        if self._piece is None or not self.calibrator.admits(block):
            return None
        every: list[Event] = []
        for sample, t, events in self.calibrator.go_through(block):
            every += events
            self._tick(t)
            self._note(sample)
        return tuple(every)

    def restart(self) -> tuple[Event, ...]:
        """Another recording of the same vehicle begins."""
        events = self.calibrator.restart()
        self._begin_anew()
        return events

    def finish(self) -> tuple[Event, ...]:
        """There are no more recordings."""
        events = self.calibrator.finish()
        self._begin_anew()
        return events

    def take(self, imu: int, engine: Engine, left_open: Array) -> None:
        """What gave the answer for one accelerometer.

        Args:
            imu: which.
            engine: has its sums.
            left_open: (6, 6) variance of scale and beta that the model itself leaves open.
        """
        self._engines[imu], self._left_open[imu] = engine, left_open

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
        t, v = self._speed
        return Curve(np.array(t), np.array(v))

    def figures(self, imu: int) -> Figures:
        """The figures of one accelerometer; empty curves where nothing was learned."""
        engine = self._engines.get(imu)
        if engine is None or engine.solution() is None:
            nothing = Curve(np.zeros(0), np.zeros(0))
            course = Course(np.zeros(0), *(np.zeros((0, 6)) for _ in range(4)))
            return Figures(course, nothing, nothing, nothing, None)
        before, after = self._free(imu, engine)
        return Figures(
            self._course(imu, engine),
            before,
            after,
            self._innovation(engine),
            self._observability(imu, engine),
        )

    # How

    def _tick(self, t: float) -> None:
        if self._piece is None:
            drawn = self.duration_s + PAUSE_S if self._pieces else 0.0
            self._piece = _Piece(t, t, drawn)
        elif t > self._piece.last:
            self._piece.last = t

    def _note(self, sample: Sample | None) -> None:
        if isinstance(sample, GpsFix):
            self._fix(sample)
        elif isinstance(sample, ParameterValue) and sample.name in OF_ACCELEROMETER:
            self._hold(OF_ACCELEROMETER[sample.name])

    def _begin_anew(self) -> None:
        if self._piece is not None:
            self._pieces.append(self._piece)
        self._piece = None

    def _hold(self, imu: int) -> None:
        """One of the six was reported: what is in force from now on."""
        now = 0.0 if self._piece is None else self._shown(self._piece.last)
        six = self.calibrator.parameters.six(imu)
        self._held.setdefault(imu, []).append((now, np.array([*six.scale, *six.offset])))

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
        times, speeds = self._speed
        if not times or now - times[-1] >= SPEED_S:
            times.append(now)
            speeds.append(float(np.hypot(fix.v_n, fix.v_e)))

    def _course(self, imu: int, engine: Engine) -> Course:
        """Solutions of the sums up to some of the blocks, the last of all of them."""
        blocks, more = engine.all_blocks, self._left_open.get(imu)
        times = [
            math.nan if piece is None else float(piece.time(np.array(p.end)))
            for p, piece in zip(blocks, self._places([p.start for p in blocks]), strict=True)
        ]
        last = len(blocks) - 1
        gyro = gyro_sigma(self.calibrator.parameters.R_bs)
        rows = []
        for i in np.unique(np.linspace(0, last, MOST_POINTS).round().astype(int)):
            solution = engine.solution() if i == last else None
            solution = solution or solve(blocks[: i + 1], engine.model)
            seen = assess(six_information(solution, more), engine.settings.needs)
            rows.append(
                (
                    np.array([times[i]]),
                    parameters_of(solution.theta),
                    np.sqrt(np.diag(claimed_covariance(solution, gyro, more))),
                    self._in_force(imu, times[i]),
                    np.array(seen.coverage.per_parameter),
                )
            )
        t, *six = (np.array(column) for column in zip(*rows, strict=True))
        return Course(t[:, 0], *six)

    def _observability(self, imu: int, engine: Engine) -> Observability | None:
        solution = engine.solution()
        if solution is None:
            return None
        known = six_information(solution, self._left_open.get(imu))
        return assess(known, engine.settings.needs, self.calibrator.kind)

    def _in_force(self, imu: int, t: float) -> Array:
        """(6,) what the autopilot used then; what was first reported, before that."""
        held = self._held.get(imu)
        if not held:
            return np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        return next((six for since, six in reversed(held) if since <= t), held[0][1])

    def _free(self, imu: int, engine: Engine) -> tuple[Curve, Curve]:
        solution = engine.solution()
        if solution is None:
            raise KeyError(imu)
        held = self.calibrator.parameters.six(imu)
        sixes = (held.as_linear(), solution.theta[:6])
        chain = engine.intervals.of([(c.segment, c.fixes) for c in engine.batches], engine.point)
        states = list(engine.states)
        known = {id(piece): run for piece, run in self._runs([s.t for s in states])}
        times, errors = [np.zeros(0)], [np.zeros((2, 0))]
        for piece, run in self._runs(chain.start.tolist()):
            if of_run := known.get(id(piece)):
                got = free_errors(chain[run], states[of_run], sixes, horizon_s=FREE_S)
                times.append(piece.time(got.t))
                errors.append(got.error)
        t, both = np.concatenate(times), np.concatenate(errors, axis=1)
        return Curve(t, both[0]), Curve(t, both[1])

    def _innovation(self, engine: Engine) -> Curve:
        t, size = engine.states.t, np.linalg.norm(np.nan_to_num(engine.states.innovation), axis=1)
        times, lengths = [np.zeros(0)], [np.zeros(0)]
        for piece, run in self._runs(t.tolist()):
            times.append(piece.time(t[run]))
            lengths.append(size[run])
        return Curve(np.concatenate(times), np.concatenate(lengths))

    def _runs(self, times: list[float]) -> list[tuple[_Piece, slice]]:
        """Which of these times, in their order, are of one run of the clock each."""
        out, first = [], 0
        for piece, group in itertools.groupby(self._places(times), key=lambda placed: placed):
            last = first + sum(1 for _ in group)
            if piece is not None:
                out.append((piece, slice(first, last)))
            first = last
        return out

    def _places(self, times: list[float]) -> list[_Piece | None]:
        """The run of the clock that each of these times is of, the latest possible, in order."""
        left = list(self._pieces)
        placed: list[_Piece | None] = []
        piece, later = left.pop() if left else None, math.inf
        for t in reversed(times):
            if t > later:
                piece = left.pop() if left else None
            while piece is not None and not piece.first - CLOCK_MARGIN_S <= t <= (
                piece.last + CLOCK_MARGIN_S
            ):
                piece = left.pop() if left else None
            placed.append(piece)
            later = t
        return placed[::-1]
