"""Attitude, velocity and position as the autopilot knows them: filter, compass, GPS."""

from __future__ import annotations

import math

import numpy as np

from sitl.builtin import rotation
from sitl.builtin.attitude import STEP, AttitudeFilter
from sitl.builtin.gps import FIX_3D, Fix
from sitl.builtin.instant import Corrections
from sitl.builtin.params import ParameterStore
from sitl.builtin.smoothing import DT, Array
from sitl.builtin.world import Piece, World

ALIGNMENT_BLOCKS = 25
HEADING_EVERY = 5
ASSUMED_GPS_DELAY = 0.1
"""What the attitude filter takes where GPS1_DELAY_MS is 0, s."""


class Navigation:
    """Everything between the sensors and the state, from one boot to the next.

    Attributes:
        ahrs: the filter.
        fix: the receiver's last, None before the first.
        fix_new: when it came, s on the boot clock.
    """

    def __init__(self, world: World, parameters: ParameterStore) -> None:
        """Not aligned yet."""
        self.ahrs = AttitudeFilter()
        self.fix: Fix | None = None
        self.fix_new = -1.0
        self._world = world
        self._parameters = parameters
        self._block = 0
        self._compass = np.random.default_rng([world.truth.seed, 41])
        self._wandering = 0.0

    @property
    def reached(self) -> float:
        """Boot time up to which the filter has run, s."""
        return self._block * STEP

    @property
    def following(self) -> float:
        """Boot time at which the next 40 ms are over, s."""
        return (self._block + 1) * STEP

    def due(self, now: float) -> bool:
        """Whether the next 40 ms are over."""
        return self.following <= now

    def step(self, piece: Piece, row: int, now: float, corrections: Corrections) -> bool:
        """The next 40 ms; whether it is aligned then.

        Args:
            piece: of the world, at :attr:`reached`.
            row: its block.
            now: s on the boot clock.
            corrections: of the accelerometers, in force.
        """
        blocks = piece.blocks
        self._block += 1
        f_error = corrections.apply(0, blocks.raw[row]) - blocks.f_b[row]
        if self._block < ALIGNMENT_BLOCKS:
            return False
        if self._block == ALIGNMENT_BLOCKS:
            self.ahrs.align(blocks.R_nb[row], f_error, self._heading_error(blocks.R_nb[row]))
        self.ahrs.predict(
            blocks.R_nb[row], blocks.f_n[row], f_error, blocks.gyro[row] - blocks.w_b[row]
        )
        if self._block % HEADING_EVERY == 0:
            self.ahrs.fuse_heading(self._heading_error(blocks.R_nb[row]))
        self._take_fixes(now)
        return True

    def _heading_error(self, R_nb: Array) -> float:
        compass = self._world.truth.compass
        keep = math.exp(-HEADING_EVERY * STEP / compass.wandering_time)
        fresh = compass.wandering * math.sqrt(1.0 - keep**2)
        self._wandering = keep * self._wandering + fresh * float(self._compass.standard_normal())
        yaw = math.atan2(R_nb[1, 0], R_nb[0, 0])
        return compass.constant + compass.per_heading * math.sin(yaw + 0.7) + self._wandering

    def _take_fixes(self, now: float) -> None:
        for piece in self._world.pieces:
            while piece.fixes and piece.fixes[0].t_arrival <= now:
                fix = piece.fixes.pop(0)
                if self.fix is not None and fix.t_valid <= self.fix.t_valid:
                    continue
                self.fix, self.fix_new = fix, now
                if fix.fix_type >= FIX_3D and self._block > ALIGNMENT_BLOCKS:
                    self._fuse(fix)

    def _fuse(self, fix: Fix) -> None:
        """What the filter sees: the fix against the truth at the time it takes it for."""
        told = self._parameters["GPS1_DELAY_MS"] * 1e-3
        t = fix.t_stamp - (told or ASSUMED_GPS_DELAY)
        piece = self._world.at(t)
        place = min(max((t - piece.start) / DT, 0.0), piece.trajectory.n - 1.001)
        row, part = int(place), place - int(place)
        v = (1.0 - part) * piece.trajectory.v_n[row] + part * piece.trajectory.v_n[row + 1]
        p = (1.0 - part) * piece.trajectory.p_n[row] + part * piece.trajectory.p_n[row + 1]
        arm = np.array(self._parameters.vector("GPS1_POS_"))
        R = piece.trajectory.R_nb[row]
        v = v + R @ rotation.cross(piece.trajectory.w_b[row], arm)
        self.ahrs.fuse_gps(np.array(fix.v_n) - v, np.array(fix.p_n) - p - R @ arm)
