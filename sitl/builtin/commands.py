"""What a client says to the autopilot, and what ArduPilot answers.

One handler per message and one per command; whatever has no handler is ignored (messages)
or answered as unsupported (commands), as ArduPilot does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.builtin import messages, streams
from sitl.builtin.messages import Message
from sitl.builtin.params import Notice

if TYPE_CHECKING:
    from sitl.builtin.autopilot import Autopilot
    from sitl.builtin.links import Link

FORCE = 21196.0
"""Magic number of a forced arming or disarming."""

ACCEPTED = int(mav.MAV_RESULT_ACCEPTED)
DENIED = int(mav.MAV_RESULT_DENIED)
FAILED = int(mav.MAV_RESULT_FAILED)
UNSUPPORTED = int(mav.MAV_RESULT_UNSUPPORTED)


@dataclass(frozen=True, slots=True)
class Command:
    """COMMAND_LONG or COMMAND_INT: number, first four parameters, seventh."""

    number: int
    p1: float
    p2: float
    p3: float
    p7: float


def receive(autopilot: Autopilot, link: Link, message: Message) -> None:
    """Takes one message from a link."""
    handler = HANDLERS.get(message.get_type())
    if handler is None:
        return
    target = getattr(message, "target_system", 0)
    if target not in (0, int(autopilot.parameters["MAV_SYSID"])):
        return
    handler(autopilot, link, message)


def _param_set(autopilot: Autopilot, link: Link, message: Message) -> None:
    answers = autopilot.parameters.set(autopilot.now, _name(message), message.param_value)
    for answer in answers:
        autopilot.say(answer, link)


def _param_request_read(autopilot: Autopilot, link: Link, message: Message) -> None:
    value = autopilot.parameters.read(_name(message), message.param_index)
    if value is not None:
        autopilot.say(value, link)


def _param_request_list(autopilot: Autopilot, link: Link, message: Message) -> None:
    del message
    name = "ArduPlane" if autopilot.vehicle == "plane" else "ArduCopter"
    autopilot.say(Notice(f"{name} V4.7.0-dev (built-in simulation)", 6))
    autopilot.links.request_parameters(link)


def _request_data_stream(autopilot: Autopilot, link: Link, message: Message) -> None:
    """Sets the rate of one stream (or of all: number 0), and saves it, as ArduPilot does."""
    rate = message.req_message_rate if message.start_stop else 0
    if message.req_stream_id == 0:
        wanted = list(streams.STREAM_IDS.values())
    elif message.req_stream_id in streams.STREAM_IDS:
        wanted = [streams.STREAM_IDS[message.req_stream_id]]
    else:
        return
    for stream in wanted:
        autopilot.parameters.set(autopilot.now, f"MAV1_{stream}", rate)
        for name in streams.STREAMS[stream]:
            autopilot.links.set_rate(link, name, rate)


def _timesync(autopilot: Autopilot, link: Link, message: Message) -> None:
    if message.tc1 == 0:
        now_ns = int(autopilot.now * 1e9)
        autopilot.links.send(link, mav.MAVLink_timesync_message(now_ns, message.ts1))


def _set_mode(autopilot: Autopilot, link: Link, message: Message) -> None:
    del link
    autopilot.control.set_mode(message.custom_mode)


def _mission_request_list(autopilot: Autopilot, link: Link, message: Message) -> None:
    del autopilot
    count = mav.MAVLink_mission_count_message(
        message.get_srcSystem(), message.get_srcComponent(), 0
    )
    link.outbox.append((link.outbox[-1][0] if link.outbox else 0.0, count))


def _command_long(autopilot: Autopilot, link: Link, message: Message) -> None:
    m = message
    _command(autopilot, link, m, Command(m.command, m.param1, m.param2, m.param3, m.param7))


def _command_int(autopilot: Autopilot, link: Link, message: Message) -> None:
    m = message
    _command(autopilot, link, m, Command(m.command, m.param1, m.param2, m.param3, m.z))


def _command(autopilot: Autopilot, link: Link, message: Message, command: Command) -> None:
    handler = COMMANDS.get(command.number)
    result = UNSUPPORTED if handler is None else handler(autopilot, link, command)
    autopilot.links.send(
        link,
        mav.MAVLink_command_ack_message(
            command.number, result, 0, 0, message.get_srcSystem(), message.get_srcComponent()
        ),
    )


def _set_message_interval(autopilot: Autopilot, link: Link, command: Command) -> int:
    name = messages.IDS.get(int(command.p1))
    if name is None or command.p3 != 0.0 or not math.isfinite(command.p2):
        return DENIED
    microseconds = int(command.p2)
    if microseconds < -1:
        return DENIED
    if microseconds == 0:
        autopilot.links.set_interval(link, name, autopilot.links.default_interval(name))
        return ACCEPTED
    interval = 0 if microseconds == -1 else streams.interval_ms(microseconds)
    if not autopilot.links.set_interval(link, name, interval):
        text = f"Requested rate for message ID {int(command.p1)} too fast"
        autopilot.say(Notice(f"{text}. Increase SCHED_LOOP_RATE"[:50], 6))
        return DENIED
    return ACCEPTED


def _get_message_interval(autopilot: Autopilot, link: Link, command: Command) -> int:
    name = messages.IDS.get(int(command.p1))
    interval_us = 0 if name is None else link.schedule.interval(name) * 1000 or -1
    autopilot.links.send(link, mav.MAVLink_message_interval_message(int(command.p1), interval_us))
    return FAILED if name is None else ACCEPTED


def _request_message(autopilot: Autopilot, link: Link, command: Command) -> int:
    name = messages.IDS.get(int(command.p1))
    if name is None:
        return FAILED
    autopilot.links.send(link, messages.BUILDERS[name](autopilot.instant()))
    return ACCEPTED


def _request_capabilities(autopilot: Autopilot, link: Link, command: Command) -> int:
    """What AUTOPILOT_VERSION was asked for with before there was MAV_CMD_REQUEST_MESSAGE."""
    if command.p1 != 1.0:
        return FAILED
    autopilot.links.send(link, messages.autopilot_version(autopilot.instant()))
    return ACCEPTED


def _arm_disarm(autopilot: Autopilot, link: Link, command: Command) -> int:
    del link
    force = command.p2 == FORCE
    if command.p1 == 1.0:
        return FAILED if autopilot.arm(force=force) else ACCEPTED
    return ACCEPTED if autopilot.control.disarm() else FAILED


def _take_off(autopilot: Autopilot, link: Link, command: Command) -> int:
    del link, command
    return ACCEPTED if autopilot.take_off() else FAILED


def _land(autopilot: Autopilot, link: Link, command: Command) -> int:
    del link, command
    return ACCEPTED if autopilot.control.land() else FAILED


def _do_set_mode(autopilot: Autopilot, link: Link, command: Command) -> int:
    del link
    autopilot.control.set_mode(int(command.p2))
    return ACCEPTED


def _reboot(autopilot: Autopilot, link: Link, command: Command) -> int:
    del link
    if command.p1 not in (1.0, 3.0):
        return UNSUPPORTED
    return ACCEPTED if autopilot.request_reboot() else FAILED


HANDLERS: dict[str, Callable[[Autopilot, Link, Message], None]] = {
    "PARAM_SET": _param_set,
    "PARAM_REQUEST_READ": _param_request_read,
    "PARAM_REQUEST_LIST": _param_request_list,
    "REQUEST_DATA_STREAM": _request_data_stream,
    "TIMESYNC": _timesync,
    "SET_MODE": _set_mode,
    "MISSION_REQUEST_LIST": _mission_request_list,
    "COMMAND_LONG": _command_long,
    "COMMAND_INT": _command_int,
}

COMMANDS: dict[int, Callable[[Autopilot, Link, Command], int]] = {
    int(mav.MAV_CMD_SET_MESSAGE_INTERVAL): _set_message_interval,
    int(mav.MAV_CMD_GET_MESSAGE_INTERVAL): _get_message_interval,
    int(mav.MAV_CMD_REQUEST_MESSAGE): _request_message,
    int(mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES): _request_capabilities,
    int(mav.MAV_CMD_COMPONENT_ARM_DISARM): _arm_disarm,
    int(mav.MAV_CMD_NAV_TAKEOFF): _take_off,
    int(mav.MAV_CMD_NAV_LAND): _land,
    int(mav.MAV_CMD_NAV_RETURN_TO_LAUNCH): _land,
    int(mav.MAV_CMD_DO_SET_MODE): _do_set_mode,
    int(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN): _reboot,
}


def _name(message: Message) -> str:
    """Parameter name of a message parsed by pymavlink, str, or of one made here, bytes."""
    name = message.param_id
    return name.decode("ascii", "replace") if isinstance(name, bytes) else str(name)
