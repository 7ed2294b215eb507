"""The service as others see it: the snapshot, its counters, one line for the service manager."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from onboard import __version__
from onboard.daemon.outlets.outlets import Outlets
from onboard.daemon.process import limits
from onboard.daemon.process.contact import Life
from onboard.daemon.process.parts import Parts
from onboard.daemon.process.turns import Turns
from onboard.daemon.view.accelerometers import imu_view
from onboard.daemon.view.journal_lines import journal_view
from onboard.daemon.view.link_health import link_view
from onboard.daemon.view.numbers import finite_values
from onboard.daemon.view.snapshot import ImuView, PushView, Snapshot, StepView, UnfinishedView
from onboard.daemon.view.state import ERROR, INFO, WARNING, Circumstances, next_step
from onboard.daemon.view.trust import NO_TRUST
from onboard.mavlink.autopilot import AutopilotState
from onboard.push.policy import VehicleCondition


@dataclass(frozen=True, slots=True)
class Portrait:
    """Looks at the service's parts and changes none; ``wall_clock`` is Unix time, s."""

    parts: Parts
    outlets: Outlets
    life: Life
    turns: Turns
    wall_clock: Callable[[], float]

    def snapshot(self, now: float, *, uptime_s: float) -> Snapshot:
        """Everything, now."""
        learned = self.parts.handover.learned
        condition = self.parts.observed.condition(now)
        push = self._push(condition)
        imus = self._imus(push, condition)
        return Snapshot(
            version=__version__,
            time=self.wall_clock(),
            uptime_s=uptime_s,
            phase=self.life.phase,
            mode=self.life.mode,
            mode_reason=self.life.mode_reason,
            link=link_view(
                self.parts.link,
                condition=condition,
                messages=self.parts.traffic.view(self.parts.streams.report()),
                signed=self.parts.signing is not None,
                warnings=(
                    *(f"IMU {half.imu}: {half.sentence}" for half in _halves(push)),
                    *self.parts.vigilance.warnings(now),
                ),
            ),
            trust=NO_TRUST if learned is None else learned.trust,
            imus=imus,
            push=push,
            parameters=finite_values(self.parts.parameters.values),
            journal=journal_view(
                self.parts.journal.entries[-limits.JOURNAL_SHOWN :], self.parts.journal.appended
            ),
            notices=self.parts.notices.kept,
            counters=self._counters(),
            diagnosis=self.parts.diagnoses.document,
            next_step=self._next_step(now, imus, push),
        )

    def _push(self, condition: VehicleCondition) -> PushView:
        known = self.parts.parameters
        there = {name: known.values[name] for name in known.confirmed}
        return self.parts.pusher.view(there, known.heard, condition)

    def _imus(self, push: PushView, condition: VehicleCondition) -> tuple[ImuView, ...]:
        """What is known of each accelerometer."""
        learned = self.parts.handover.learned
        proposals = {proposal.imu: proposal for proposal in push.proposals}
        values = self.parts.parameters.values
        known = self.parts.proposals
        halves = {half.imu: half for half in _halves(push)}
        impossible = {} if known.forbidden else known.impossible
        return tuple(
            imu_view(
                calibration,
                Circumstances(
                    proposal=proposals.get(imu),
                    writing=imu == push.active_imu,
                    written=imu in push.can_roll_back,
                    flying=condition.may_fly,
                    impossible=impossible.get(imu, ""),
                    half=halves.get(imu),
                ),
                values,
            )
            for imu, calibration in (learned.calibrations.items() if learned else ())
        )

    def _next_step(self, now: float, imus: Sequence[ImuView], push: PushView) -> StepView | None:
        if halves := _halves(push):
            severity = ERROR if halves[0].half else WARNING
            return StepView(imu=halves[0].imu, text=halves[0].next, severity=severity)
        if self.parts.vigilance.stopped:
            return StepView(imu=None, text=self.parts.vigilance.stopped, severity=ERROR)
        return next_step(imus) if imus else self._first_step(now)

    def _first_step(self, now: float) -> StepView | None:
        """What to do while no accelerometer has an answer; None: nothing is known of a vehicle."""
        if hindered := self.parts.vigilance.hindered(now):
            return StepView(imu=None, text=hindered, severity=WARNING)
        if self.parts.link.autopilot is None or self.parts.handover.learned is None:
            return None
        if self.parts.link.state is AutopilotState.SILENT:
            text = "the autopilot is silent: see to its power and to the line"
            return StepView(imu=None, text=text, severity=WARNING)
        return StepView(imu=None, text="fly: standing teaches nothing", severity=INFO)

    def sentence(self, now: float) -> str:
        """One line for systemctl status."""
        push = self._push(self.parts.observed.condition(now))
        halves = [
            f"IMU {one.imu}: {'half a set is in force' if one.half else 'write interrupted'}: "
            f"{one.next}"
            for one in _halves(push)
        ]
        texts = (*halves, self.parts.vigilance.disk, self._doing(now, push))
        return "; ".join(text for text in texts if text)

    def _doing(self, now: float, push: PushView) -> str:
        """What it does, in a few words."""
        if self.parts.link.autopilot is None:
            return "waiting for an autopilot's heartbeat"
        if self.parts.vigilance.stopped:
            return self.parts.vigilance.stopped
        learned = self.parts.handover.learned
        if learned is None:
            return f"{self.parts.link.state.value}, nothing learned yet"
        views = self._imus(push, self.parts.observed.condition(now))
        imus = ", ".join(f"IMU {view.imu} {view.state.title}" for view in views)
        trust = "trusted" if learned.trust.open else "not trusted"
        lag = self.parts.handover.behind(now)
        late = f", {lag:.0f} s behind" if lag > limits.BEHIND_WORTH_SAYING_S else ""
        return f"{self.parts.link.state.value}, GPS {trust}, {imus or 'no accelerometer yet'}{late}"

    def _counters(self) -> dict[str, int]:
        total = Counter(self.life.counters)
        for part in (
            self.parts.handover,
            self.parts.parameters,
            self.parts.proposals,
            self.parts.pusher,
            self.outlets,
        ):
            total.update(part.counters)
        if self.parts.handover.learned is not None:
            total.update(self.parts.handover.learned.counters)
        refused = self.parts.handover.decoder.refused
        total.update({f"refused {name}": count for name, count in refused.items()})
        total["loop_stalls"] = self.turns.stalls
        total["loop_stall_worst_ms"] = round(self.turns.worst_s * 1e3)
        total["journal_damaged"] = self.parts.journal.damaged
        if self.parts.recorder is not None:
            total["recorded_frames"] = self.parts.recorder.frames
            total["recording_dropped"] = self.parts.recorder.dropped
        return dict(total)


def _halves(push: PushView) -> tuple[UnfinishedView, ...]:
    """Writes of which half is in force, or may be."""
    return tuple(one for one in push.unfinished if one.half is not False)
