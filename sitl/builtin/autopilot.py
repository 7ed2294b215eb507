"""The built-in autopilot: a sans-IO machine that lives in its own time.

``advance`` moves the boot clock on in steps of the main loop; whatever is to be sent
appears in the outbox of each link with the time of sending; ``receive`` takes what a link
brought.  Its parameters act on its sensors exactly as ArduPilot applies them.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.builtin import commands, messages, rotation, streams
from sitl.builtin.arming import refusals
from sitl.builtin.attitude import STEP, AttitudeFilter
from sitl.builtin.defaults import initial_parameters, truth_in_force
from sitl.builtin.gps import FIX_3D, Fix
from sitl.builtin.instant import Corrections, Instant
from sitl.builtin.messages import Message
from sitl.builtin.params import Notice, ParameterStore, Value
from sitl.builtin.sensors import Barometer
from sitl.builtin.smoothing import DT, Array
from sitl.builtin.trajectory import Start
from sitl.builtin.truth import ImuTruth, Truth
from sitl.builtin.world import Filters, Piece, Vehicle, World

SENDING = 4e-4
"""From the start of a main loop to its first message, s."""
BETWEEN = 3e-5
ALIGNMENT_BLOCKS = 25
HEADING_EVERY = 5
PARAMETERS_PER_SECOND = 200.0
"""Speed of a parameter list, as on a fast telemetry link."""
ASSUMED_GPS_DELAY = 0.1
"""What the attitude filter takes where GPS1_DELAY_MS is 0, s."""
IDLE_DISARM = 10.0
FLIGHT_DURATION = 300.0
"""How long a flight that a client begins goes on unless it is told to land, s."""


@dataclass(frozen=True, slots=True)
class Modes:
    """Custom mode numbers; ``stop`` end a flight, ``go`` begin one as soon as it is armed."""

    idle: int
    flying: int
    landing: int
    stop: tuple[int, ...]
    go: tuple[int, ...] = ()


MODES = {
    "copter": Modes(idle=0, flying=4, landing=9, stop=(6, 9)),
    "plane": Modes(idle=0, flying=10, landing=11, stop=(11, 20, 26), go=(13,)),
}


@dataclass(eq=False, slots=True)
class Link:
    """One client's channel: its own intervals, its own parameter list, its outbox."""

    schedule: streams.Schedule = field(default_factory=streams.Schedule)
    outbox: list[tuple[float, Message]] = field(default_factory=list)
    listing: float | None = None


