"""The door of the core: samples in, calibrations out.

Live stream and recording go the same way: decoder, :meth:`Calibrator.feed`, batches of about ten
seconds, one :class:`~onboard.core.estimate.engine.Engine` per accelerometer.  Nothing here depends
on when a sample is handed in, only on the order of samples and on their own times, so the result of
a stream and of its recording are the same numbers.
"""

from __future__ import annotations

import copy
import math
from collections import Counter
from collections.abc import Collection, Iterator
from typing import Final

from onboard.core.estimate.calibration_record import calibration_of
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.engines import Engines
from onboard.core.estimate.events import Advanced, Event, FlightEnded, Restarted
from onboard.core.estimate.limits import AHEAD_OF_IMU_S
from onboard.core.estimate.result import Calibration
from onboard.core.estimate.saving import SavedEngine, dump
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.estimate.stream_clock import StreamClock
from onboard.core.gps.distrust import Distrust, WindowClosed, WindowEvent
from onboard.core.gps.trust import TrustWindow
from onboard.core.inputs.airborne import Ground
from onboard.core.inputs.assembly import Assembly
from onboard.core.inputs.blocks import Block
from onboard.core.inputs.boot_time import began_anew, far_ahead
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.range_checks import impossible, measured
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

OF_ACCELEROMETER: Final = {name: imu for imu in range(1, 6) for name in parameter_names(imu).six}


