"""The door of the core: samples in, calibrations out.

Live stream and recording go the same way: decoder, :meth:`Calibrator.feed`, batches of about ten
seconds, one :class:`~onboard.core.estimate.engine.Engine` per accelerometer.  Nothing here depends
on when a sample is handed in, only on the order of samples and on their own times, so the result of
a stream and of its recording are the same numbers.
"""

from __future__ import annotations

import copy
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from onboard.core.estimate.agreement import agrees
from onboard.core.estimate.calibration_record import calibration_of
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.result import Calibration
from onboard.core.estimate.saving import SavedEngine, dump, load
from onboard.core.estimate.settings import EstimatorSettings
from onboard.core.gps.trust import Reason, TrustWindow, WindowClosed, WindowOpened
from onboard.core.inputs.airborne import Ground
from onboard.core.inputs.assembly import Assembly
from onboard.core.inputs.boot_time import began_anew
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.range_checks import impossible
from onboard.core.inputs.samples import (
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
from onboard.core.inputs.segments import Batch
from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Seconds, merged

OF_ACCELEROMETER = {name: imu for imu in range(1, 6) for name in parameter_names(imu).six}
OTHER_CLOCK_S = 60.0
"""No stream lags the inertial one by more: what does is of another source, or garbage."""
AHEAD_OF_IMU_S = 5.0
"""Nor is one further ahead: taken in, a single such stamp would make all that follow late."""
MOST_SAVED = 16
"""Blocks that are saved: enough for folds and clusters."""
MOST_WAITING = 4
"""Sums of earlier starts that wait for a flight that agrees with them, the latest."""


@dataclass(frozen=True, slots=True)
class Restarted:
    """The autopilot's clock began anew: inertial states are gone, sums stay."""

    t: float
    reason: str


@dataclass(frozen=True, slots=True)
class Advanced:
    """A batch of flight was processed: calibrations have changed."""

    t: float


@dataclass(frozen=True, slots=True)
class FlightEnded:
    """Disarmed: the estimates were refined over the whole flight."""

    t: float


Event = WindowOpened | WindowClosed | Restarted | Advanced | FlightEnded


class Calibrator:
    """Estimates the six numbers of every accelerometer from a stream of samples."""

    def __init__(
        self, settings: EstimatorSettings | None = None, only: Collection[int] = ()
    ) -> None:
        """Take the settings.

        Args:
            settings: how it works.
            only: accelerometers to estimate, none named: all; nothing about one of them depends
                on whether others are estimated, too.
        """
        self.settings = settings = settings or EstimatorSettings()
        self._only = frozenset(only)
        self.parameters = ParametersInForce()
        self._trust = TrustWindow(settings.trust)
        self._assembly = Assembly(settings.assembly)
        self._engines: dict[int, Engine] = {}
        self._waiting: dict[int, list[SavedEngine]] = {}
        self._counts: Counter[str] = Counter()
        self._newest = -np.inf
        self._first = np.inf
        self._ground = Ground()
        self._finished = False
        self.flown_s = 0.0
        """Trusted flight that was taken in, s; it only grows."""
        self.kind = ""
        """Of vehicle, as it says itself: what to fly depends on it."""
        self.ekf_bias: dict[int, EkfBias] = {}

    @property
    def first_sample(self) -> float:
        """Time of the first inertial sample since the clock last began, s."""
        return self._first

    @property
    def standing_s(self) -> float:
        """Time on the ground, which teaches nothing, s."""
        return self._assembly.standing_s

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
        self._ground.forget()
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
        self._refine()
        self._finished = True
        return (*events, *self._trust.finish())

    def frozen(self) -> Calibrator:
        """A copy that keeps the flight as it is now, whatever this one is fed afterwards.

        The samples themselves are shared with this one: they do not change.
        """
        return copy.deepcopy(self)

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
            blocks = merged(engine.all_blocks, MOST_SAVED)
            if blocks:
                prior = engine.model.prior[:6]
                saved.append(
                    SavedEngine(
                        imu,
                        self.parameters.device_id(imu),
                        tuple(float(x) for x in prior),
                        engine.point,
                        engine.noise,
                        Seconds(engine.trusted_s, engine.brisk_s),
                        tuple(blocks),
                    )
                )
        # What waits for a flight that agrees with it is not lost by one that says too little.
        saved.extend(e for waiting in self._waiting.values() for e in waiting)
        return dump(saved)

    @classmethod
    def from_bytes(cls, data: bytes, settings: EstimatorSettings | None = None) -> Calibrator:
        """A calibrator beside which lies what another one had learned.

        Raises:
            StateError: damaged, or of another version.
        """
        made = cls(settings)
        made.lay_aside(data)
        return made

    def lay_aside(self, data: bytes) -> None:
        """Keep what was learned before (:meth:`to_bytes`) until a flight agrees with it.

        Accelerometer by accelerometer (:mod:`onboard.core.estimate.agreement`): whether it is of
        the sensor that is there now, identifiers do not tell, for they are the same on every board
        of a model.

        Raises:
            StateError: damaged, or of another version.
        """
        for engine in load(data):
            self._waiting.setdefault(engine.imu, []).append(engine)

    @property
    def waiting(self) -> tuple[int, ...]:
        """Accelerometers of which something learned before waits for a flight that agrees."""
        return tuple(sorted(self._waiting))

    def _engine_of(self, imu: int) -> Engine:
        """The engine of one accelerometer, made when it is first needed."""
        if imu not in self._engines:
            self._engines[imu] = Engine(self.settings, self._prior(imu))
        return self._engines[imu]

    def _refine(self) -> None:
        """A flight is over: refine, and take in of before what the flight agrees with."""
        for imu, engine in self._engines.items():
            engine.finish()
            waiting = self._waiting.pop(imu, [])
            for saved in waiting:
                self._judge_saved(engine, saved)

    def _judge_saved(self, engine: Engine, saved: SavedEngine) -> None:
        """Take sums of before in, drop them, or let them wait on."""
        identity = self.parameters.device_id(saved.imu)
        if None not in (identity, saved.device_id) and identity != saved.device_id:
            self._counts["saved_of_another_sensor"] += 1
            return
        # Sums of a sensor that said who it is wait until this one has said it, too.
        opinion = agrees(engine, saved) if identity == saved.device_id else None
        if opinion is None:
            waiting = self._waiting.setdefault(saved.imu, [])
            waiting.append(saved)
            del waiting[:-MOST_WAITING]
        elif opinion:
            self._counts["restored"] += 1
            engine.restore(saved.blocks, saved.point, saved.seconds)
        else:
            self._counts["saved_contradicted"] += 1

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
        if not began_anew(t, self._newest):
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
        """Cut what comes where the vehicle takes off, lands, is armed or disarmed."""
        following = self._ground.after(state)
        ended = bool(self._ground.armed) and following.armed is False
        changed = following.grounded is not self._ground.grounded
        events = self._advance(everything=True) if ended or changed else ()
        self._ground = following
        if not ended:
            return events
        self._refine()
        return (*events, FlightEnded(state.t))

    def _advance(self, *, everything: bool = False) -> tuple[Event, ...]:
        made: dict[int, list[Batch]] = self._assembly.take(
            self.parameters, everything=everything, grounded=self._ground.grounded
        )
        newest = -np.inf
        for imu, batches in made.items():
            if self._only and imu not in self._only:
                continue
            for batch in batches:
                self._engine_of(imu).add(batch)
                newest = max(newest, float(batch.fixes.t[-1]))
        self.flown_s += max(
            (sum(c.trusted_s for c in batches) for batches in made.values()), default=0.0
        )
        return (Advanced(float(newest)),) if np.isfinite(newest) else ()

    def _prior(self, imu: int) -> Array:
        six = self.parameters.six(imu)
        scale, offset = np.array(six.scale), np.array(six.offset)
        return np.concatenate([scale, -scale * offset])
