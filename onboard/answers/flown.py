"""A recording as a flight: what the sensor level has found, and the vehicle's own streams.

The samples are kept while they are read: where the vehicle touched the ground shows only when the
whole flight is known, and neither level may learn from an impact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeVar

import numpy as np

from onboard.answers.answer import Answer
from onboard.answers.kept_motion import motion_of
from onboard.answers.recorded import PAUSE_S, Recorded, later, unanswered
from onboard.answers.replay import Reading, read
from onboard.answers.sensors import NO_SENSORS, sensors_of
from onboard.answers.stands import NO_FLIGHT, fixes_of, said_to_stand, with_landings, without_flight
from onboard.core.diagnosis.records import Diagnosis
from onboard.core.estimate.comparison import Comparison
from onboard.core.estimate.result import Calibration
from onboard.core.inputs.airborne import STILL_RATE_RAD_S
from onboard.core.inputs.boot_time import NEXT_S, Boots
from onboard.core.inputs.range_checks import impossible
from onboard.core.inputs.samples import (
    AirData,
    Battery,
    ImuSample,
    Outputs,
    ParameterValue,
    Sample,
    VehicleState,
)
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array, Mask
from onboard.core.maths.spans import joined
from onboard.core.vehicle.copter import carried_by_rotors
from onboard.core.vehicle.kind import kind_by_motion
from onboard.core.vehicle.repeats import measured
from onboard.core.vehicle.same_motion import Disagreement, disagreement
from onboard.core.vehicle.signals import Signals, Stream
from onboard.core.vehicle.spans import grounded_spans, lasting_height, scatter_near
from onboard.core.vehicle.touches import touched_spans
from onboard.core.vehicle.trajectory import Sensors
from onboard.recordings.recording import Recording

FASTEST_HZ: Final = 100.0
"""Inertial samples beyond this rate are averaged: rotors follow a command within hundredths of a
second and a vehicle more slowly, so that what is faster is vibration [physics]."""
HIT_THE_GROUND: Final = ("copter", "plane")
"""Kinds of vehicles whose bounces are told from flight."""

S = TypeVar("S", Outputs, Battery, AirData)


class Flown:
    """Collects a recording, then puts it through the sensor level without what was on the ground.

    A reader for :func:`onboard.answers.replay.read`.
    """

    def __init__(self, imu: int = 1, *, airborne: bool = False) -> None:
        """Take which accelerometer to look at, and whether all of it is flight."""
        self.airborne = airborne
        self.recorded = Recorded((imu,))
        self.imu = imu
        self._kept: list[Sample] = []
        self.grounded: list[tuple[float, float]] = []
        self.ground = 0.0
        self.flying: list[Batch] = []
        self.kind = ""
        self.heard = set[int]()
        """Accelerometers of which there are samples."""
        self._boots, self._shift = Boots(), 0.0
        self._held: list[Sample] = []

    @property
    def imus(self) -> tuple[int, ...]:
        """Accelerometers that can be asked about."""
        return self.recorded.imus

    @property
    def parameters(self) -> Mapping[str, float]:
        """The autopilot's parameters as they were reported last, by name."""
        return self.recorded.parameters

    @property
    def standing_s(self) -> float:
        """Time on the ground, s."""
        return self.recorded.standing_s

    @property
    def refused(self) -> Mapping[str, int]:
        """Fixes that were refused, by reason, where GPS was never trusted; else empty."""
        return self.recorded.refused

    def feed(self, sample: Sample) -> object:
        """Keep a sample, but not of other accelerometers.

        Where the autopilot's clock begins anew, all that follows is later: streams of two boots are
        never held against each other.
        """
        if isinstance(sample, VehicleState) and sample.kind:
            self.kind = sample.kind
        if isinstance(sample, ImuSample):
            self.heard.add(sample.imu)
        if not isinstance(sample, ImuSample):
            self._held.append(sample)
        elif sample.imu == self.imu and impossible(sample) is None:
            before = self._boots.newest
            if self._boots.begins(sample.t):
                self._shift += before + PAUSE_S - sample.t
            self._held.append(sample)
        if not self._boots.doubtful:
            self._keep(sample.t if isinstance(sample, ImuSample) else math.inf)
        return None

    def _keep(self, now: float) -> None:
        """Keep what waited for its clock; stamps that no other one confirmed were damaged."""
        for sample in self._held:
            if isinstance(sample, ImuSample) and not 0.0 <= now - sample.t <= NEXT_S:
                continue
            if self._shift and sample.t is not None:
                self._kept.append(later(sample, sample.t, self._shift))
            else:
                self._kept.append(sample)
        self._held.clear()

    def restart(self) -> object:
        """One recording is one flight: nothing to forget."""
        return None

    def finish(self) -> object:
        """Everything is known now: find the ground, and learn from the rest."""
        self._keep(math.inf)
        fixes = fixes_of(self._kept)
        if fixes:
            t = np.array([f.t for f in fixes])
            v = np.array([(f.v_n, f.v_e, math.nan if f.v_d is None else f.v_d) for f in fixes])
            height = np.array([f.altitude for f in fixes])
            if not self.airborne:
                # What nobody says of it a vehicle shows: wings stand where no hover is.
                kind = self.kind or kind_by_motion(t, v, height)
                self.grounded = grounded_spans(
                    t,
                    v,
                    height,
                    said=said_to_stand(self._kept, fixes),
                    carried=self._carried(t, v),
                    rolls=self.kind != "copter",
                    wings=kind == "plane",
                )
            self.ground = float(np.percentile(lasting_height(t, height), 0.5))
            if self.grounded and self.kind in HIT_THE_GROUND:
                self.grounded = joined([*self.grounded, *self._touched(t, v, height)])
        step = _averaged_over(self._kept)
        for sample in with_landings(_slower(self._kept, step), self.grounded):
            self.recorded.feed(sample)
        return self.recorded.finish()

    def _carried(self, t: Array, v_n: Array) -> Mask | None:
        """(n,) where rotors carry the vehicle at fixes; None where nobody knows.

        What stands in spite of them (its battery is empty, it lies on its back) does not turn.
        """
        lifted = carried_by_rotors(self.signals(), t, v_n)
        turned = [(s.t, *s.w_b) for s in self._kept if isinstance(s, ImuSample) and s.w_b]
        if lifted is None or len(turned) < 2:
            return None
        rows = np.array(turned)
        return lifted & (scatter_near(t, rows[:, 0], rows[:, 1:]) > STILL_RATE_RAD_S)

    def _touched(self, t: Array, v_n: Array, height: Array) -> list[tuple[float, float]]:
        """Bounces, s, by fixes (n,) and what the accelerometer felt."""
        felt = np.array([(s.t, *s.f_b) for s in self._kept if isinstance(s, ImuSample)])
        if not len(felt):
            return []
        return touched_spans(t, v_n, height, self.ground, felt[:, 0], felt[:, 1:])

    def answer(self, imu: int) -> Answer:
        """What the sensor level says."""
        return self.recorded.answer(imu)

    def compared(self, calibrations: list[Calibration]) -> Comparison | None:
        """Nothing: one accelerometer is looked at."""
        del calibrations
        return None

    def disagreement(self, *, derived: bool) -> Disagreement | None:
        """Two quantities that are not of one motion; None where all are."""
        return disagreement(motion_of(self._kept), derived=derived)

    def signals(self) -> Signals:
        """The vehicle's streams."""
        kept = self._kept
        outputs = [s for s in kept if isinstance(s, Outputs)]
        normalised = bool(outputs) and outputs[-1].normalised
        air = [s for s in kept if isinstance(s, AirData)]
        blown = [s for s in air if s.wind_n is not None and s.wind_e is not None]
        airspeed, dead = measured(
            _stream([s for s in air if s.airspeed is not None], lambda s: (s.airspeed or 0.0,))
        )
        return Signals(
            outputs=_stream(outputs, lambda s: s.values),
            battery=_stream(
                [s for s in kept if isinstance(s, Battery)],
                lambda s: (s.voltage, math.nan if s.current is None else s.current),
            ),
            airspeed=airspeed,
            airspeed_dead=dead,
            ekf_wind=_stream(
                [s for s in blown if s.wind_sigma is None],
                lambda s: (s.wind_n or 0.0, s.wind_e or 0.0),
            ),
            measured_wind=_stream(
                [s for s in blown if s.wind_sigma is not None],
                lambda s: (s.wind_n or 0.0, s.wind_e or 0.0, s.wind_sigma or 0.0),
            ),
            parameters={
                s.name: s.value
                for s in kept
                if isinstance(s, ParameterValue) and impossible(s) is None
            },
            kind=self.kind,
            normalised=normalised,
        )


