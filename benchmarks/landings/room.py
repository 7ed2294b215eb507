"""The daemon and a simulated autopilot on one virtual clock, with a line of bytes between them.

It is the whole service (:class:`onboard.daemon.process.service.Service`) on an event loop whose
clock jumps to the next timer; only three things are not what they are on a companion computer: its
line is in memory, its clock is the loop's, and its worker computes in the loop and then lets as
much time pass as a slow companion would take.  So a run is as fast as the machine allows, and the
same one every time.
"""

from __future__ import annotations

import asyncio
import contextlib
import random
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol
from unittest import mock

from pymavlink.dialects.v20 import ardupilotmega as mav

from onboard.daemon.learning import handover
from onboard.daemon.process.service import Service
from onboard.daemon.setup.configuration import from_mapping
from onboard.mavlink import connection
from onboard.mavlink.peers import Address
from onboard.mavlink.transport import First, Receive, Transport
from sitl.builtin.autopilot import Autopilot
from sitl.builtin.messages import packed

STEP = 0.02
"""Of the vehicle, s: what it sends is handed over so often."""
EPOCH = 1_800_000_000.0
"""Unix time at which the clock begins."""
LOOK_S = 0.1
"""How much time each look at the clock takes while the worker computes: a solution then seems to
last as long as on a small companion, which solves every 20 s for that."""
DIAGNOSIS_S = (2.0, 40.0)
"""A diagnosis takes between so many seconds, from a desktop computer to a slow companion."""


class Observer(Protocol):
    """Whoever watches the vehicle."""

    def look(self) -> None:
        """Called before every step."""

    def parameter_set(self, name: str, value: float) -> None:
        """Called when the daemon writes a parameter, before the autopilot takes it."""


class Line:
    """The daemon's end of the line (:class:`onboard.mavlink.transport.Transport`)."""

    def __init__(self, receive: Receive, send: Callable[[bytes], None]) -> None:
        self.dropped = self.refused = 0
        self.receive: Receive | None = receive
        self._send = send

    def write(self, data: bytes, _to: Sequence[Address] = ()) -> None:
        """To the vehicle."""
        if self.receive is not None:
            self._send(data)

    def pace(self, _linger: float) -> None:
        """Nothing waits on this line."""

    def read(self) -> None:
        """Nothing waits on this line."""

    def close(self) -> None:
        """Nothing is received after this."""
        self.receive = None


class Worker:
    """Instead of a thread: computes at once, and lets the time pass that it would take."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._turn = asyncio.Lock()
        self._free_at = 0.0

    async def call(self, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401 - any call
        """Run it after all that was asked before, also after what nobody waits for any more."""
        loop = asyncio.get_running_loop()
        async with self._turn:
            await asyncio.sleep(max(0.0, self._free_at - loop.time()))
            result, took = self._room.compute(lambda: function(*args, **kwargs))
            if function.__name__ == "examine":
                took += self._room.pace.uniform(*DIAGNOSIS_S)
            self._free_at = loop.time() + took
            await asyncio.sleep(took)
            return result

    def dismiss(self) -> None:
        """There is no thread to end."""

    async def close(self) -> None:
        """There is no thread to end."""


class Room:
    """Where the soak takes place; made on a :class:`sitl.virtual_time.VirtualTimeLoop`.

    Args:
        autopilot: the vehicle.
        directory: the daemon's state.
        seed: of how long computing takes.
    """

    def __init__(self, autopilot: Autopilot, directory: Path, *, seed: int) -> None:
        self.autopilot = autopilot
        self.observer: Observer | None = None
        self.pace = random.Random(f"pace {seed}")  # noqa: S311 - chance, no secret
        self.service: Service | None = None
        self._directory = directory
        self._link = autopilot.connect()
        self._packer = mav.MAVLink(None, srcSystem=1, srcComponent=1)
        self._parser = mav.MAVLink(None)
        self._inbox: list[bytes] = []
        self._line: Line | None = None
        self._computing = False
        self._looks = 0.0
        self._task: asyncio.Task[None] | None = None
        self._loop = asyncio.get_running_loop()

    # Time

    def clock(self) -> float:
        """Monotonic time, s; it moves under the eyes of who computes."""
        if self._computing:
            self._looks += LOOK_S
        return self._loop.time() + self._looks

    def unix(self) -> float:
        """Unix time, s."""
        return EPOCH + self._loop.time()

    def compute(self, function: Callable[[], Any]) -> tuple[Any, float]:
        """Its result, and how long it seemed to take (s)."""
        self._computing = True
        try:
            return function(), self._looks
        finally:
            self._computing, self._looks = False, 0.0

    # The vehicle

    async def fly(self) -> None:
        """Run the vehicle until cancelled."""
        while True:
            await asyncio.sleep(STEP)
            self._listen()
            self.autopilot.advance(self._loop.time() - self.autopilot.clock)
            self._speak()

    def _listen(self) -> None:
        if self.observer is not None:
            self.observer.look()
        inbox, self._inbox = self._inbox, []
        for message in self._parser.parse_buffer(b"".join(inbox)) or ():
            if message.get_type() == "PARAM_SET" and self.observer is not None:
                self.observer.parameter_set(message.param_id, message.param_value)
            self.autopilot.receive(self._link, message)

    def _speak(self) -> None:
        waiting, self._link.outbox = self._link.outbox, []
        frames = [packed(message, self._packer) for _, message in waiting]
        if frames and self._line is not None and self._line.receive is not None:
            self._line.receive(b"".join(frames), None)

    # The daemon

    async def start_daemon(self, *, approval: bool) -> None:
        """Start the service, as systemd does."""
        document = {
            "link": {"heartbeat_limit_s": 120.0},
            "push": {"policy": "landed", "approval": approval},
            "state": {"directory": str(self._directory)},
            "http": {"enabled": False},
        }
        self.service = Service(
            from_mapping(document, source="soak"), clock=self.clock, wall_clock=self.unix
        )
        self._task = asyncio.create_task(self.service.run(), name="service")
        await self.service.ready.wait()

    async def stop_daemon(self, *, crash: bool = False) -> None:
        """Stop it in good order, or at once.

        Raises:
            Exception: whatever it ended with.
        """
        if self.service is None or self._task is None:
            return
        if crash:
            self._task.cancel()
        else:
            self.service.stop()
        with contextlib.suppress(asyncio.CancelledError):
            await self._task
        self.service = self._task = None

    @property
    def failed(self) -> bool:
        """Whether the daemon has ended by itself."""
        return self._task is not None and self._task.done()

    @contextlib.contextmanager
    def fitted(self) -> Iterator[None]:
        """While this lasts a service gets this room's line and worker."""
        with (
            mock.patch.object(connection, "open_transport", self._open),
            mock.patch.object(handover, "Worker", self._employ),
        ):
            yield

    def _employ(self, _name: str) -> Worker:
        return Worker(self)

    def _take(self, data: bytes) -> None:
        self._inbox.append(data)

    async def _open(
        self, _endpoint: object, receive: Receive, _lost: object, *, linger: float, first: First
    ) -> Transport:
        del linger, first  # nobody else is on this line
        self._line = Line(receive, self._take)
        return self._line

    def raise_failure(self) -> None:
        """Raise what the daemon ended with, if it has ended by itself."""
        if self._task is not None and self._task.done():
            self._task.result()
