"""MAVLink messages to samples, one code path for the live link and for .tlog files.

What each message says is in :mod:`onboard.mavlink.readings`; here is whose messages count.
"""

from __future__ import annotations

from collections.abc import Callable

from onboard.mavlink import limits
from onboard.mavlink.bootclock import BootClock
from onboard.mavlink.dialect import MESSAGE_IDS, Message, mavlink
from onboard.mavlink.readings import NOTHING, Readings, Samples

PARAM_VALUE = MESSAGE_IDS["PARAM_VALUE"]


class Decoder:
    """Turns the messages of one autopilot into samples, stamped by its boot clock.

    Only the autopilot is listened to: the system and component given, or else those of the
    first HEARTBEAT that comes from an autopilot (gimbals, ground stations and companions
    send heartbeats, too).  Until then nothing comes out but what has no time: parameters that
    were told before are told then.  Messages without a time of their own get the latest boot
    time heard.  The clock is the link's where there is one, which the link has told each message
    before; else the decoder keeps one.  ``refused`` counts what could not be used, by name.
    """

    names: tuple[str, ...] = (
        "RAW_IMU",
        "HIGHRES_IMU",
        "SCALED_IMU",
        "SCALED_IMU2",
        "SCALED_IMU3",
        "ATTITUDE",
        "ATTITUDE_QUATERNION",
        "GPS_RAW_INT",
        "GPS2_RAW",
        "VIBRATION",
        "EKF_STATUS_REPORT",
        "EXTENDED_SYS_STATE",
        "HEARTBEAT",
        "VFR_HUD",
        "WIND",
        "BATTERY_STATUS",
        "SERVO_OUTPUT_RAW",
        "SYS_STATUS",
        "SYSTEM_TIME",
        "PARAM_VALUE",
        *(("GNSS_INTEGRITY",) if "GNSS_INTEGRITY" in MESSAGE_IDS else ()),
    )

    def __init__(
        self,
        system: int | None = None,
        component: int | None = None,
        clock: BootClock | None = None,
    ) -> None:
        self.clock = BootClock() if clock is None else clock
        self._tells_clock = clock is None
        self._readings = Readings(self.clock)
        self._system = system
        self._component = component
        self._early: dict[tuple[int, int], dict[str, Message]] = {}
        self._decoders: dict[int, Callable[[Message], Samples]] = {
            MESSAGE_IDS[name]: self._readings.of(name) for name in self.names
        }

    @property
    def refused(self) -> dict[str, int]:
        """What could not be used, and how often, by name."""
        return self._readings.refused

    @property
    def tells_views(self) -> bool:
        """Whether ATTITUDE is of other axes in hover than in forward flight."""
        return self._readings.tells_views

    @property
    def source(self) -> tuple[int, int] | None:
        """System and component listened to; None while no autopilot has been heard."""
        if self._system is None or self._component is None:
            return None
        return self._system, self._component

    def decode(self, message: Message) -> Samples:
        """Samples that the message carries, in SI units: usually one or none."""
        decoder = self._decoders.get(message.get_msgId())
        if decoder is None:
            return NOTHING
        if (
            message.get_srcComponent() == self._component
            and message.get_srcSystem() == self._system
        ):
            return self._heard(decoder, message)
        if self._adopts(message):
            early = self._early.pop((message.get_srcSystem(), message.get_srcComponent()), {})
            self._early.clear()
            read = self._decoders[PARAM_VALUE]
            told = tuple(sample for m in early.values() for sample in read(m))
            return told + self._heard(decoder, message)
        if self._component is None and message.get_msgId() == PARAM_VALUE:
            self._keep(message)
        return NOTHING

    def _heard(self, decoder: Callable[[Message], Samples], message: Message) -> Samples:
        """Decode a message of the autopilot."""
        if self._tells_clock:
            self.clock.observe(message)
        return decoder(message)

    def _keep(self, message: Message) -> None:
        """A parameter of somebody who may turn out to be the autopilot."""
        source = message.get_srcSystem(), message.get_srcComponent()
        if len(self._early) < limits.EARLY_SOURCES or source in self._early:
            kept = self._early.setdefault(source, {})
            if len(kept) < limits.EARLY_PARAMETERS or message.param_id in kept:
                kept[message.param_id] = message

    def _adopts(self, message: Message) -> bool:
        """Settle on the sender if it is the first autopilot heard (of the system asked for)."""
        if (
            self._component is not None
            or (self._system is not None and message.get_srcSystem() != self._system)
            or not is_autopilot(message)
        ):
            return False
        self._system, self._component = message.get_srcSystem(), message.get_srcComponent()
        return True


def is_armed(heartbeat: Message) -> bool:
    """Whether a HEARTBEAT says armed."""
    return bool(heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)


def is_autopilot(message: Message) -> bool:
    """Whether this is the HEARTBEAT of an autopilot (not of a gimbal, a station, a companion)."""
    return bool(
        message.get_msgId() == mavlink.MAVLINK_MSG_ID_HEARTBEAT
        and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
        and message.type != mavlink.MAV_TYPE_GCS
    )