class Calibrator:
    """Estimates the calibration parameters of every accelerometer from a stream of samples."""

    def __init__(
        self,
        settings: CalibratorSettings | None = None,
        only: Collection[int] = (),
        flight: str = "",
    ) -> None:
        """Take the settings.

        Args:
            settings: how it works.
            only: accelerometers to estimate, none named: all; nothing about one of them depends
                on whether others are estimated, too.
            flight: the name of what is learned, so that sums are never added twice.
        """
        self.settings = settings = settings or CalibratorSettings()
        self.parameters = ParametersInForce()
        self._assembly = Assembly(settings.assembly)
        self._trust = TrustWindow(settings.trust, felt=self._assembly.streams.felt)
        self._engines = Engines(settings, self.parameters, only, flight)
        self.earlier = self._engines.earlier
        self._counts: Counter[str] = Counter()
        self._clock = StreamClock()
        self._ground = Ground()
        self._finished = False
        self.flown_s = 0.0
        """Trusted flight that was taken in, s; it only grows."""
        self.kind = ""
        """Of vehicle, as it says itself: what to fly depends on it."""
        self.ekf_bias: dict[int, EkfBias] = {}

    @property
    def first_sample(self) -> float:
        """Time of the first inertial sample, s."""
        return self._clock.first

    @property
    def standing_s(self) -> float:
        """Time on the ground, which teaches nothing, s."""
        return self._assembly.standing_s

    def stuck(self, imu: int) -> tuple[tuple[float, float], ...]:
        """From and to when an accelerometer repeated one reading in flight, s."""
        return tuple(self._assembly.stuck.get(imu, ()))

    @property
    def trust(self) -> TrustWindow:
        """The trust window."""
        return self._trust

    @property
    def imus(self) -> tuple[int, ...]:
        """Accelerometers that are estimated, in order."""
        return tuple(self._engines)

    @property
    def flown(self) -> dict[int, list[Batch]]:
        """Flight that is kept of every accelerometer, of those that are not estimated, too."""
        return {imu: self._engines[imu].batches for imu in self._engines} | self._engines.beside

    def engine(self, imu: int) -> Engine:
        """The engine of one accelerometer (for diagnosis and benchmarks).

        Raises:
            KeyError: that accelerometer has not been seen.
        """
        return self._engines[imu]

    def feed(self, sample: Sample) -> tuple[Event, ...]:
        """Take one sample, in order of arrival.  Never raises on data: it counts."""
        sample = measured(sample)
        refusal = impossible(sample) or self._clock.refuses(sample)
        if refusal is not None:
            if not isinstance(sample, ParameterValue):  # unset ones are NaN: nothing is lost
                self._counts[refusal] += 1
            return ()
        match sample:
            case ImuSample():
                return self._imu(sample)
            case AttitudeSample():
                self._assembly.streams.attitude(sample)
            case ParameterValue():
                self._parameter(sample)
            case GpsFix():
                return self._fix(sample)
            case Vibration() | Throttle() | AirData():
                self._assembly.streams.signal(sample)
            case EkfBias():
                self.ekf_bias[sample.core] = sample
            case VehicleState():
                events = self._judged(sample)
                self.kind = sample.kind or self.kind
                return events + self._vehicle(sample)
            case _:
                return self._judged(sample)
        return ()

    def feed_block(self, block: Block) -> tuple[Event, ...] | None:
        """Take many samples at once, with what comes of it when they are fed one by one.

        None, and nothing is taken, where they have to be (:meth:`admits`).
        """
        if not self.admits(block):
            return None
        return tuple(event for _, _, events in self.go_through(block) for event in events)

    def admits(self, block: Block) -> bool:
        """Whether no sample of a block would be refused, nor begin another boot."""
        newest = self._clock.newest
        return (
            newest > -math.inf
            and block.is_plain
            and not began_anew(block.first_imu, newest)
            and not far_ahead(block.leads, newest)
            and block.attitude_ahead(newest) <= AHEAD_OF_IMU_S
            and self._assembly.streams.continued_by(block)
            and not (block.coarse and self._may_forget(block))
        )

    def _may_forget(self, block: Block) -> bool:
        """Whether an accelerometer may be begun anew; that HIGHRES_IMU came goes with it."""
        told = block.parameters & {*OF_ACCELEROMETER, "AHRS_ORIENTATION"}
        return bool(told) or len(block.receivers | ({self._trust.receiver} - {None})) > 1

    def go_through(self, block: Block) -> Iterator[tuple[Sample | None, float, tuple[Event, ...]]]:
        """Take a block that is admitted, to the end.

        Yields:
            each sample that is neither inertial nor an attitude (None: the end of the block), the
            latest time of the inertial ones since the one before it (-inf: there is none), and what
            came of them and of it.
        """
        streams, feed, heard = self._assembly.streams, self.feed, block.heard()
        streams.begin(block, self.parameters)
        for sample, place, t in zip(block.others, block.places, heard, strict=False):
            events = self._passed(t) if t > -math.inf else ()
            streams.reach(place)
            yield sample, t, events + feed(sample)
        streams.end()
        t = heard[-1]
        yield None, t, self._passed(t) if t > -math.inf else ()

    def _passed(self, t: float) -> tuple[Event, ...]:
        """Inertial samples have come, the latest of them with this time, s."""
        self._clock.hear(t)
        # A receiver that fell silent says nothing more: only the passing of time shows it.
        return self._counted(self._trust.pass_time(t))

    def restart(self, reason: str = "another recording") -> tuple[Event, ...]:
        """The clock begins anew: forget the inertial states, keep the sums."""
        events = self._advance(everything=True)
        ended = self._clock.restart()
        self._ground.forget()
        self._assembly.clear()
        self.parameters.boot()
        return (*events, *self._trust.restart(ended), Restarted(ended, reason))

    def begin_anew(self, imu: int) -> None:
        """Forget what was learned of one accelerometer: it is known to be wrong."""
        self._assembly.forget(imu)
        self._engines.earlier.forget(imu)
        if self._engines.forget(imu):
            self._counts["begun_anew"] += 1

    def finish(self) -> tuple[Event, ...]:
        """End of the recording or of the window: process what is pending, refine."""
        events = self._advance(everything=True)
        self._counts += self._engines.refine()
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

    def calibration_with(
        self, imu: int, engine: Engine, left_open: Array | None = None
    ) -> Calibration:
        """The same by another engine over the same flight (a diagnosis with more physics).

        Args:
            imu: which accelerometer.
            engine: has its sums.
            left_open: (6, 6) variance of scale and beta that the model itself leaves open.
        """
        rejected = Counter(self._trust.rejected)
        rejected.update(self._assembly.streams.refused(imu))
        rejected.update(self._counts)
        return calibration_of(
            imu,
            engine,
            self.parameters,
            finished=self._finished,
            kind=self.kind,
            rejected={k: n for k, n in rejected.items() if n},
            left_open=left_open,
        )

    @property
    def sums(self) -> list[SavedEngine]:
        """Sums of every accelerometer, and those that wait."""
        return self._engines.sums

    def to_bytes(self) -> bytes:
        """:attr:`sums`, to go on with after a restart."""
        return dump(self.sums)

    @classmethod
    def from_bytes(cls, data: bytes, settings: CalibratorSettings | None = None) -> Calibrator:
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
        self._engines.earlier.lay_aside(data)

    def begin_flight(self, flight: str) -> None:
        """Learn another flight from nothing: whether it agrees with the one before is asked."""
        self._engines.begin_flight(flight)
        self._trust.begin_flight()

    @property
    def waiting(self) -> tuple[int, ...]:
        """Accelerometers of which something learned before waits for a flight that agrees."""
        return tuple(self._engines.earlier)

    def _parameter(self, parameter: ParameterValue) -> None:
        """Take a report; what was taken for raw before the calibration was known, was not raw."""
        self._assembly.streams.settle()
        another = self._engines.replaced_by(parameter)
        if another is not None:
            self._assembly.forget(another)
            self._counts["another_sensor"] += 1
        imu = OF_ACCELEROMETER.get(parameter.name)
        unknown = imu is not None and not self.parameters.known(imu)
        self.parameters.set(parameter.name, parameter.value, self._clock.newest)
        if "POS" in parameter.name:  # GPS1_POS_X, GPS_POS1_X, INS_POS1_X
            self._engines.tell_antenna()
        if imu is None or not unknown or not self.parameters.known(imu):
            return
        if self.parameters.six(imu) != SixParameters():
            self._assembly.forget(imu)
            if self._engines.forget(imu):
                self._counts["begun_anew_with_parameters"] += 1

    def _imu(self, sample: ImuSample) -> tuple[Event, ...]:
        """Inertial samples carry the time of everything else."""
        events: tuple[Event, ...] = ()
        if self._clock.went_back(sample.t):
            self._counts["reboots"] += 1
            events = self.restart("reboot")
        self._assembly.streams.imu(sample, self.parameters)
        return events + self._passed(sample.t)

    def _judged(self, sample: Sample) -> tuple[Event, ...]:
        """What the trust window says; outages are counted: there is no fix to be refused."""
        return self._counted(self._trust.feed(sample))

    def _counted(self, events: tuple[WindowEvent, ...]) -> tuple[WindowEvent, ...]:
        for event in events:
            if isinstance(event, WindowClosed) and event.reason is Distrust.GPS_GAP:
                self._counts[event.reason.value] += 1
        return events

    def _fix(self, fix: GpsFix) -> tuple[Event, ...]:
        if self._clock.is_other(fix.t):
            # A reboot shows in the inertial samples first.
            self._counts["gps_other_clock"] += 1
            return self._judged(fix) if fix.t < self._clock.newest else ()
        if self._clock.is_ahead(fix.t):
            self._counts["gps_ahead"] += 1
            return ()
        before = self._trust.receiver
        events = self._judged(fix)
        if self._trust.receiver not in (None, fix.receiver):
            return events
        self.parameters.receiver = fix.receiver
        if before not in (None, fix.receiver):
            # What was saved holds the latency and the antenna of a receiver that is given up.
            self._counts["another_receiver"] += 1
            for imu in self._engines.known:
                self.begin_anew(imu)
        if self._trust.repeats:
            self._counts["gps_held"] += 1
            return events
        if self._assembly.streams.fixes.add(fix, trusted=self._trust.is_open):
            self._finished = False
            return (*events, *self._advance())
        return events

    def _vehicle(self, state: VehicleState) -> tuple[Event, ...]:
        """Cut what comes where the vehicle takes off, lands, is armed or disarmed."""
        following = self._ground.after(state)
        ended = bool(self._ground.armed) and following.armed is False
        changed = following.grounded is not self._ground.grounded
        touched = state.t - state.late_s if following.grounded else math.inf
        events = self._advance(everything=True, touched=touched) if ended or changed else ()
        self._ground = following
        if self.parameters.waiting:  # and not for what was measured until now
            self._assembly.streams.settle()
        self.parameters.hear(armed=following.armed)
        if not ended:
            return events
        self._counts += self._engines.refine()
        return (*events, FlightEnded(state.t))

    def _advance(self, *, everything: bool = False, touched: float = math.inf) -> tuple[Event, ...]:
        made: dict[int, list[Batch]] = self._assembly.take(
            self.parameters, everything=everything, grounded=self._ground.grounded, touched=touched
        )
        newest = self._engines.add(made)
        self.flown_s += max(
            (sum(c.trusted_s for c in batches) for batches in made.values()), default=0.0
        )
        return () if newest is None else (Advanced(newest),)
