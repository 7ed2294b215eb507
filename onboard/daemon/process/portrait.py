"""The service as others see it: the snapshot, its counters, one line for the service manager."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from onboard import __version__
from onboard.daemon.learning.diagnoses import Diagnoses
from onboard.daemon.learning.learning import Learning
from onboard.daemon.outlets.outlets import Outlets
from onboard.daemon.process.condition import Observed
from onboard.daemon.pushing.parameters import ParameterWatch
from onboard.daemon.pushing.proposals import Proposals
from onboard.daemon.pushing.pusher import Pusher
from onboard.daemon.view.notices import Notices
from onboard.daemon.view.snapshot import ImuView, PushView, Snapshot, StepView
from onboard.daemon.view.state import INFO, Circumstances, next_step
from onboard.daemon.view.traffic import Traffic
from onboard.daemon.view.view import NO_TRUST, finite_values, imu_view, journal_view, link_view
from onboard.mavlink.link import Link
from onboard.mavlink.recorder import Recorder
from onboard.mavlink.streams import Streams
from onboard.mavlink.timesync import TimeSync
from onboard.push.journal import Journal
from onboard.push.policy import VehicleCondition

JOURNAL_SHOWN = 50
BEHIND_WORTH_SAYING_S = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Portrait:
    """Looks at the service's parts and changes none; ``wall_clock`` is Unix time, s."""

    link: Link
    signed: bool
    streams: Streams
    timesync: TimeSync
    observed: Observed
    traffic: Traffic
    learning: Learning
    parameters: ParameterWatch
    proposals: Proposals
    pusher: Pusher
    journal: Journal
    diagnoses: Diagnoses
    outlets: Outlets
    notices: Notices
    recorder: Recorder | None
    wall_clock: Callable[[], float]

    def snapshot(
        self,
        now: float,
        *,
        uptime_s: float,
        phase: str,
        mode: str,
        mode_reason: str,
        counters: Mapping[str, int],
    ) -> Snapshot:
        """Everything, now; what is given is the service's own."""
        learned = self.learning.learned
        condition = self.observed.condition(now)
        push = self.pusher.view()
        imus = self._imus(push, condition)
        return Snapshot(
            version=__version__,
            time=self.wall_clock(),
            uptime_s=uptime_s,
            phase=phase,
            mode=mode,
            mode_reason=mode_reason,
            link=link_view(
                self.link,
                condition=condition,
                messages=self.traffic.view(self.streams.report()),
                signed=self.signed,
            ),
            trust=NO_TRUST if learned is None else learned.trust,
            imus=imus,
            push=push,
            parameters=finite_values(self.parameters.values),
            journal=journal_view(self.journal.entries[-JOURNAL_SHOWN:]),
            notices=self.notices.kept,
            counters=self._counters(counters),
            diagnosis=self.diagnoses.document,
            next_step=next_step(imus) if imus else self._first_step(),
        )

    def _imus(self, push: PushView, condition: VehicleCondition) -> tuple[ImuView, ...]:
        """What is known of each accelerometer."""
        learned = self.learning.learned
        proposals = {proposal.imu: proposal for proposal in push.proposals}
        values = self.parameters.values
        return tuple(
            imu_view(
                calibration,
                Circumstances(
                    proposal=proposals.get(imu),
                    writing=imu == push.active_imu,
                    written=imu in push.can_roll_back,
                    flying=condition.may_fly,
                ),
                values,
            )
            for imu, calibration in (learned.calibrations.items() if learned else ())
        )

    def _first_step(self) -> StepView | None:
        """What to do while no accelerometer has an answer; None: nothing is known of a vehicle."""
        if self.link.autopilot is None or self.learning.learned is None:
            return None
        return StepView(imu=None, text="fly: standing teaches nothing", severity=INFO)

    def sentence(self, now: float) -> str:
        """One line for systemctl status."""
        if self.link.autopilot is None:
            return "waiting for an autopilot's heartbeat"
        learned = self.learning.learned
        if learned is None:
            return f"{self.link.state.value}, nothing learned yet"
        views = self._imus(self.pusher.view(), self.observed.condition(now))
        imus = ", ".join(f"IMU {view.imu} {view.state.title}" for view in views)
        trust = "trusted" if learned.trust.open else "not trusted"
        lag = self.learning.behind(now)
        late = f", {lag:.0f} s behind" if lag > BEHIND_WORTH_SAYING_S else ""
        return f"{self.link.state.value}, GPS {trust}, {imus or 'no accelerometer yet'}{late}"

    def _counters(self, own: Mapping[str, int]) -> dict[str, int]:
        total = Counter(own)
        for part in (
            self.learning,
            self.parameters,
            self.proposals,
            self.pusher,
            self.outlets,
        ):
            total.update(part.counters)
        if self.learning.learned is not None:
            total.update(self.learning.learned.counters)
        refused = self.learning.decoder.refused
        total.update({f"refused {name}": count for name, count in refused.items()})
        total["timesync_rejected"] = self.timesync.rejected
        total["journal_damaged"] = self.journal.damaged
        if self.recorder is not None:
            total["recorded_frames"] = self.recorder.frames
            total["recording_dropped"] = self.recorder.dropped
        return dict(total)
