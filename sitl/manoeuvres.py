"""Random manoeuvres that excite every axis, flown over MAVLink."""

from __future__ import annotations

import json
import math
import random
from typing import Any, Protocol, TypeAlias

from mavsdk.plugins.mavlink_direct import MavlinkMessage

from sitl.course import Course, Point

GROUND_STATION = (255, 190)
"""MAV_GCS_SYSID: the only one whose stick inputs ArduPilot takes."""
GUIDED_VELOCITY_AND_YAW = 0b0000_1001_1100_0111
"""Type mask of SET_POSITION_TARGET_LOCAL_NED: velocity and yaw count, nothing else."""
GUIDED_ALONG_A_COURSE = 0
"""Likewise: everything counts, and the acceleration is one."""
READY_S = 6.0
"""Simulated seconds to get to the start of a course, and to turn to where it looks."""
SET_EVERY_S = 0.05
"""Between two points of a course: as often as the attitude comes."""
Plugin: TypeAlias = Any
"""Objects of MAVSDK, which has no types."""
Vector: TypeAlias = tuple[float, float, float]
STILL: Vector = (0.0, 0.0, 0.0)


class Seen(Protocol):
    """What is seen of the vehicle."""

    @property
    def time(self) -> float:
        """Boot time of the autopilot, s."""

    @property
    def height(self) -> float:
        """Above home, m."""

    @property
    def yaw(self) -> float:
        """Heading, rad."""

    async def wait(self, seconds: float) -> None:
        """Waits by the autopilot's clock."""


class Manoeuvres:
    """Draws manoeuvres and flies them."""

    def __init__(self, seen: Seen, direct: Plugin, *, seed: int) -> None:
        """Take the eyes, and MAVSDK's way to send any message."""
        self._seen = seen
        self._direct = direct
        self._random = random.Random(seed)  # noqa: S311 - manoeuvres, not secrets

    async def fly(self, vehicle: str, end: float) -> None:
        """Flies at random until ``end``, s on the boot clock."""
        while self._seen.time < end:
            if vehicle == "copter":
                await self._velocity_step()
            else:
                await self._stick_step()

    async def _velocity_step(self) -> None:
        """One velocity and heading for a few seconds, kept within a band of heights."""
        course = self._random.uniform(-math.pi, math.pi)
        speed = self._random.uniform(3.0, 9.0)
        climb = self._random.uniform(-2.0, 2.5)
        if not 12.0 < self._seen.height + 4.0 * climb < 60.0:
            climb = -climb
        velocity = (speed * math.cos(course), speed * math.sin(course), -climb)
        yaw = self._seen.yaw + self._random.uniform(-2.0, 2.0)
        end = self._seen.time + self._random.uniform(2.5, 4.5)
        while self._seen.time < end:  # ArduPilot stops when it hears nothing for 3 s
            await self.set_velocity(velocity, yaw)
            await self._seen.wait(0.5)

    async def set_velocity(self, velocity_n: tuple[float, float, float], yaw: float) -> None:
        """One velocity (NED, m/s) and heading (rad), for a copter in guided mode."""
        await self._guide(GUIDED_VELOCITY_AND_YAW, velocity=velocity_n, yaw=yaw)

    async def follow(self, course: Course) -> tuple[float, float]:
        """Along a course, from its start; when that began and ended, s on the boot clock."""
        ready = self._seen.time + READY_S
        while self._seen.time < ready:
            await self.set_point(course.start)
            await self._seen.wait(SET_EVERY_S)
        begun = self._seen.time
        while (flown := self._seen.time - begun) < course.seconds:
            await self.set_point(course.at(flown))
            await self._seen.wait(SET_EVERY_S)
        return begun, begun + course.seconds

    async def set_point(self, point: Point) -> None:
        """Where to be now, and on the way to where, for a copter in guided mode."""
        await self._guide(
            GUIDED_ALONG_A_COURSE,
            position=point.position,
            velocity=point.velocity,
            acceleration=point.acceleration,
            yaw=point.yaw,
            yaw_rate=point.yaw_rate,
        )

    async def _guide(
        self,
        mask: int,
        *,
        position: Vector = STILL,
        velocity: Vector = STILL,
        acceleration: Vector = STILL,
        yaw: float = 0.0,
        yaw_rate: float = 0.0,
    ) -> None:
        fields = {
            "time_boot_ms": 0,
            "target_system": 1,
            "target_component": 1,
            "coordinate_frame": 1,
            "type_mask": mask,
            "yaw": math.remainder(yaw, 2.0 * math.pi),
            "yaw_rate": yaw_rate,
        }
        for names, values in (
            (("x", "y", "z"), position),
            (("vx", "vy", "vz"), velocity),
            (("afx", "afy", "afz"), acceleration),
        ):
            fields |= dict(zip(names, values, strict=True))
        await self._direct.send_message(mavlink_message("SET_POSITION_TARGET_LOCAL_NED", fields))

    async def _stick_step(self) -> None:
        """One position of the sticks (-1000 ... 1000) for a few seconds."""
        roll = self._random.choice([-1.0, 1.0]) * self._random.uniform(0.3, 1.0)
        pitch = self._random.uniform(-1.0, 1.0)
        if self._seen.height < 60.0:
            pitch = -abs(pitch)  # stick back: climb
        if self._seen.height > 150.0:
            pitch = abs(pitch)
        rudder = self._random.choice([0.0, 0.0, -0.5, 0.5])
        throttle = self._random.uniform(0.3, 0.9)
        end = self._seen.time + self._random.uniform(2.5, 6.0)
        while self._seen.time < end:
            await self._sticks(roll, pitch, throttle, rudder)
            await self._seen.wait(0.4)

    async def _sticks(self, roll: float, pitch: float, throttle: float, rudder: float) -> None:
        fields = {
            "target": 1,
            "x": round(1000 * pitch),
            "y": round(1000 * roll),
            "z": round(1000 * throttle),
            "r": round(1000 * rudder),
            "buttons": 0,
        }
        await self._direct.send_message(mavlink_message("MANUAL_CONTROL", fields))


def mavlink_message(name: str, fields: dict[str, Any]) -> Plugin:
    """A message of the ground station to the autopilot."""
    return MavlinkMessage(
        message_name=name,
        system_id=GROUND_STATION[0],
        component_id=GROUND_STATION[1],
        target_system_id=1,
        target_component_id=1,
        fields_json=json.dumps(fields),
    )
