"""The flight after a push: a second, fresh estimator that judges what was written.

It learns only while the vehicle is armed and only while a push waits for its verdict; standing
on the ground after a push is no flight.  The verdict falls on landing (or, for a push
made in flight, as soon as there is enough).
"""

from __future__ import annotations

from collections.abc import Iterable

from onboard.core.calibrator import Calibrator
from onboard.core.result import Calibration
from onboard.core.samples import ParameterValue, Sample
from onboard.core.settings import EstimatorSettings
from onboard.daemon.snapshot import JudgedView
from onboard.daemon.view import finite
from onboard.push.entries import Planned, Watched
from onboard.push.policy import VehicleCondition, ekf_healthy
from onboard.push.signals import VehicleReport
from onboard.push.watch import PushWatch


class Witness:
    """Watches completed pushes, one per accelerometer."""

    def __init__(self, settings: EstimatorSettings) -> None:
        self._settings = settings
        self._watches: dict[int, PushWatch] = {}
        self._watched: dict[int, str] = {}
        self._calibrator: Calibrator | None = None
        self._armed = False
        self._in_flight: set[int] = set()
        self._flown: dict[int, Calibration] = {}
        self.judged: dict[int, JudgedView] = {}

    def watch(self, pushed: Planned, *, in_flight_since: float | None = None) -> None:
        """Wait for the flight that judges this push."""
        imu = pushed.plan.imu
        if self._watched.get(imu) == pushed.transaction:
            return
        self._watched[imu] = pushed.transaction
        self._watches[imu] = PushWatch(pushed, in_flight_since=in_flight_since)
        self._calibrator = None
        self._in_flight.discard(imu)
        if in_flight_since is not None:
            self._in_flight.add(imu)

    def drop(self, imu: int) -> None:
        """The push is no longer in force: there is nothing to judge."""
        self._watches.pop(imu, None)
        self._watched.pop(imu, None)
        if not self._watches:
            self._calibrator = None

    def feed(self, sample: Sample) -> None:
        """Learn from one sample, if a push is being watched and the vehicle is armed."""
        if self._calibrator is not None and (self._armed or type(sample) is ParameterValue):
            self._calibrator.feed(sample)

    def tick(
        self,
        now: float,
        condition: VehicleCondition,
        parameters: Iterable[ParameterValue],
    ) -> tuple[Watched, ...]:
        """Follow the vehicle's state; verdicts that have fallen."""
        if not self._watches:
            return ()
        landed = self._armed and condition.armed is False
        if condition.armed is not None:
            self._armed = condition.armed
        if self._armed and self._calibrator is None:
            self._calibrator = Calibrator(self._settings)
            for parameter in parameters:
                self._calibrator.feed(parameter)
        found: list[Watched] = []
        report = VehicleReport(
            condition.armed,
            None if condition.ekf_flags is None else ekf_healthy(condition.ekf_flags),
        )
        for imu, watch in list(self._watches.items()):
            verdict = watch.vehicle(report, now)
            if verdict is None and (landed or imu in self._in_flight):
                verdict = self._judge(imu, watch)
            if verdict is not None:
                found.append(verdict)
                self.judged[imu] = self._account(imu, watch, verdict)
                self.drop(imu)
        return tuple(found)

    def _judge(self, imu: int, watch: PushWatch) -> Watched | None:
        if self._calibrator is None or imu not in self._calibrator.imus:
            return None
        flown = self._flown[imu] = self._calibrator.calibration(imu)
        return watch.judge(flown)

    def _account(self, imu: int, watch: PushWatch, verdict: Watched) -> JudgedView:
        baseline = watch.plan.baseline
        flown = self._flown.pop(imu, None)
        return JudgedView(
            imu=imu,
            verdict=verdict.verdict.value,
            sentence=verdict.sentence,
            held_out_before_push=baseline.held_out_before,
            held_out_after_push=None if flown is None else finite(flown.held_out_before),
            velocity_rms_before_push_m_s=baseline.velocity_rms_before,
            velocity_rms_after_push_m_s=None
            if flown is None
            else finite(flown.velocity_rms_before),
        )
