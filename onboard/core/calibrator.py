"""The door of the core: samples in, calibrations out.

Live stream and recording go the same way: decoder, :meth:`Calibrator.feed`, chunks of about ten
seconds, one :class:`~onboard.core.engine.Engine` per accelerometer.  Nothing here depends on when
a sample is handed in, only on the order of samples and on their own times, so the result of a
stream and of its recording are the same numbers.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.accelerometer import SixParameters, parameter_names
from onboard.core.assembly import Assembly
from onboard.core.engine import Chunk, Engine
from onboard.core.impossible import impossible
from onboard.core.parameters import ParametersInForce
from onboard.core.portions import merged
from onboard.core.report import calibration_of
from onboard.core.result import Calibration
from onboard.core.samples import (
    AirData,
    AttitudeSample,
    EkfBias,
    GpsFix,
    ImuSample,
    ParameterValue,
    Sample,
    Throttle,
    VehicleState,
    Vibration,
)
from onboard.core.saving import SavedEngine, dump, load
from onboard.core.settings import EstimatorSettings
from onboard.core.trust import Reason, TrustWindow, WindowClosed, WindowOpened

Array = NDArray[np.float64]

OF_ACCELEROMETER = {name: imu for imu in range(1, 6) for name in parameter_names(imu).six}
OTHER_CLOCK_S = 60.0
"""No stream lags the inertial one by more: what does is of another source, or garbage."""
AHEAD_OF_IMU_S = 5.0
"""Nor is one further ahead: taken in, a single such stamp would make all that follow late."""
MOST_SAVED = 16
"""Portions that are saved: enough for folds and clusters."""
BACKWARDS_S = 1.0
"""A clock that goes back by more is a reboot; by less, a message that was overtaken."""


@dataclass(frozen=True, slots=True)
class Restarted:
    """The autopilot's clock began anew: inertial states are gone, sums stay."""

    t: float
    reason: str


@dataclass(frozen=True, slots=True)
class Advanced:
    """A chunk of flight was processed: calibrations have changed."""

    t: float


@dataclass(frozen=True, slots=True)
class FlightEnded:
    """Disarmed: the estimates were refined over the whole flight."""

    t: float


Event = WindowOpened | WindowClosed | Restarted | Advanced | FlightEnded


