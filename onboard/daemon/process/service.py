"""The service's life: startup, main loop, tick, shutdown, read from top to bottom.

The link hands each message to :meth:`Service.on_message`, on the loop; four times a second what
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

from onboard.daemon.learning.diagnoses import Diagnoses
from onboard.daemon.learning.learner import Identity, Learned, Learner
from onboard.daemon.learning.learning import Learning
from onboard.daemon.learning.store import Store
from onboard.daemon.outlets.door import Door
from onboard.daemon.outlets.outlets import Outlets
from onboard.daemon.process.condition import Observed
from onboard.daemon.process.interrupts import stop_signals
from onboard.daemon.process.notify import Notifier
from onboard.daemon.process.portrait import Portrait
from onboard.daemon.pushing.parameters import ParameterWatch
from onboard.daemon.pushing.proposals import Proposals
from onboard.daemon.pushing.pusher import Pusher
from onboard.daemon.pushing.witness import Witness
from onboard.daemon.setup import settings
from onboard.daemon.setup.configuration import Configuration, read_secret
from onboard.daemon.view.notices import Notices
from onboard.daemon.view.snapshot import Snapshot
from onboard.daemon.view.traffic import Traffic
from onboard.errors import OnboardError
from onboard.mavlink.autopilot import (
    AutopilotFound,
    AutopilotRebooted,
    AutopilotReturned,
    AutopilotSilent,
    AutopilotState,
    ConnectionChanged,
    ConnectionRestored,
    ConnectionTrouble,
    LinkEvent,
)
from onboard.mavlink.board import Board
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import Message
from onboard.mavlink.link import Link
from onboard.mavlink.streams import Streams
from onboard.mavlink.timesync import TimeSync
from onboard.outage import Outage
from onboard.push.journal import Journal
from onboard.push.policy import Mode
from onboard.web.page import status_page

if TYPE_CHECKING:
    from onboard.daemon.outlets.control import Page

logger = logging.getLogger(__name__)

TICK_S = 1.0
SAVE_S = 5.0
FINISH_PUSH_S = 8.0
"""A transaction under way at shutdown gets so long; then it stays open, to be resumed."""


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
        self.phase = "starting"
        self.mode = "active"
        self.mode_reason = ""
        self.stopped_by: signal.Signals | None = None
        self.counters: Counter[str] = Counter()
        self._pages = tuple(pages)
        self._clock = clock
        self._wall_clock = wall_clock
        self._started = clock()
        self._notifier = Notifier.from_environment()
        self.ready = asyncio.Event()
        self._stopping = asyncio.Event()
        self._learner_task: asyncio.Task[None] | None = None
        self._observed = Observed()
        self._silence, self._reboots = Outage(), Outage()
        self.notices = Notices(wall_clock)
        link = configuration.link
        endpoints = settings.endpoints(link)
        signing = settings.signing(link, wall_clock)
        push = configuration.push
        directory = configuration.state.path()
        self._recorder = settings.recorder(configuration.recording, directory, wall_clock)
        self._witness = Witness()
        self.learning = Learning(
            Learner(
                Store(directory),
                settings.estimator_settings(configuration.estimator),
                clock=clock,
                wall_clock=wall_clock,
            ),
            self.notices,
            identity=self._identity,
            judging=lambda: self._witness.waiting,
            in_flight=lambda: self._proposals.settings.mode is Mode.IN_FLIGHT,
            ready=self._is_introduced,
            clock=clock,
            wall_clock=wall_clock,
            save_every_s=configuration.estimator.save_every_s,
        )
        self.learning.listen(self._on_learned)
        self._proposals = Proposals(
            settings.policy_settings(push), approval=push.approval, imus=push.imus
        )
        self._journal = Journal(directory / "journal.jsonl")
        self._pusher = Pusher(
            self._journal, self._proposals, self._witness, self.notices, wall_clock=wall_clock
        )
        self._diagnoses = Diagnoses(self._pusher.append, self.notices)
        self._parameters = ParameterWatch()
        self._board = Board()
        self._streams = Streams(settings.stream_requests(link.rates))
        self._timesync = TimeSync()
        self._outlets = Outlets(configuration, self, self.notices, clock=clock)
        self._traffic = Traffic()
        self.link = Link(
            endpoints,
            system=link.system_id or None,
            signing=signing,
            recorder=self._recorder,
            clock=clock,
            wall_clock=wall_clock,
        )
        self.server: Door | None = None
        self._portrait = Portrait(
            link=self.link,
            signed=signing is not None,
            streams=self._streams,
            timesync=self._timesync,
            observed=self._observed,
            traffic=self._traffic,
            learning=self.learning,
            parameters=self._parameters,
            proposals=self._proposals,
            pusher=self._pusher,
            journal=self._journal,
            diagnoses=self._diagnoses,
            outlets=self._outlets,
            notices=self.notices,
            recorder=self._recorder,
            wall_clock=wall_clock,
        )

    # Life

    async def run(self, *, handle_signals: bool = False) -> None:
        """Serve until :meth:`stop` or, with ``handle_signals``, SIGTERM or SIGINT.

        Raises:
            LinkError: no heartbeat in the time limit.
            EndpointError: an endpoint cannot be opened.
            ConfigurationError: the HTTP port is taken.
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
        self.link.subscribe_events(self.on_link_event)
        self.link.subscribe(self.on_message, Decoder.names)
        for participant in (
            self._streams,
            self._timesync,
            self._board,
            self._parameters,
            self._pusher,
        ):
            self.link.attach(participant)
        self._outlets.join(self.link.attach)
        if self.configuration.http.enabled:
            self.server = self._make_server()
            self.server.listen()
            logger.info("status and control at %s", self.server.url)
        group.create_task(self.link.run(), name="link")
        self._learner_task = group.create_task(self._learn(), name="learner")
        self._outlets.start(group)
        self.phase = "searching"
        self.ready.set()
        self._notifier.send(READY="1", STATUS="waiting for an autopilot's heartbeat")

    async def _main_loop(self) -> None:
        due = self._clock() + TICK_S
        while not self._stopping.is_set():
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(max(0.0, due - self._clock())):
                    await self._stopping.wait()
            await self.on_tick(self._clock())
            # A tick that came late is not made up for: the watchdog would be told lies.
            due = max(due + TICK_S, self._clock())

    async def on_tick(self, now: float) -> None:
        """Judge, save, tell; the watchdog is fed last, when all that worked."""
        condition = self._observed.condition(now)
        self._traffic.tick(now)
        self._tell_of_recovery(now)
        self._pusher.judge(self._witness.report(condition, now))
        self.learning.tell_of_lag(now)
        learned = self.learning.learned
        # What was learned must be of the board that is there, unless a push is under way, which
        # looks after itself.
        known = self._parameters.complete and self.learning.identified
        if learned is not None and (known or self._pusher.busy):
            self._pusher.consider(
                now,
                learned=learned,
                parameters=self._parameters.values,
                board=self._board.uid,
                condition=condition,
                confirmed=self._parameters.confirmed,
            )
        if self.server is not None:
            self.server.publish()
        self._outlets.publish()
        if self.learning.keeps_up(now):
            self._notifier.send(WATCHDOG="1", STATUS=self._portrait.sentence(self._clock()))

    def _on_learned(self, learned: Learned) -> None:
        if learned.flown:
            self._pusher.judge(self._witness.landed(learned.flown))
        if learned.flight is not None:
            self._diagnoses.take(learned.flight.diagnosed)

    async def _shutdown(self) -> None:
        """Stage by stage, each bounded: people, the push, the link, the sums."""
        self.phase = "stopping"
        self._notifier.send(STOPPING="1", STATUS="stopping")
        self._pusher.close()
        await self._finish_push()
        await self._outlets.close()
        if self.server is not None:
            await self.server.close()
        self.link.close()
        if self._learner_task is not None:
            self._learner_task.cancel()
        await self.learning.close(SAVE_S)

    async def _finish_push(self) -> None:
        try:
            async with asyncio.timeout(FINISH_PUSH_S):
                await self._pusher.idle.wait()
        except TimeoutError:
            logger.warning("a push is left open; it is finished or undone after the next start")

    async def _let_go(self) -> None:
        """Whatever way it ended: no port, file or lock stays behind."""
        self.phase = "stopped"
        self.link.close()
        if self.server is not None:
            await self.server.close()
        self._journal.close()
        self.learning.let_go()

    async def _learn(self) -> None:
        await self.link.wait_autopilot(self.configuration.link.heartbeat_limit_s)
        await self.learning.run()

    def _identity(self) -> Identity | None:
        """Who is there now, None while nobody is heard."""
        autopilot = self.link.autopilot
        if autopilot is None or self.link.state is not AutopilotState.PRESENT:
            return None
        return Identity(autopilot.system, autopilot.firmware_name, self._board.uid)

    def _is_introduced(self) -> bool:
        """Whether it has said which board it is and what its messages mean."""
        told = self._parameters.complete or not self._parameters.enabled
        return told and self._board.answered

    # What comes in

    def on_message(self, now: float, message: Message) -> None:
        """Take one message of the link."""
        if self.learning.decoder.source != (message.get_srcSystem(), message.get_srcComponent()):
            return
        self._traffic.count(message.get_type())
        for sample in self.learning.take(message):
            self._observed.feed(sample, now)

    def on_link_event(self, now: float, event: LinkEvent) -> None:
        """Take note of what happened to the autopilot or a connection."""
        post = self.notices.post
        match event:
            case AutopilotFound(autopilot):
                who = f"{autopilot.firmware_name} {autopilot.vehicle}, system {autopilot.system}"
                post("autopilot_found", who)
                self.learning.decoder = Decoder(
                    autopilot.system, autopilot.component, clock=self.link.boot_clock
                )
                self.phase = "running"
                if not autopilot.is_ardupilot:
                    self._advise_only(
                        f"the autopilot is {autopilot.firmware_name}, not ArduPilot: "
                        "nothing is written to it"
                    )
            case AutopilotSilent(silence):
                self.counters["autopilot_silent"] += 1
                self._observed.forget()
                self.learning.gap()
                if self._silence.lost("no heartbeat", now):
                    post("autopilot_silent", f"no heartbeat for {silence:.0f} s", warning=True)
            case AutopilotReturned():
                self.learning.gap()
                self._silence.works(now)
            case AutopilotRebooted():
                self.counters["autopilot_rebooted"] += 1
                self._observed.forget()
                self.learning.gap()
                if self._reboots.lost("rebooted", now):
                    post("autopilot_rebooted", "the autopilot rebooted", warning=True)
                self._reboots.works(now)
            case ConnectionTrouble(endpoint, reason):
                text = f"{endpoint}: {reason}; tried again until it answers"
                post("connection_lost", text, warning=True)
            case ConnectionRestored(endpoint, over):
                post("connection_back", f"{endpoint}: back after {over}")
            case ConnectionChanged(endpoint, state, reason):
                logger.debug("%s: %s%s", endpoint, state.value, f" ({reason})" if reason else "")
        self._pusher.on_event(now, event)

    def _tell_of_recovery(self, now: float) -> None:
        """Say that heartbeats are back, and how often it rebooted, once it has settled."""
        over = self._silence.over(now)
        if over is not None:
            self.notices.post("autopilot_returned", f"heartbeats are back after {over}")
        times = self._reboots.times
        if self._reboots.over(now) is not None and times > 1:
            text = f"the autopilot rebooted {times} times in a row; now it keeps running"
            self.notices.post("autopilot_runs", text)

    def _advise_only(self, reason: str) -> None:
        self.notices.post("advise_only", f"advise-only: {reason}", warning=True)
        self.mode, self.mode_reason = "advise_only", reason
        self._proposals.forbidden = reason
        self._parameters.enabled = False

    # What people ask for (onboard.daemon.outlets.control.Actions)

    async def approve(self, imus: tuple[int, ...], *, despite_diagnosis: bool = False) -> str:
        """Allow the proposed push."""
        return self._proposals.approve(imus, despite_diagnosis=despite_diagnosis)

    async def reject(self, imus: tuple[int, ...]) -> str:
        """Refuse the proposed push."""
        return self._proposals.reject(imus)

    async def rollback(self, imus: tuple[int, ...]) -> str:
        """Write back what was in force before the last push."""
        return self._pusher.roll_back(imus, self._clock())

    async def reset(self, imus: tuple[int, ...]) -> str:
        """Forget what was learned, of all accelerometers: they share the window."""
        del imus
        await self.learning.reset()
        self._proposals.forget()
        self._diagnoses.forget()
        self.counters["resets"] += 1
        return "what was learned is forgotten; the autopilot's parameters are as they were"

    def set_policy(self, mode: Mode) -> None:
        """Change the push policy until the next start."""
        self._proposals.settings = replace(self._proposals.settings, mode=mode)

    def snapshot(self) -> Snapshot:
        """Everything, now."""
        return self._portrait.snapshot(
            self._clock(),
            uptime_s=self._clock() - self._started,
            phase=self.phase,
            mode=self.mode,
            mode_reason=self.mode_reason,
            counters=self.counters,
        )

    # How

    def _make_server(self) -> Door:
        http = self.configuration.http
        token = http.token
        if http.token_file is not None:
            token = read_secret(http.token_file, key="[http] token_file")
        pages = (status_page, self._outlets.history.page, *self._pages)
        return Door(self, address=http.address, port=http.port, token=token, pages=pages)


def _first(failures: BaseExceptionGroup[OnboardError]) -> OnboardError:
    """The error that a person is to read, of a group that may be nested."""
    error = failures.exceptions[0]
    return _first(error) if isinstance(error, BaseExceptionGroup) else error
