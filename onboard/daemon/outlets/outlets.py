"""Outlets: everybody outside who is told what the service does, other than by the snapshot.

The ground station's parameter view and messages, the broker, and the memory behind the charts.
The service hands each of its ticks' snapshots over here and knows nothing more of them.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from onboard.core.physics.catalogue import bearing_of
from onboard.core.physics.effect import Bearing
from onboard.daemon.outlets import limits
from onboard.daemon.outlets.announcer import Announcer
from onboard.daemon.outlets.parameter_view import (
    POLICIES,
    UNEXPLAINED,
    finding_number,
    parameter_values,
    top_effect,
)
from onboard.daemon.setup.configuration import Configuration
from onboard.daemon.view.history import History
from onboard.daemon.view.notices import Notices
from onboard.daemon.view.snapshot import Snapshot
from onboard.errors import OnboardError, RefusedError
from onboard.mavlink.autopilot import Participant
from onboard.mavlink.parameter_server import ParameterServer, Writable
from onboard.push.policy import Mode

if TYPE_CHECKING:
    from onboard.daemon.mqtt.publisher import Publisher


class Operated(Protocol):
    """What outlets need of the service."""

    def snapshot(self) -> Snapshot:
        """Everything, now."""

    async def approve(self, imus: tuple[int, ...], *, despite_diagnosis: bool = False) -> str:
        """Allow the proposed push."""

    async def reject(self, imus: tuple[int, ...]) -> str:
        """Refuse the proposed push."""

    async def rollback(self, imus: tuple[int, ...]) -> str:
        """Write back what was in force before the last push."""

    async def reset(self, imus: tuple[int, ...]) -> str:
        """Forget what was learned."""

    def set_policy(self, mode: Mode) -> None:
        """Change the push policy until the next start."""


class Outlets:
    """Feeds the outlets that the configuration asks for.

    Raises:
        ConfigurationError: a secret or certificate of the broker's that cannot be read.
    """

    def __init__(
        self,
        configuration: Configuration,
        service: Operated,
        notices: Notices,
        *,
        clock: Callable[[], float],
        board: Callable[[], str | None] = lambda: "",
    ) -> None:
        self._service = service
        self._notices = notices
        self._settings = configuration.parameters
        self._may_loosen = configuration.push.allow_loosening
        self._approval: asyncio.Task[None] | None = None
        self._approving = False
        self._clock = clock
        self._last_denied = ("", 0.0)
        self._finding: tuple[int, str] = (0, "")
        self._approval_needed = False
        self._states: dict[int, str] = {}
        self._halves: set[tuple[int, str]] = set()
        self._server: ParameterServer | None = None
        self._announcer: Announcer | None = None
        self._publisher: Publisher | None = None
        self.history = History(configuration.state.path(), clock=clock, board=board)
        if configuration.parameters.messages:
            self._announcer = Announcer(clock)
            notices.listen(self._announcer.hear)
        if configuration.mqtt.enabled:
            from onboard.daemon.mqtt.publisher import Publisher  # noqa: PLC0415 - not all want it

            self._publisher = Publisher(configuration.mqtt, service, notices, clock=clock)

    def join(self, attach: Callable[[Participant], None]) -> None:
        """Take part in the link, before it runs."""
        if self._settings.enabled:
            self._server = self._make_server()
            attach(self._server)
        if self._announcer is not None:
            attach(self._announcer)

    @property
    def counters(self) -> dict[str, int]:
        """What happened, by name."""
        total: Counter[str] = Counter()
        for part in (self._server, self._announcer, self._publisher):
            if part is not None:
                total.update(part.counters)
        return dict(total)

    def start(self, group: asyncio.TaskGroup) -> None:
        """Begin; what is in the journal already is no news."""
        if self._publisher is not None:
            self._publisher.publish(self._service.snapshot())
            group.create_task(self._publisher.run(), name="mqtt")

    def publish(self) -> None:
        """A tick has passed."""
        snapshot = self._service.snapshot()
        self.history.take(snapshot)
        self._tell_of_physics(snapshot)
        self._tell_of_approval(snapshot)
        self._tell_of_states(snapshot)
        self._tell_of_halves(snapshot)
        if self._server is not None:
            self._server.update(self._values(snapshot))
        if self._publisher is not None:
            self._publisher.publish(snapshot)

    async def close(self) -> None:
        """Say goodbye, within a few seconds."""
        self.history.save()
        if self._approval is not None:
            self._approval.cancel()
        if self._publisher is not None:
            await self._publisher.close(self._service.snapshot())

    # The parameter view

    def _make_server(self) -> ParameterServer:
        writable = {
            "OBC_PUSH": Writable(0.0, len(POLICIES) - 1.0, self._set_policy),
            "OBC_APPROVE": Writable(0.0, 1.0, self._approve),
        }
        return ParameterServer(
            self._values(self._service.snapshot()),
            writable=writable if self._settings.writable else {},
            denied=self._denied,
        )

    def _values(self, snapshot: Snapshot) -> dict[str, float]:
        return parameter_values(snapshot, imus=self._settings.imus, approving=self._approving)

    def _set_policy(self, value: float) -> None:
        name = POLICIES[int(value)]
        now = self._service.snapshot().push.policy
        if POLICIES.index(name) > POLICIES.index(now) and not self._may_loosen:
            raise RefusedError(f"{now} stays (allow_loosening)")
        if name == now:
            return
        self._service.set_policy(Mode(name))
        self._notices.post("parameter_done", f"push policy is now {name.replace('_', ' ')}")

    def _approve(self, value: float) -> None:
        if value == 0.0:
            return
        if self._approving:
            raise RefusedError("an approval is under way")
        if not any(p.approvable for p in self._service.snapshot().push.proposals):
            raise RefusedError("nothing waits for approval")
        # The station is first told that its 1 has arrived, then that it is done.
        self._approving = True
        self._approval = asyncio.create_task(self._carry_out(), name="approval by parameter")

    async def _carry_out(self) -> None:
        try:
            self._notices.post("approved", await self._service.approve(()))
        except OnboardError as error:
            self._notices.post("parameter_denied", str(error), warning=True)
        finally:
            self._approving = False

    def _denied(self, name: str, sentence: str) -> None:
        """Stations repeat a write that did not take: that is no news."""
        text, now = f"{name}: {sentence}", self._clock()
        last, at = self._last_denied
        self._last_denied = (text, now)
        if text != last or now - at > limits.REPEATED_S:
            self._notices.post("parameter_denied", text, warning=True)

    def _tell_of_approval(self, snapshot: Snapshot) -> None:
        """Say when a person is waited for, once each time."""
        needed = snapshot.push.approval_needed
        if needed and not self._approval_needed:
            self._notices.post("approval_needed", "a calibration waits for approval")
        self._approval_needed = needed

    def _tell_of_states(self, snapshot: Snapshot) -> None:
        """Say on the ground what has become of an accelerometer that will not be written."""
        if snapshot.link.armed is not False:
            return
        for imu in snapshot.imus:
            state = imu.state
            if self._states.get(imu.imu) == state.title:
                continue
            self._states[imu.imu] = state.title
            if state.name in {"held_back", "insufficient"}:
                self._notices.post("imu_state", f"IMU {imu.imu}: {state.title}", warning=True)

    def _tell_of_halves(self, snapshot: Snapshot) -> None:
        """Say of each half set what to do about it, and again when that changes: it has armed."""
        halves = {(one.imu, one.next): one for one in snapshot.push.unfinished if one.half}
        for key in halves.keys() - self._halves:
            one = halves[key]
            text = f"IMU {one.imu}: {one.sentence}; {one.next}"
            kind = "half_written" if snapshot.link.armed else "half_written_standing"
            self._notices.post(kind, text, warning=True)
        if halves or snapshot.push.state == "idle":  # else it is being seen to, maybe in vain
            self._halves = set(halves)

    # Diagnosis

    def _tell_of_physics(self, snapshot: Snapshot) -> None:
        """Say once that physics is missing, and which; what the model has is no alarm."""
        number = finding_number(snapshot.diagnosis)
        effect = top_effect(snapshot.diagnosis)
        name = "" if effect is None else str(effect.get("name"))
        if (number, name) == self._finding:
            return
        self._finding = (number, name)
        what = name.replace("_", " ")
        if bearing_of(name) is Bearing.HARMLESS:
            self._notices.post("worth_knowing", f"worth knowing: {what}")
        elif name:
            self._notices.post("physics_missing", f"physics missing: {what}", warning=True)
        elif number == UNEXPLAINED:
            self._notices.post("physics_missing", "physics missing: no known effect", warning=True)
