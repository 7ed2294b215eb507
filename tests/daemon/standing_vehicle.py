"""A vehicle that stands still: ArduPilot's heartbeat, streams and parameters over UDP.

It flies nothing and knows no physics; it is for the daemon's life, not for its estimates.
"""

import asyncio
import struct

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.pushing.parameters import MEANING
from onboard.push.limits import ARMING_THRESHOLD
from onboard.push.policy import ARMING_THRESHOLD_NAME

ARDUPILOT, PX4 = 3, 12


def float32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def ardupilot_parameters(imus=(1, 2, 3)):
    parameters = dict.fromkeys(MEANING, 0.0) | {ARMING_THRESHOLD_NAME: ARMING_THRESHOLD}
    for imu in imus:
        names = parameter_names(imu)
        parameters |= dict.fromkeys(names.scale, 1.0)
        parameters |= {name: float32(0.05 + 0.01 * i) for i, name in enumerate(names.offset)}
        parameters[names.device_id] = 2_700_000.0 + imu
    return parameters


class Vehicle(asyncio.DatagramProtocol):
    """Speaks to one UDP address; attributes may be changed at any time."""

    def __init__(self, port, *, firmware=ARDUPILOT, system=1, parameters=None, rate=20.0):
        self.parameters = ardupilot_parameters() if parameters is None else parameters
        self.armed = False
        self.landed = True
        self.board = "0a0b0c" + 30 * "0"
        self.boot_ms = 60_000.0
        self.sets = []
        self.heard = []
        self.mute_after_sets = None
        self.when_set = {}
        """What happens, at once, when it has taken so many writes."""
        self.denied = set()
        self.intervals_us = {}
        """What was asked for last, by message."""
        self._address = ("127.0.0.1", port)
        self._firmware = firmware
        self._period = 1.0 / rate
        self._mav = mavlink.MAVLink(None, srcSystem=system, srcComponent=1)
        self._parser = mavlink.MAVLink(None)
        self._parser.robust_parsing = True
        self._transport = None
        self._task = None
        self._silent_since = None

    async def __aenter__(self):
        loop = asyncio.get_running_loop()
        self._transport, _ = await loop.create_datagram_endpoint(
            lambda: self, local_addr=("127.0.0.1", 0)
        )
        self._task = asyncio.create_task(self._stream(), name="vehicle")
        return self

    async def __aexit__(self, *_):
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)
        self._transport.close()

    def stop_talking(self):
        self._task.cancel()
        self._silent_since = asyncio.get_running_loop().time()

    def talk_again(self):
        """Its clock has gone on meanwhile."""
        loop = asyncio.get_running_loop()
        self.boot_ms += 1e3 * (loop.time() - self._silent_since)
        self._task = loop.create_task(self._stream(), name="vehicle")

    def rename(self, system):
        """Somebody sets MAV_SYSID: that takes effect at once."""
        self._mav.srcSystem = system

    def reboot(self):
        self.boot_ms = 1000.0
        self.armed = False

    def set_by_other(self, name, value):
        """Another ground station writes: everybody hears of it."""
        self.parameters[name] = float32(value)
        self._tell(name)

    def send(self, message):
        self._transport.sendto(message.pack(self._mav), self._address)

    async def _stream(self):
        tick = 0
        while True:
            self.boot_ms += 1e3 * self._period
            ms = int(self.boot_ms)
            if tick % round(1.0 / self._period) == 0:
                mode = 128 if self.armed else 0
                self.send(mavlink.MAVLink_heartbeat_message(2, self._firmware, mode, 0, 4, 3))
                landed = 1 if self.landed else 2
                self.send(mavlink.MAVLink_extended_sys_state_message(0, landed))
            self.send(mavlink.MAVLink_raw_imu_message(ms * 1000, 0, 0, -1000, 0, 0, 0, 0, 0, 0))
            self.send(mavlink.MAVLink_attitude_message(ms, 0, 0, 0, 0, 0, 0))
            tick += 1
            await asyncio.sleep(self._period)

    def datagram_received(self, data, _address):
        for message in self._parser.parse_buffer(data) or ():
            kind = message.get_type()
            self.heard.append(kind)
            if kind == "PARAM_REQUEST_READ" and message.param_id in self.parameters:
                self._tell(message.param_id)
            elif kind == "PARAM_SET":
                self._set(message)
            elif kind == "COMMAND_LONG":
                self.send(mavlink.MAVLink_command_ack_message(message.command, 0))
                if message.command == 511:
                    self.intervals_us[int(message.param1)] = message.param2
                if message.command == 512 and message.param1 == 148:
                    self._introduce()

    def _introduce(self):
        uid2 = list(bytes.fromhex(self.board).ljust(18, b"\0"))
        eight = [0] * 8
        self.send(
            mavlink.MAVLink_autopilot_version_message(
                0, 0, 0, 0, 0, eight, eight, eight, 0, 0, 0, uid2
            )
        )

    def _set(self, message):
        if self.mute_after_sets is not None and len(self.sets) >= self.mute_after_sets:
            return
        self.sets.append((message.param_id, message.param_value))
        self.when_set.pop(len(self.sets), lambda: None)()
        if message.param_id not in self.denied and message.param_id in self.parameters:
            self.parameters[message.param_id] = message.param_value
        self._tell(message.param_id)

    def _tell(self, name):
        if name in self.parameters:
            self.send(
                mavlink.MAVLink_param_value_message(
                    name.encode(), self.parameters[name], 9, len(self.parameters), 65535
                )
            )
