"""The built-in autopilot: a sans-IO machine that lives in its own time.

``advance`` moves the boot clock on in steps of the main loop; whatever is to be sent
appears in the outbox of each link with the time of sending; ``receive`` takes what a link
brought.  Its parameters act on its sensors exactly as ArduPilot applies them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from sitl.builtin import commands
from sitl.builtin.arming import refusals
from sitl.builtin.attitude import STEP
from sitl.builtin.boot_clock import BootClock
from sitl.builtin.defaults import initial_parameters, truth_in_force
from sitl.builtin.flight_control import FlightControl, Orders
from sitl.builtin.gps import FIX_3D
from sitl.builtin.instant import Corrections, Instant
from sitl.builtin.links import SENDING, Link, Links
from sitl.builtin.messages import Message
from sitl.builtin.navigation import Navigation
from sitl.builtin.params import Notice, ParameterStore, Value
from sitl.builtin.sensors import Barometer
from sitl.builtin.supply import Supply
from sitl.builtin.trajectory import Start
from sitl.builtin.truth import ImuTruth, Truth
from sitl.builtin.world import Filters, Vehicle, World

FLIGHT_DURATION = 300.0
"""How long a flight that a client begins goes on unless it is told to land, s."""


class Autopilot:
    """A plane or a copter with ArduPilot's manners.

    Args:
        vehicle: ``plane`` or ``copter``.
        truth: the hardware.
        parameters: values that differ from the defaults.
        loop_rate: SCHED_LOOP_RATE, Hz.
        dull: flights are a hover or a straight line.
        longest: a flight on command ends by itself after so many seconds.

    Attributes:
        links: its clients, and what each is sent.
        control: arming, modes and flights since the last boot.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        truth: Truth,
        *,
        parameters: Mapping[str, float] | None = None,
        loop_rate: int | None = None,
        dull: bool = False,
        longest: float = FLIGHT_DURATION,
    ) -> None:
        self._longest = longest
        self.vehicle: Vehicle = vehicle
        self.truth = truth
        self._dull = dull
        self._loop_rate = loop_rate
        self.parameters = self._store(parameters or {})
        self._time = BootClock()
        self.links = Links(self._time, self.parameters)
        self._boot(Start())

    def _boot(self, start: Start) -> None:
        """Power on: clock at zero, filters fresh, intervals from the stream rates."""
        self._supply = Supply(self._time)
        self._orders: Orders = Orders()
        self._time.boot()
        self._loops = 0
        self._period = 1.0 / self.parameters["SCHED_LOOP_RATE"]
        self.truth = truth_in_force(self.truth, self.parameters)
        self._dirty_world = False
        self.world = World(
            self.vehicle,
            self.truth,
            filters=_filters(self.parameters),
            dull=self._dull,
            start=start,
        )
        self.world.ensure(1.0)
        self.corrections = Corrections(self.parameters, len(self.truth.imus))
        self.navigation = Navigation(self.world, self.parameters)
        self.barometer = Barometer(self.truth.seed)
        self.control = FlightControl(
            self.vehicle, self.world, self._time, self._orders, say=self.say, longest=self._longest
        )
        self._consumed = 0.0
        self.links.boot()

    # -- links -----------------------------------------------------------------------------

    def connect(self, link: Link | None = None) -> Link:
        """A new client; it gets a heartbeat and the stream rates of the parameters."""
        return self.links.connect(link)

    def receive(self, link: Link, message: Message) -> None:
        """Takes a message that a client has sent; without power nothing is heard."""
        if self._supply.on:
            commands.receive(self, link, message)

    def say(self, item: Value | Notice, link: Link | None = None) -> None:
        """Notices and broadcasts to everyone, answers to one link."""
        self.links.say(item, link)

    # -- time ------------------------------------------------------------------------------

    @property
    def now(self) -> float:
        """Boot time, s."""
        return self._time.now

    @property
    def clock(self) -> float:
        """Seconds that this simulation has run, over all reboots and times without power."""
        return self._time.total

    def advance(self, seconds: float) -> None:
        """Runs the main loop for so long; messages appear in the links' outboxes."""
        end = self.clock + seconds - 1e-9
        while self.clock < end:
            if self._supply.on:
                self._idle(end)
                if self.clock < end:
                    self._loop()
            elif self._supply.back_by(end + 1e-9):
                self._boot(self._supply.start)

    def _idle(self, end: float) -> None:
        """Loops in which nothing is to be done, up to ``end`` on :attr:`clock`: most of them."""
        if self._orders or self._dirty_world or self.parameters.saving:
            return
        world, step, due = self.world.end, self.navigation.following, self.links.next_due
        loops, now, left = self._loops, self.now, end - (self.clock - self.now)
        while now < left:
            then = (loops + 1) * self._period
            if world < then + 2.0 or step <= then or due <= then * 1e3:
                break
            loops, now = loops + 1, then
        if loops > self._loops:
            self._loops = loops
            self._time.tick(now)

    def _loop(self) -> None:
        while self._orders:
            self._orders.popleft()()
        self._loops += 1
        self._time.tick(self._loops * self._period)
        if self.world.end < self.now + 2.0:
            self.world.ensure(self.now + 1.0)
        if self._dirty_world:
            self._dirty_world = False
            self.truth = truth_in_force(self.truth, self.parameters)
            self.world.rebuild(self.truth, _filters(self.parameters))
        while self.navigation.due(self.now):
            self._filter_step()
        if self.parameters.saving:
            for value in self.parameters.poll(self.now):
                self.say(value)
        self.links.send_due(self.instant, self._period)

    def _filter_step(self) -> None:
        """40 ms of everything that is slower than the sensors."""
        start = self.navigation.reached
        piece = self.world.at(start + 1e-6)
        row = round((start - piece.start) / STEP)
        if self.navigation.step(piece, row, self.now, self.corrections):
            self.control.watch(piece)
            self._consumed += STEP / 3.6 * (0.4 + 32.0 * float(piece.trajectory.throttle[row]))
            self.world.forget(self.now)

    def instant(self) -> Instant:
        """What is known now."""
        t = self.now
        piece = self.world.at(t)
        return Instant(
            t=t + SENDING,
            t_sample=t,
            world=self.world,
            piece=piece,
            row=piece.index(t),
            corrections=self.corrections,
            ahrs=self.navigation.ahrs,
            barometer=self.barometer,
            fix=self.navigation.fix,
            fix_new=self.navigation.fix_new,
            armed=self.armed,
            mode=self.control.mode,
            vehicle=self.vehicle,
            consumed_mah=self._consumed,
            capacity_mah=self.parameters["BATT_CAPACITY"] if self.truth.aircraft else 0.0,
        )

    # -- flight ----------------------------------------------------------------------------

    @property
    def armed(self) -> bool:
        """Whether motors may turn."""
        return self.control.armed

    @property
    def flying(self) -> bool:
        """A flight is under way, from launch until it has disarmed."""
        return self.control.flying

    def arm(self, *, force: bool = False) -> list[str]:
        """Arms; returns what stands against it, which STATUSTEXT says too."""
        if self.armed:
            return []
        piece, fix = self.world.at(self.now), self.navigation.fix
        gps = fix is not None and fix.fix_type >= FIX_3D
        row = piece.index(self.now)
        reasons = [] if force else refusals(self.parameters, self.corrections, piece, row, gps=gps)
        self.control.arm(reasons)
        return reasons

    def take_off(self, duration: float | None = None) -> bool:
        """Starts a flight of about so many seconds, ground to ground; must be armed."""
        return self.control.take_off(duration)

    def request_reboot(self) -> bool:
        """Reboots in the next loop, so that the answer still goes out; refused while armed."""
        if self.armed:
            return False
        self._orders.append(self.power_cycle)
        return True

    # -- power -----------------------------------------------------------------------------

    def power_cycle(self, off: float = 0.0) -> bool:
        """Power off, and on again after so many seconds; refused while armed.

        Parameters stay, everything else goes.
        """
        if self.armed:
            return False
        self.parameters.count_boot()
        self._cut_power(off)
        return True

    def swap_board(
        self,
        board: str,
        imus: tuple[ImuTruth, ...],
        parameters: Mapping[str, float] | None = None,
        *,
        off: float = 0.0,
    ) -> bool:
        """Puts another board of the same model into the vehicle; refused while armed.

        What names a sensor is the same, INS_ACC_ID and all; the board's unique id, what its
        sensors are like and the parameters that it has stored are its own.

        Args:
            board: its unique id, as in :class:`~sitl.builtin.truth.Truth`.
            imus: its sensors, as many as before.
            parameters: what it has stored that differs from the defaults.
            off: seconds without power.

        Raises:
            ValueError: another number of sensors, which is another model.
        """
        if len(imus) != len(self.truth.imus):
            raise ValueError(f"a board of this model has {len(self.truth.imus)} inertial sensors")
        if self.armed:
            return False
        speedup = self.parameters["SIM_SPEEDUP"]
        self.truth = replace(self.truth, board=board, imus=imus)
        self.parameters = self._store({"SIM_SPEEDUP": speedup, **(parameters or {})})
        self.links.parameters = self.parameters
        self._cut_power(off)
        return True

    def _cut_power(self, seconds: float) -> None:
        self._supply.cut(seconds, self.world.at(self.now).trajectory.end)
        if seconds <= 0.0:
            self._boot(self._supply.start)

    # -- parameters ------------------------------------------------------------------------

    def _store(self, stored: Mapping[str, float]) -> ParameterStore:
        """Parameters of a board: defaults, but for what it has stored."""
        defaults = initial_parameters(self.vehicle, self.truth, self._loop_rate)
        store = ParameterStore(defaults, self._changed)
        store.load(stored)
        return store

    def _changed(self, name: str) -> None:
        if name == "SIM_SPEEDUP":
            return
        if name.startswith("SIM_") or name in {"INS_ACCEL_FILTER", "INS_GYRO_FILTER"}:
            self._dirty_world = True
        elif name.startswith(("INS_ACC", "AHRS_")) and hasattr(self, "corrections"):
            self.corrections = Corrections(self.parameters, len(self.truth.imus))


def _filters(parameters: ParameterStore) -> Filters:
    """The sensors' low-passes in force."""
    return Filters(parameters["INS_ACCEL_FILTER"], parameters["INS_GYRO_FILTER"])