class Calibrator:
    """Estimates the six numbers of every accelerometer from a stream of samples."""

    def __init__(self, settings: EstimatorSettings | None = None) -> None:
        """Take the settings."""
        self.settings = settings = settings or EstimatorSettings()
        self.parameters = ParametersInForce()
        self._trust = TrustWindow(settings.trust)
        self._assembly = Assembly(settings)
        self._engines: dict[int, Engine] = {}
        self._waiting: dict[int, SavedEngine] = {}
        self._counts: Counter[str] = Counter()
        self._newest = -np.inf
        self._first = np.inf
        self._armed: bool | None = None
        self._finished = False
        self.kind = ""
        """Of vehicle, as it says itself: what to fly depends on it."""
        self.ekf_bias: dict[int, EkfBias] = {}

    @property
    def first_sample(self) -> float:
        """Time of the first inertial sample since the clock last began, s."""
        return self._first

    @property
    def trust(self) -> TrustWindow:
        """The trust window."""
        return self._trust

    @property
    def imus(self) -> tuple[int, ...]:
        """Accelerometers that are estimated, in order."""
        return tuple(sorted(self._engines))

    def engine(self, imu: int) -> Engine:
        """The engine of one accelerometer (for diagnosis and benchmarks).

        Raises:
            KeyError: that accelerometer has not been seen.
        """
        return self._engines[imu]

    def feed(self, sample: Sample) -> tuple[Event, ...]:
        """Take one sample, in order of arrival.  Never raises on data: it counts."""
        refusal = impossible(sample)
        if refusal is not None:
            if not isinstance(sample, ParameterValue):  # unset ones are NaN: nothing is lost
                self._counts[refusal] += 1
            return ()
        if isinstance(sample, ImuSample):
            events = (
                self._clock(sample.t)
                if sample.t > self._newest + 1.0 or (sample.t < self._newest)
                else ()
            )
            self._newest = max(self._newest, sample.t)
            if not np.isfinite(self._first):
                self._first = sample.t
            self._assembly.imu(sample, self.parameters)
            # A receiver that fell silent says nothing more: only the passing of time shows it.
            return events + self._judged(sample)
        if isinstance(sample, AttitudeSample):
            if self._ahead(sample.t):
                self._counts["attitude_ahead"] += 1
                return ()
            self._assembly.attitude(sample)
            return ()
        if isinstance(sample, ParameterValue):
            self._parameter(sample)
            return ()
        if isinstance(sample, GpsFix):
            return self._fix(sample)
        if isinstance(sample, Vibration | Throttle | AirData):
            self._assembly.slow(sample)
            return ()
        if isinstance(sample, EkfBias):
            self.ekf_bias[sample.core] = sample
            return ()
        events = self._judged(sample)
        if isinstance(sample, VehicleState):
            self.kind = sample.kind or self.kind
            events += self._vehicle(sample)
        return events

    def restart(self, reason: str = "another recording") -> tuple[Event, ...]:
        """The clock begins anew: forget the inertial states, keep the sums."""
        events = self._advance(everything=True)
        ended, self._newest = float(self._newest), -np.inf
        self._armed = None
        self._assembly.clear()
        return (*events, *self._trust.restart(ended), Restarted(ended, reason))

    def begin_anew(self, imu: int) -> None:
        """Forget what was learned of one accelerometer: it is known to be wrong."""
        self._assembly.forget(imu)
        self._waiting.pop(imu, None)
        if self._engines.pop(imu, None) is not None:
            self._counts["begun_anew"] += 1

    def finish(self) -> tuple[Event, ...]:
        """End of the recording or of the window: process what is pending, refine."""
        events = self._advance(everything=True)
        for engine in self._engines.values():
            engine.finish()
        self._finished = True
        return (*events, *self._trust.finish())

    def calibration(self, imu: int) -> Calibration:
        """What is known of accelerometer ``imu`` now.

        Raises:
            KeyError: that accelerometer has not been seen.
        """
        return self.calibration_with(imu, self._engines[imu])

    def calibration_with(self, imu: int, engine: Engine) -> Calibration:
        """The same by another engine over the same flight (a diagnosis with more physics)."""
        rejected = Counter(self._trust.rejected)
        rejected.update(self._assembly.refused(imu))
        rejected.update(self._counts)
        return calibration_of(
            imu,
            engine,
            self.parameters,
            finished=self._finished,
            kind=self.kind,
            rejected={k: n for k, n in rejected.items() if n},
        )

    def to_bytes(self) -> bytes:
        """Sums of every accelerometer, to go on with after a restart."""
        saved = []
        for imu, engine in sorted(self._engines.items()):
            portions = merged(engine.all_portions, MOST_SAVED)
            if portions:
                prior = engine.model.prior[:6]
                saved.append(
                    SavedEngine(
                        imu,
                        self.parameters.device_id(imu),
                        tuple(float(x) for x in prior),
                        engine.point,
                        engine.noise,
                        engine.trusted_s,
                        tuple(portions),
                    )
                )
        # Those that wait for their accelerometer to show up are not lost by a short run.
        saved.extend(x for imu, x in self._waiting.items() if imu not in self._engines)
        return dump(saved)

    @classmethod
    def from_bytes(cls, data: bytes, settings: EstimatorSettings | None = None) -> Calibrator:
        """A calibrator that goes on where another stopped.

        Raises:
            StateError: damaged, or of another version.
        """
        made = cls(settings)
        made._waiting = {e.imu: e for e in load(data)}
        return made

    def _engine_of(self, imu: int) -> Engine:
        """The engine, new or with the sums that were saved for this very sensor."""
        if imu in self._engines:
            return self._engines[imu]
        saved = self._waiting.pop(imu, None)
        identity = self.parameters.device_id(imu)
        if saved is not None and saved.device_id == identity:
            engine = Engine(self.settings, np.array(saved.prior), saved.point, saved.noise)
            sizes = {p.sums.size for p in saved.portions}
            if sizes == {engine.model.size}:
                engine.restore(list(saved.portions), saved.trusted_s)
                self._counts["restored"] += 1
                self._engines[imu] = engine
                return engine
        if saved is not None:
            self._counts["saved_of_another_sensor"] += 1
        self._engines[imu] = Engine(self.settings, self._prior(imu))
        return self._engines[imu]

    def _parameter(self, parameter: ParameterValue) -> None:
        """Take a report; what was taken for raw before the six were known, was not raw."""
        imu = OF_ACCELEROMETER.get(parameter.name)
        unknown = imu is not None and not self.parameters.known(imu)
        self.parameters.set(parameter.name, parameter.value)
        if imu is None or not unknown or not self.parameters.known(imu):
            return
        if self.parameters.six(imu) != SixParameters():
            self._assembly.forget(imu)
            if self._engines.pop(imu, None) is not None:
                self._counts["begun_anew_with_parameters"] += 1

    def _clock(self, t: float) -> tuple[Event, ...]:
        """Notice a reboot."""
        if not t < self._newest - BACKWARDS_S:
            return ()
        self._counts["reboots"] += 1
        return self.restart("reboot")

    def _ahead(self, t: float) -> bool:
        """True for a stamp that the inertial stream is too far from reaching."""
        return bool(np.isfinite(self._newest)) and t - self._newest > AHEAD_OF_IMU_S

    def _judged(self, sample: Sample) -> tuple[Event, ...]:
        """What the trust window says; outages are counted, for no fix is there to be refused."""
        events = self._trust.feed(sample)
        for event in events:
            if isinstance(event, WindowClosed) and event.reason is Reason.GPS_GAP:
                self._counts[event.reason.value] += 1
        return events

    def _fix(self, fix: GpsFix) -> tuple[Event, ...]:
        if abs(fix.t - self._newest) > OTHER_CLOCK_S and np.isfinite(self._newest):
            # Its clock is not the boot clock (another source, or garbage); a reboot shows in the
            # inertial samples first.
            self._counts["gps_other_clock"] += 1
            return ()
        before = self._trust.receiver
        events = self._judged(fix)
        if self._trust.receiver not in (None, fix.receiver):
            return events
        if before not in (None, fix.receiver):
            # What was saved holds the latency and the antenna of a receiver that is given up.
            self._counts["another_receiver"] += 1
            for imu in {*self._engines, *self._waiting}:
                self.begin_anew(imu)
        if self._ahead(fix.t):
            self._counts["gps_ahead"] += 1
            return events
        if self._assembly.fix(fix, trusted=self._trust.is_open):
            self._finished = False
            return (*events, *self._advance())
        return events

    def _vehicle(self, state: VehicleState) -> tuple[Event, ...]:
        if state.armed is None:
            return ()
        before, self._armed = self._armed, state.armed
        if not (before and not state.armed):
            return ()
        events = self._advance(everything=True)
        for engine in self._engines.values():
            engine.finish()
        return (*events, FlightEnded(state.t))

    def _advance(self, *, everything: bool = False) -> tuple[Event, ...]:
        made: dict[int, list[Chunk]] = self._assembly.take(self.parameters, everything=everything)
        newest = -np.inf
        for imu, chunks in made.items():
            saved = self._waiting.get(imu)
            if saved is not None and saved.device_id is not None and not self.parameters.known(imu):
                self._counts["before_parameters"] += len(chunks)
                continue  # whether this is the sensor of the saved sums is not known yet
            for chunk in chunks:
                self._engine_of(imu).add(chunk)
                newest = max(newest, float(chunk.fixes.t[-1]))
        return (Advanced(float(newest)),) if np.isfinite(newest) else ()

    def _prior(self, imu: int) -> Array:
        six = self.parameters.six(imu)
        scale, offset = np.array(six.scale), np.array(six.offset)
        return np.concatenate([scale, -scale * offset])
