"""The flight after a push judges it: which pushes wait for their verdict, and what it was."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from onboard.core.estimate.result import Calibration
from onboard.daemon.view.numbers import finite
from onboard.daemon.view.snapshot import JudgedView
from onboard.push.entries import Planned, Watched
from onboard.push.policy import VehicleCondition
from onboard.push.signals import VehicleReport
from onboard.push.watch import PushWatch


class Witness:
    """Watches completed pushes, one per accelerometer."""

    def __init__(self) -> None:
        self._watches: dict[int, tuple[str, PushWatch]] = {}
        self._said: Counter[str] = Counter()
        self.judged: dict[int, JudgedView] = {}

    @property
    def waiting(self) -> frozenset[str]:
        """Pushes that wait for a flight, by transaction; another name for each further flight."""
        names = (transaction for transaction, _ in self._watches.values())
        return frozenset(
            f"{name}+{self._said[name]}" if self._said[name] else name for name in names
        )

    def watch(self, pushed: Planned, *, in_flight_since: float | None = None) -> None:
        """Wait for the flight that judges this push."""
        imu = pushed.plan.imu
        if imu not in self._watches or self._watches[imu][0] != pushed.transaction:
            watch = PushWatch(pushed, in_flight_since=in_flight_since)
            self._watches[imu] = (pushed.transaction, watch)

    def drop(self, imu: int) -> None:
        """The push is judged, or no longer in force."""
        self._watches.pop(imu, None)

    def report(self, condition: VehicleCondition, now: float) -> tuple[Watched, ...]:
        """Verdicts from the vehicle's state (a push in flight after which the EKF fell ill)."""
        report = VehicleReport.of(condition)
        found = ((imu, watch.vehicle(report, now)) for imu, (_, watch) in self._watches.items())
        return self._fallen([(imu, None, verdict) for imu, verdict in found if verdict])

    def landed(self, flown: Mapping[int, Calibration]) -> tuple[Watched, ...]:
        """Verdicts from the flight that has just ended."""
        found = []
        for imu, (_, watch) in self._watches.items():
            verdict = watch.judge(flown[imu]) if imu in flown else None
            if verdict is not None:
                found.append((imu, flown[imu], verdict))
        return self._fallen(found)

    def _fallen(
        self, found: Sequence[tuple[int, Calibration | None, Watched]]
    ) -> tuple[Watched, ...]:
        for imu, flown, verdict in found:
            baseline = self._watches[imu][1].plan.baseline
            self._said[verdict.transaction] += 1
            self.judged[imu] = JudgedView(
                imu=imu,
                verdict=verdict.verdict.value,
                sentence=verdict.sentence,
                held_out_before_push=baseline.held_out_before,
                held_out_after_push=None if flown is None else finite(flown.held_out_before),
                velocity_rms_before_push_m_s=baseline.velocity_rms_before,
                velocity_rms_after_push_m_s=(
                    None if flown is None else finite(flown.velocity_rms_before)
                ),
            )
            self.drop(imu)
        return tuple(verdict for _, _, verdict in found)