@dataclass(frozen=True, slots=True)
class FlownRecording:
    """A recording that was read: its sensor level's answer and its vehicle level's input."""

    source: Reading
    diagnosis: Diagnosis
    signals: Signals
    sensors: Sensors
    batches: tuple[Batch, ...]
    grounded: tuple[tuple[float, float], ...]
    ground: float
    disagreement: Disagreement | None = None

    @property
    def name(self) -> str:
        """Of the file."""
        return self.source.recordings[0].path.name

    @property
    def derived(self) -> bool:
        """Whether its force is the slope of its velocity, and no accelerometer measured it."""
        return any(r.derived for r in self.source.recordings)

    @property
    def without_flight(self) -> str:
        """Why nothing can be said of it where there is no flight to ask about."""
        vehicle = self.source.vehicle
        if vehicle.lacking:
            return f"{NO_FLIGHT}: there is {vehicle.lacking}; {vehicle.to_do(self.diagnosis.imu)}"
        table = any(r.kind == "table" for r in self.source.recordings)
        return without_flight(standing=bool(self.grounded), table=table)

    @property
    def autopilot(self) -> str:
        """The kind of autopilot."""
        return self.source.autopilot


def flown(
    path: str | Path | Recording,
    *,
    imu: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> FlownRecording:
    """Read a recording and ask its sensor level.

    Args:
        path: the file, or opened already.
        imu: which accelerometer; the first that there is if None.
        progress: told the share of the reading that is done.

    Raises:
        RecordingError: a file that cannot be used.
    """
    wanted = imu or 1
    collected = Flown(wanted, airborne=isinstance(path, Recording) and path.airborne)
    source = read([path], collected, imu=imu, progress=progress)
    if imu is None and collected.heard and wanted not in collected.heard:
        return flown(path, imu=min(collected.heard), progress=progress)
    derived = any(r.derived for r in source.recordings)
    known = wanted in collected.imus
    if known and not derived:
        diagnosis = collected.answer(wanted).diagnosis
    else:
        diagnosis = unanswered(source.vehicle.unanswered(wanted)).diagnosis
    batches = collected.recorded.sampled(wanted) if known else ()
    return FlownRecording(
        source,
        diagnosis,
        collected.signals(),
        NO_SENSORS if derived else sensors_of(diagnosis, collected.recorded.engine(wanted)),
        batches,
        tuple(collected.grounded),
        collected.ground,
        collected.disagreement(derived=derived),
    )


def _stream(samples: Sequence[S], values: Callable[[S], tuple[float, ...]]) -> Stream:
    """Samples as a stream in order of time; those of another width than most are left out."""
    rows = [values(s) for s in samples]
    if not rows:
        return Stream()
    widths = [len(r) for r in rows]
    width = max(set(widths), key=widths.count)
    t = np.array([s.t for s, r in zip(samples, rows, strict=True) if len(r) == width])
    x = np.array([r for r in rows if len(r) == width], dtype=np.float64)
    t, first = np.unique(t, return_index=True)
    return Stream(t, x[first])


def _averaged_over(samples: list[Sample]) -> int:
    """How many inertial samples to average."""
    t = [s.t for s in samples if isinstance(s, ImuSample)]
    if len(t) < 100:
        return 1
    step = float(np.median(np.diff(t)))
    return max(1, round(1.0 / (step * FASTEST_HZ))) if step > 0.0 else 1


def _slower(samples: list[Sample], over: int) -> list[Sample]:
    """Inertial samples as means over some."""
    if over < 2:
        return samples
    out: list[Sample] = []
    group: list[ImuSample] = []
    for sample in samples:
        if not isinstance(sample, ImuSample):
            out.append(sample)
            continue
        group.append(sample)
        if len(group) == over:
            out.append(_mean(group))
            group = []
    return out


def _mean(group: list[ImuSample]) -> ImuSample:
    n, last = len(group), group[-1]
    f = [sum(s.f_b[i] for s in group) / n for i in range(3)]
    rates = [s.w_b for s in group if s.w_b is not None]
    w = [sum(r[i] for r in rates) / len(rates) for i in range(3)] if rates else None
    return ImuSample(
        sum(s.t for s in group) / n,
        last.imu,
        (f[0], f[1], f[2]),
        None if w is None else (w[0], w[1], w[2]),
        last.temperature,
        last.f_step,
        last.w_step,
        last.source,
    )
