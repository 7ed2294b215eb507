"""The service's life: startup, main loop, tick, shutdown, read from top to bottom.

The link hands each message to :meth:`Service.on_message`, on the loop; once a second what
came is handed to the learner, on the worker's thread; once a second :meth:`Service.on_tick`
judges, saves and tells.  The watchdog is fed in that tick, as long as the learner keeps up.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from onboard.daemon.learning.learned import Learned
from onboard.daemon.outlets.door import Door
from onboard.daemon.outlets.outlets import Outlets
from onboard.daemon.process import limits
from onboard.daemon.process.contact import Contact, Life
from onboard.daemon.process.failure_recording import FailureRecording
from onboard.daemon.process.interrupts import stop_signals
from onboard.daemon.process.notify import Notifier
from onboard.daemon.process.parts import Parts
from onboard.daemon.process.portrait import Portrait
from onboard.daemon.process.turns import turns_here
from onboard.daemon.setup import settings
from onboard.daemon.setup.configuration import Configuration
from onboard.daemon.view.snapshot import Snapshot
from onboard.errors import OnboardError
from onboard.mavlink.autopilot import AutopilotState
from onboard.mavlink.decode import Decoder, is_armed, is_autopilot
from onboard.mavlink.dialect import Message
from onboard.push.policy import Mode
from onboard.web.page import status_page

if TYPE_CHECKING:
    from onboard.daemon.outlets.control import Page

logger = logging.getLogger(__name__)


class Service:
    """One daemon for one vehicle.

    Args:
        configuration: what.
        pages: further handlers for the HTTP server.
        clock: monotonic time, s.
        wall_clock: Unix time, s.
    """

    def __init__(
        self,
        configuration: Configuration,
        *,
        pages: Iterable[Page] = (),
        clock: Callable[[], float] = time.monotonic,
        wall_clock: Callable[[], float] = time.time,
    ) -> None:
        self.configuration = configuration
        self.parts = Parts.of(configuration, clock=clock, wall_clock=wall_clock)
        self.link, self.handover = self.parts.link, self.parts.handover
        self.notices = self.parts.notices
        self.server: Door | None = None
        self.stopped_by: signal.Signals | None = None
        self.ready = asyncio.Event()
        self._life = Life()
        self.contact = Contact(self.parts, self._life)
        self._outlets = Outlets(
            configuration, self, self.notices, clock=clock, board=self._board_that_is_there
        )
        self._turns = turns_here()
        self._stalls_told, self._tell_stalls_at = 0, 0.0
        self._portrait = Portrait(
            self.parts, self._outlets, self._life, self._turns, self.parts.calendar
        )
        self._notifier = Notifier.from_environment()
        self._kept_aside = FailureRecording(
            self.link, configuration.state.path() / "after-failure", wall_clock
        )
        self.handover.failures.heard = self._kept_aside.begin
        self._pages = tuple(pages)
        self._clock = clock
        self._started = clock()
        self._stopping = asyncio.Event()
        self._learner_task: asyncio.Task[None] | None = None
        self.handover.listen(self._on_learned)

    @property
    def phase(self) -> str:
        """Where it is in its life."""
        return self._life.phase

    @property
    def counters(self) -> Counter[str]:
        """What the service itself has counted, by name."""
        return self._life.counters

    # Life

    async def run(self, *, handle_signals: bool = False) -> None:
        """Serve until :meth:`stop` or, with ``handle_signals``, SIGTERM, SIGINT or SIGHUP.

        Raises:
            LinkError: no heartbeat in the time limit.
            EndpointError: an endpoint cannot be opened.
            UnavailableError: an endpoint or the HTTP port is another program's.
            ConfigurationError: the HTTP port cannot be had at all.
        """
        try:
            with stop_signals(self._signalled) if handle_signals else contextlib.nullcontext():
                async with asyncio.TaskGroup() as group:
                    await self._startup(group)
                    await self._main_loop()
                    await self._shutdown()
        except BaseExceptionGroup as failures:
            ours = failures.subgroup(OnboardError)
            if ours is None:
                raise
            raise _first(ours) from None
        finally:
            await self._let_go()

    def stop(self) -> None:
        """Let :meth:`run` end in good order."""
        self._stopping.set()

    def _signalled(self, number: signal.Signals) -> None:
        self.stopped_by = number
        self.stop()

    async def _startup(self, group: asyncio.TaskGroup) -> None:
        self.link.subscribe_events(self.contact.on_link_event)
        self.link.subscribe(self.on_message, Decoder.names)
        for participant in self.parts.participants:
            self.link.attach(participant)
        self._outlets.join(self.link.attach)
        if self.configuration.http.enabled:
            self.server = self._make_server()
            self.server.listen()
            logger.info("status and control at %s", self.server.url)
        group.create_task(self.link.run(), name="link")
        self._learner_task = group.create_task(self._learn(), name="learner")
        self._outlets.start(group)
        self._life.phase = "searching"
        self.ready.set()
        self.contact.look_around(self._clock())
        self._notifier.send(READY="1", STATUS="waiting for an autopilot's heartbeat")

    async def _main_loop(self) -> None:
        due = self._clock() + limits.TICK_S
        while not self._stopping.is_set():
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(max(0.0, due - self._clock())):
                    await self._stopping.wait()
            await self.on_tick(self._clock())
            # A tick that came late is not made up for: the watchdog would be told lies.
            due = max(due + limits.TICK_S, self._clock())

    async def on_tick(self, now: float) -> None:
        """Judge, save, tell; the watchdog is fed last, when all that worked."""
        parts = self.parts
        condition = parts.observed.condition(now)
        parts.traffic.tick(now)
        self.contact.tell_of_recovery(now)
        self.contact.look_around(now)
        parts.pusher.judge(parts.witness.report(condition, now))
        self.handover.tell_of_lag(now)
        self._tell_of_stalls(now)
        learned, clock = self.handover.learned, self.link.boot_clock
        # What was learned must be of the board that is there, unless a push is under way, which
        # looks after itself.
        known = parts.parameters.complete and self.handover.identified and self.link.presence.proven
        if learned is not None and (known or parts.pusher.busy):
            parts.pusher.consider(
                now,
                learned=learned,
                parameters=parts.parameters.values,
                board=parts.board.uid,
                condition=condition,
                # Whether a reboot has lost what is gone, or somebody has set it, shows its clock.
                confirmed=parts.parameters.confirmed if clock.certain(now) else (),
            )
        shown = self._show()
        if self.handover.keeps_up(now):
            self._notifier.send(WATCHDOG="1", STATUS=shown)

    def _show(self) -> str:
        """Tell everybody outside; the line for the service manager.

        A mistake of ours in what is shown is no reason to leave a vehicle alone with a push.
        """
        try:
            if self.server is not None:
                self.server.publish()
            self._outlets.publish()
            return self._portrait.sentence(self._clock())
        except Exception:
            if not self._life.counters["not_shown"]:
                text = "the state cannot be shown; the log has the reason, the rest goes on"
                self.notices.post("not_shown", text, warning=True)
                logger.exception("the state cannot be shown")
            self._life.counters["not_shown"] += 1
            return "the state cannot be shown; see the log"

    def _tell_of_stalls(self, now: float) -> None:
        """In the log, now and then: nobody but a programmer can do anything about it."""
        stalls = self._turns.stalls
        if stalls > self._stalls_told and now >= self._tell_stalls_at:
            self._stalls_told, self._tell_stalls_at = stalls, now + limits.STALL_TOLD_S
            logger.warning(
                "the loop was away for more than %.0f ms %d times since the start, %.0f ms at most",
                limits.STALL_S * 1e3,
                stalls,
                self._turns.worst_s * 1e3,
            )

    def _on_learned(self, learned: Learned) -> None:
        if learned.flown:
            self.parts.pusher.judge(self.parts.witness.landed(learned.flown))
        if learned.flight is not None:
            self.parts.diagnoses.take(learned.flight.diagnosed)

    async def _shutdown(self) -> None:
        """Stage by stage, each bounded: people, the push, the link, the sums."""
        self._life.phase = "stopping"
        self._notifier.send(STOPPING="1", STATUS="stopping")
        self.parts.pusher.close()
        await self._finish_push()
        await self._give_rates_back()
        await self._outlets.close()
        if self.server is not None:
            await self.server.close()
        self.link.close()
        if self._learner_task is not None:
            self._learner_task.cancel()
        await self.handover.close(limits.SAVE_S)
        self.parts.keep_signing()

    async def _finish_push(self) -> None:
        try:
            async with asyncio.timeout(limits.FINISH_PUSH_S):
                await self.parts.pusher.idle.wait()
        except TimeoutError:
            if self.parts.journal.recover():  # else nothing of it was written
                logger.warning("a push is left open; it is finished or undone after the next start")

    async def _give_rates_back(self) -> None:
        """Samples made room for a push: nobody else would ask for them again."""
        streams, link = self.parts.streams, self.link
        streams.writing = lambda: False
        for _ in range(20):
            if not streams.owes or link.state is not AutopilotState.PRESENT:
                break
            await asyncio.sleep(limits.RATES_BACK_S / 20)
        for message in streams.parting():
            link.send(message)

    async def _let_go(self) -> None:
        """Whatever way it ended: no port, file or lock stays behind."""
        self._life.phase = "stopped"
        self.link.close()
        await self._kept_aside.close()
        if self.server is not None:
            await self.server.close()
        self.parts.journal.close()
        self.handover.let_go()

    async def _learn(self) -> None:
        await self.link.wait_autopilot(self.configuration.link.heartbeat_limit_s)
        await self.handover.run()

    # What comes in

    def on_message(self, now: float, message: Message) -> None:
        """Take one message of the link."""
        if self.handover.decoder.source != (message.get_srcSystem(), message.get_srcComponent()):
            return
        self.parts.traffic.count(message.get_type())
        self.parts.calendar.feed(message)
        said = now - self.link.boot_clock.lateness.seconds
        if is_autopilot(message):
            self.contact.heartbeat(now, said, armed=is_armed(message))
        observe = self.parts.observed.feed
        for sample in self.handover.take(message):
            observe(sample, said)

    def _board_that_is_there(self) -> str | None:
        """Its unique id, empty if it tells none; None while what was learned may be another's."""
        return self.parts.board.uid if self.handover.identified else None

    # What people ask for (onboard.daemon.outlets.control.Actions)

    async def approve(self, imus: tuple[int, ...], *, despite_diagnosis: bool = False) -> str:
        """Allow the proposed push."""
        return self.parts.proposals.approve(imus, despite_diagnosis=despite_diagnosis)

    async def reject(self, imus: tuple[int, ...]) -> str:
        """Refuse the proposed push; one that is under way is undone."""
        done = self.parts.proposals.reject(imus)
        if self.parts.pusher.abandon(imus, "a person rejected it", self._clock()):
            done += "; what was written of it is undone"
        return done

    async def rollback(self, imus: tuple[int, ...]) -> str:
        """Write back what was in force before the last push."""
        return self.parts.pusher.roll_back(imus, self._clock())

    async def reset(self, imus: tuple[int, ...]) -> str:
        """Forget what was learned, of all accelerometers: they share the window.

        Raises:
            StateError: it is forgotten, but not by the disk.
        """
        del imus
        self.parts.pusher.abandon((), "what was learned was reset", self._clock())
        try:
            await self.handover.reset()
        finally:
            self.parts.proposals.forget()
            self.parts.diagnoses.forget()
        self._life.counters["resets"] += 1
        return "what was learned is forgotten; the autopilot's parameters are as they were"

    def set_policy(self, mode: Mode) -> None:
        """Change the push policy until the next start."""
        proposals = self.parts.proposals
        proposals.settings = replace(proposals.settings, mode=mode)

    def snapshot(self) -> Snapshot:
        """Everything, now."""
        now = self._clock()
        return self._portrait.snapshot(now, uptime_s=now - self._started)

    # How

    def _make_server(self) -> Door:
        http = self.configuration.http
        token = settings.http_token(http)
        pages = (status_page, self._outlets.history.page, *self._pages)
        return Door(
            self,
            address=http.address,
            port=http.port,
            token=token,
            pages=pages,
            counters=self._life.counters,
        )


def _first(failures: BaseExceptionGroup[OnboardError]) -> OnboardError:
    """The error that a person is to read, of a group that may be nested."""
    error = failures.exceptions[0]
    return _first(error) if isinstance(error, BaseExceptionGroup) else error