class Autopilot:
    """A plane or a copter with ArduPilot's manners.

    Args:
        vehicle: ``plane`` or ``copter``.
        truth: the hardware.
        parameters: values that differ from the defaults.
        loop_rate: SCHED_LOOP_RATE, Hz.
        dull: flights are a hover or a straight line.
        longest: a flight on command ends by itself after so many seconds.
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
        self._dirty_world = False
        self.parameters = self._stored(parameters or {})
        self.links: list[Link] = []
        self.clock = 0.0
        """Seconds that this simulation has run, over all reboots and times without power."""
        self._boot(Start())

    def _boot(self, start: Start) -> None:
        """Power on: clock at zero, filters fresh, intervals from the stream rates."""
        self._unpowered: tuple[float, Start] | None = None
        self._orders: deque[Callable[[], object]] = deque()
        self._launching = False
        self.now = 0.0
        self._booted_at = self.clock
        self._loops = 0
        self._period = 1.0 / self.parameters["SCHED_LOOP_RATE"]
        self.truth = truth_in_force(self.truth, self.parameters)
        self._dirty_world = False
        self.world = World(
            self.vehicle, self.truth, filters=self._filters(), dull=self._dull, start=start
        )
        self.world.ensure(1.0)
        self.corrections = Corrections(self.parameters, len(self.truth.imus))
        self.ahrs = AttitudeFilter()
        self.barometer = Barometer(self.truth.seed)
        self._block = 0
        self._fix: Fix | None = None
        self._fix_new = -1.0
        self._compass = np.random.default_rng([self.truth.seed, 41])
        self._wandering = 0.0
        self.armed = False
        self._armed_since = 0.0
        self._was_flying = False
        self._mode = MODES[self.vehicle].idle
        self._consumed = 0.0
        for link in self.links:
            self._default_intervals(link)

    # -- links -----------------------------------------------------------------------------

    def connect(self, link: Link | None = None) -> Link:
        """A new client; it gets a heartbeat and the stream rates of the parameters."""
        link = link or Link()
        self.links.append(link)
        self._default_intervals(link)
        return link

    def disconnect(self, link: Link) -> None:
        """The client has gone."""
        self.links.remove(link)

    def _default_intervals(self, link: Link) -> None:
        link.schedule = streams.Schedule()
        link.listing = None
        link.schedule.set("HEARTBEAT", 1000, self.now * 1e3)
        for names in streams.STREAMS.values():
            for name in names:
                self.set_interval(link, name, self.default_interval(name))

    def default_interval(self, name: str) -> int:
        """Interval that the stream rates in the parameters give a message, ms; 0 is never."""
        if name == "HEARTBEAT":
            return 1000
        for stream, names in streams.STREAMS.items():
            rate = self.parameters[f"MAV1_{stream}"]
            if name in names and rate > 0:
                return round(1000.0 / rate)
        return 0

    def set_rate(self, link: Link, name: str, rate_hz: float) -> bool:
        """Rate of a message on a link; 0 stops it.  False where ArduPilot refuses."""
        return self.set_interval(link, name, int(1000.0 / rate_hz) if rate_hz > 0 else 0)

    def request_parameters(self, link: Link) -> None:
        """As PARAM_REQUEST_LIST does."""
        link.listing = 0.0

    def set_interval(self, link: Link, name: str, interval: int) -> bool:
        """Interval of a message on a link, ms; 0 stops it.  False where ArduPilot refuses."""
        if interval and streams.too_fast(interval, self.parameters["SCHED_LOOP_RATE"]):
            return False
        link.schedule.set(name, interval, self.now * 1e3)
        return True

    # -- time ------------------------------------------------------------------------------

    def receive(self, link: Link, message: Message) -> None:
        """Takes a message that a client has sent; without power nothing is heard."""
        if self._unpowered is None:
            commands.receive(self, link, message)

    def advance(self, seconds: float) -> None:
        """Runs the main loop for so long; messages appear in the links' outboxes."""
        end = self.clock + seconds - 1e-9
        while self.clock < end:
            if self._unpowered is None:
                self._loop()
            else:
                self._wait_for_power(*self._unpowered, end + 1e-9)

    def _loop(self) -> None:
        while self._orders:
            self._orders.popleft()()
        self._loops += 1
        self.now = self._loops * self._period
        self.clock = self._booted_at + self.now
        if self.world.end < self.now + 2.0:
            self.world.ensure(self.now + 1.0)
        if self._dirty_world:
            self._dirty_world = False
            self.truth = truth_in_force(self.truth, self.parameters)
            self.world.rebuild(self.truth, self._filters())
        while (self._block + 1) * STEP <= self.now:
            self._filter_step()
        if self.parameters.saving:
            for value in self.parameters.poll(self.now):
                self.say(value)
        now_ms = self.now * 1e3
        instant: Instant | None = None
        for link in self.links:
            if link.schedule.next_due <= now_ms:
                instant = instant or self.instant()
                for name in link.schedule.due(now_ms):
                    self.send(link, messages.BUILDERS[name](instant))
            if link.listing is not None:
                self._list(link)

    def _filter_step(self) -> None:
        """40 ms of everything that is slower than the sensors."""
        start = self._block * STEP
        piece = self.world.at(start + 1e-6)
        row = round((start - piece.start) / STEP)
        self._block += 1
        blocks = piece.blocks
        f_error = self.corrections.apply(0, blocks.raw[row]) - blocks.f_b[row]
        if self._block < ALIGNMENT_BLOCKS:
            return
        if self._block == ALIGNMENT_BLOCKS:
            self.ahrs.align(blocks.R_nb[row], f_error, self._heading_error(blocks.R_nb[row]))
        self.ahrs.predict(
            blocks.R_nb[row], blocks.f_n[row], f_error, blocks.gyro[row] - blocks.w_b[row]
        )
        if self._block % HEADING_EVERY == 0:
            self.ahrs.fuse_heading(self._heading_error(blocks.R_nb[row]))
        self._take_fixes()
        self._watch_flight(piece, piece.index(self.now))
        self._consumed += STEP / 3.6 * (0.4 + 32.0 * float(piece.trajectory.throttle[row]))
        self.world.forget(self.now)

    def _heading_error(self, R_nb: Array) -> float:
        compass = self.truth.compass
        keep = math.exp(-HEADING_EVERY * STEP / compass.wandering_time)
        fresh = compass.wandering * math.sqrt(1.0 - keep**2)
        self._wandering = keep * self._wandering + fresh * float(self._compass.standard_normal())
        yaw = math.atan2(R_nb[1, 0], R_nb[0, 0])
        return compass.constant + compass.per_heading * math.sin(yaw + 0.7) + self._wandering

    def _take_fixes(self) -> None:
        for piece in self.world.pieces:
            while piece.fixes and piece.fixes[0].t_arrival <= self.now:
                fix = piece.fixes.pop(0)
                if self._fix is not None and fix.t_valid <= self._fix.t_valid:
                    continue
                self._fix, self._fix_new = fix, self.now
                if fix.fix_type >= FIX_3D and self._block > ALIGNMENT_BLOCKS:
                    self._fuse(fix)

    def _fuse(self, fix: Fix) -> None:
        """What the filter sees: the fix against the truth at the time it takes it for."""
        told = self.parameters["GPS1_DELAY_MS"] * 1e-3
        t = fix.t_stamp - (told or ASSUMED_GPS_DELAY)
        piece = self.world.at(t)
        place = min(max((t - piece.start) / DT, 0.0), piece.trajectory.n - 1.001)
        row, part = int(place), place - int(place)
        v = (1.0 - part) * piece.trajectory.v_n[row] + part * piece.trajectory.v_n[row + 1]
        p = (1.0 - part) * piece.trajectory.p_n[row] + part * piece.trajectory.p_n[row + 1]
        arm = np.array(self.parameters.vector("GPS1_POS_"))
        R = piece.trajectory.R_nb[row]
        v = v + R @ rotation.cross(piece.trajectory.w_b[row], arm)
        self.ahrs.fuse_gps(np.array(fix.v_n) - v, np.array(fix.p_n) - p - R @ arm)

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
            ahrs=self.ahrs,
            barometer=self.barometer,
            fix=self._fix,
            fix_new=self._fix_new,
            armed=self.armed,
            mode=self._mode,
            vehicle=self.vehicle,
            consumed_mah=self._consumed,
        )

    # -- flight ----------------------------------------------------------------------------

    @property
    def flying(self) -> bool:
        """A flight is under way, from launch until it has disarmed."""
        pieces = (self.world.at(self.now), self.world.pieces[-1])
        return self._launching or any(piece.flight is not None for piece in pieces)

    def arm(self, *, force: bool = False) -> list[str]:
        """Arms; returns what stands against it, which STATUSTEXT says too."""
        if self.armed:
            return []
        piece = self.world.at(self.now)
        gps = self._fix is not None and self._fix.fix_type >= FIX_3D
        row = piece.index(self.now)
        reasons = [] if force else refusals(self.parameters, self.corrections, piece, row, gps=gps)
        for reason in reasons:
            self.say(Notice(f"Arm: {reason}", 2))
        if not reasons:
            self.armed = True
            self._armed_since = self.now
            self.say(Notice("Arming motors", 6))
            if self._mode in MODES[self.vehicle].go:
                self.take_off()
        return reasons

    def disarm(self) -> bool:
        """Disarms; refused in the air."""
        piece = self.world.at(self.now)
        if not piece.trajectory.landed[piece.index(self.now)]:
            return False
        if self.armed:
            self.armed = False
            self.say(Notice("Disarming motors", 6))
        return True

    def take_off(self, duration: float | None = None) -> bool:
        """Starts a flight of about so many seconds, ground to ground; must be armed."""
        seconds = self._longest if duration is None else duration
        if not self.armed or self.flying:
            return False
        self._launching = True
        self._orders.append(lambda: self._launch(seconds))
        self._mode = MODES[self.vehicle].flying
        return True

    def land(self) -> bool:
        """Ends the flight early."""
        if not self.flying:
            return False
        self._mode = MODES[self.vehicle].landing
        self._orders.append(lambda: self.world.stop(self.now))
        return True

    def _launch(self, duration: float) -> None:
        self.world.launch(self.now, duration)
        self._launching = False

    def _watch_flight(self, piece: Piece, row: int) -> None:
        """Disarms after landing, or when nothing was done after arming."""
        flying = piece.flight is not None and bool(piece.trajectory.armed[row])
        if self._was_flying and not flying:
            self._mode = MODES[self.vehicle].idle
            self.disarm()
        self._was_flying = flying
        idle = self.now - self._armed_since > IDLE_DISARM
        if self.armed and not self.flying and idle:
            self.disarm()

    def set_mode(self, mode: int) -> None:
        """A mode asked for by a client; those that come home end a flight."""
        if self.flying:
            if mode in MODES[self.vehicle].stop:
                self.land()
        else:
            self._mode = mode

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
        self.parameters = self._stored({"SIM_SPEEDUP": speedup, **(parameters or {})})
        self._cut_power(off)
        return True

    def _stored(self, parameters: Mapping[str, float]) -> ParameterStore:
        """What a board has stored: defaults, but for these."""
        store = ParameterStore(
            initial_parameters(self.vehicle, self.truth, self._loop_rate), self._changed
        )
        store.load(parameters)
        return store

    def _cut_power(self, seconds: float) -> None:
        start = self.world.at(self.now).trajectory.end
        if seconds > 0.0:
            self._unpowered = (self.clock + seconds, start)
        else:
            self._boot(start)

    def _wait_for_power(self, until: float, start: Start, end: float) -> None:
        """Lets time pass without power until ``until``, or until ``end`` if that is earlier."""
        self.clock = min(until, end)
        if self.clock == until:
            self._boot(start)

    # -- parameters ------------------------------------------------------------------------

    def _changed(self, name: str) -> None:
        if name == "SIM_SPEEDUP":
            return
        if name.startswith("SIM_") or name in {"INS_ACCEL_FILTER", "INS_GYRO_FILTER"}:
            self._dirty_world = True
        elif name.startswith(("INS_ACC", "AHRS_")) and hasattr(self, "corrections"):
            self.corrections = Corrections(self.parameters, len(self.truth.imus))

    def _filters(self) -> Filters:
        return Filters(self.parameters["INS_ACCEL_FILTER"], self.parameters["INS_GYRO_FILTER"])

    def _list(self, link: Link) -> None:
        """The next few lines of a parameter list."""
        if link.listing is None:
            return
        following = link.listing + PARAMETERS_PER_SECOND * self._period
        for index in range(math.ceil(link.listing), math.ceil(following)):
            if index >= len(self.parameters):
                link.listing = None
                return
            self.send(link, parameter_message(self.parameters.by_index(index)))
        link.listing = following

    # -- sending ---------------------------------------------------------------------------

    def send(self, link: Link, message: Message) -> None:
        """Puts a message into a link's outbox; None is left out."""
        if message is not None:
            last = link.outbox[-1][0] if link.outbox else 0.0
            link.outbox.append((max(self.clock + SENDING, last + BETWEEN), message))

    def say(self, item: Value | Notice, link: Link | None = None) -> None:
        """Notices and broadcasts to everyone, answers to one link."""
        if isinstance(item, Notice):
            message = mav.MAVLink_statustext_message(item.severity, item.text.encode(), 0, 0)
        else:
            message = parameter_message(item)
        everyone = link is None or isinstance(item, Notice) or item.broadcast
        for target in self.links if everyone else [link]:
            if target is not None:
                self.send(target, message)


def parameter_message(value: Value) -> Message:
    """PARAM_VALUE."""
    return mav.MAVLink_param_value_message(
        value.name.encode(), value.value, int(value.kind), value.count, value.index
    )
