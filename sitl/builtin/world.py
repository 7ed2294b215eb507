"""The world around the autopilot: pieces of flight one after the other, and what sensors see."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, TypeAlias

from sitl.builtin import effects as fx
from sitl.builtin.attitude import STEP
from sitl.builtin.copter import CopterFlight, copter_trajectory
from sitl.builtin.gps import Fix, Receiver
from sitl.builtin.plane import PlaneFlight, plane_trajectory
from sitl.builtin.rotation import rotate
from sitl.builtin.sensors import ImuReadings, board_axes, read_imu
from sitl.builtin.smoothing import RATE, Array
from sitl.builtin.trajectory import Environment, Start, Trajectory, parked, whole_samples
from sitl.builtin.truth import Truth

Vehicle: TypeAlias = Literal["plane", "copter"]
BLOCK = round(STEP * RATE)


@dataclass(frozen=True, slots=True)
class Filters:
    """Low-pass cut-offs in force, Hz."""

    accel_hz: float = 20.0
    gyro_hz: float = 20.0


@dataclass(frozen=True, slots=True)
class Blocks:
    """Means over the attitude filter's steps: what it integrates, rows of ``STEP`` seconds.

    Body axes are those of the autopilot, however it sits in the airframe.
    """

    R_nb: Array
    f_n: Array
    f_b: Array
    w_b: Array
    raw: Array
    gyro: Array

    def first(self, n: int) -> Blocks:
        """The first ``n`` steps."""
        return Blocks(
            R_nb=self.R_nb[:n],
            f_n=self.f_n[:n],
            f_b=self.f_b[:n],
            w_b=self.w_b[:n],
            raw=self.raw[:n],
            gyro=self.gyro[:n],
        )


@dataclass(slots=True)
class Piece:
    """A stretch of trajectory with everything measured on it, from boot time ``start``."""

    start: float
    trajectory: Trajectory
    imus: tuple[ImuReadings, ...]
    fixes: list[Fix]
    blocks: Blocks
    flight: PlaneFlight | CopterFlight | None

    @property
    def end(self) -> float:
        """Boot time at which the next piece starts."""
        return self.start + self.trajectory.duration

    def cut(self, n: int) -> None:
        """Keeps the first ``n`` samples, a multiple of the attitude filter's step."""
        self.trajectory = self.trajectory.first(n)
        self.imus = tuple(imu.first(n) for imu in self.imus)
        self.fixes = [fix for fix in self.fixes if fix.t_valid < self.end]
        self.blocks = self.blocks.first(n // BLOCK)

    def index(self, t: float) -> int:
        """Row of the last sample at or before boot time ``t``."""
        return min(max(int((t - self.start) * RATE + 1e-6), 0), self.trajectory.n - 1)


class World:
    """Pieces in order; grows parked ones by itself, and a flight when one is launched."""

    def __init__(
        self,
        vehicle: Vehicle,
        truth: Truth,
        *,
        filters: Filters | None = None,
        dull: bool = False,
        origin: float = 0.0,
        start: Start | None = None,
    ) -> None:
        self.vehicle = vehicle
        self.truth = truth
        self.origin = origin
        self._filters = filters or Filters()
        self._dull = dull
        self._receiver = Receiver(truth)
        self._flights = 0
        self._start = start or Start()
        self.pieces: list[Piece] = []

    @property
    def environment(self) -> Environment:
        """The surroundings, with gravity as it really is."""
        extra = sum(e.delta_g for e in self.truth.effects if isinstance(e, fx.Gravity))
        home = self.truth.environment
        return replace(home, gravity=home.gravity + extra)

    @property
    def end(self) -> float:
        """Boot time up to which the world exists."""
        return self.pieces[-1].end if self.pieces else 0.0

    def park(self, seconds: float) -> None:
        """Stands still for a while."""
        start = self.pieces[-1].trajectory.end if self.pieces else self._start
        aircraft = self.truth.aircraft
        if aircraft is None:
            still = parked(start, seconds, self.environment)
        else:
            still = aircraft.stand(self.environment, start, seconds, self._consumed())
        self._append(still, None)

    def ensure(self, t: float) -> None:
        """Makes sure that the world exists at boot time ``t``."""
        while self.end <= t + 1.0:
            self.park(10.0)

    def launch(self, t: float, duration: float) -> float:
        """A flight begins just after ``t``; returns the boot time at which it is over."""
        while len(self.pieces) > 1 and self.pieces[-1].start > t:
            self.pieces.pop()
        piece = self.pieces[-1]
        keep = whole_samples(t - piece.start + STEP)
        if piece.flight is None and keep < piece.trajectory.n:
            piece.cut(keep)
        self._flights += 1
        flight = self._flight(duration)
        self._append(self._fly(flight, self.pieces[-1].trajectory.end), flight)
        return self.end

    def stop(self, t: float) -> None:
        """Ends the flight under way at ``t`` early: what has been flown stays as it is."""
        piece = self.pieces[-1]
        if piece.flight is None:
            return
        if piece.flight.stop_at is not None:
            return  # on its way down already
        flight = replace(piece.flight, stop_at=max(t - piece.start, 0.0) + 0.5)
        start = self.pieces[-2].trajectory.end if len(self.pieces) > 1 else self._start
        self._measure_again(piece, self._fly(flight, start), self.truth)

    def rebuild(self, truth: Truth, filters: Filters) -> None:
        """Takes over changed hardware or filters, from the piece under way on."""
        self.truth = truth
        self._filters = filters
        self._receiver = Receiver(truth)
        for piece in self.pieces[-2:]:
            self._measure_again(piece, piece.trajectory, truth)

    def at(self, t: float) -> Piece:
        """The piece at boot time ``t``."""
        for piece in reversed(self.pieces):
            if piece.start <= t:
                return piece
        return self.pieces[0]

    def forget(self, t: float) -> None:
        """Drops pieces that ended long before ``t``."""
        while len(self.pieces) > 2 and self.pieces[1].end < t - 5.0:
            self.pieces.pop(0)

    def _flight(self, duration: float) -> PlaneFlight | CopterFlight:
        seed = self.truth.seed * 1000 + self._flights
        if self.vehicle == "plane":
            return PlaneFlight(seed=seed, duration=duration, dull=self._dull)
        drag = [(e.x, e.y) for e in self.truth.effects if isinstance(e, fx.RotorDrag)]
        flight = CopterFlight(seed=seed, duration=duration, dull=self._dull)
        return replace(flight, drag=drag[0]) if drag else flight

    def _consumed(self) -> float:
        """Charge that the last piece has left used, mAh."""
        outputs = self.pieces[-1].trajectory.outputs if self.pieces else None
        return 0.0 if outputs is None else float(outputs.consumed[-1])

    def _fly(self, flight: PlaneFlight | CopterFlight, start: Start) -> Trajectory:
        if self.truth.aircraft is not None:
            return self.truth.aircraft.fly(
                self.environment,
                start,
                seed=flight.seed,
                duration=flight.duration,
                dull=flight.dull,
                stop_at=flight.stop_at,
            )
        if isinstance(flight, PlaneFlight):
            return _plane(flight, self.environment, start)
        return _copter(flight, self.environment, start)

    def _append(self, trajectory: Trajectory, flight: PlaneFlight | CopterFlight | None) -> None:
        start = self.end
        imus = self._read(trajectory, start)
        fixes = self._receiver.read(trajectory, self.truth, start=start, origin=self.origin)
        blocks = _blocks(trajectory, imus[0], board_axes(self.truth))
        self.pieces.append(Piece(start, trajectory, imus, fixes, blocks, flight))

    def _measure_again(self, piece: Piece, trajectory: Trajectory, truth: Truth) -> None:
        piece.trajectory = trajectory
        piece.imus = self._read(trajectory, piece.start)
        piece.fixes = self._receiver.read(trajectory, truth, start=piece.start, origin=self.origin)
        piece.blocks = _blocks(trajectory, piece.imus[0], board_axes(truth))

    def _read(self, trajectory: Trajectory, start: float) -> tuple[ImuReadings, ...]:
        return tuple(
            read_imu(
                trajectory,
                self.truth,
                index,
                start=start,
                accel_filter_hz=self._filters.accel_hz,
                gyro_filter_hz=self._filters.gyro_hz,
                origin=self.origin,
            )
            for index in range(len(self.truth.imus))
        )


# A motion does not depend on the sensors: the last one is often flown again with others.
@lru_cache(maxsize=1)
def _plane(flight: PlaneFlight, environment: Environment, start: Start) -> Trajectory:
    return plane_trajectory(flight, environment, start).unwritable()


@lru_cache(maxsize=1)
def _copter(flight: CopterFlight, environment: Environment, start: Start) -> Trajectory:
    return copter_trajectory(flight, environment, start).unwritable()


def _blocks(trajectory: Trajectory, imu: ImuReadings, board: Array) -> Blocks:
    def mean(x: Array) -> Array:
        out: Array = x.reshape(-1, BLOCK, x.shape[1]).mean(axis=1)
        return out

    return Blocks(
        R_nb=trajectory.R_nb[BLOCK // 2 :: BLOCK] @ board,
        f_n=mean(rotate(trajectory.R_nb, trajectory.f_b)),
        f_b=mean(trajectory.f_b) @ board,
        w_b=mean(trajectory.w_b) @ board,
        raw=mean(imu.raw),
        gyro=mean(imu.gyro),
    )
