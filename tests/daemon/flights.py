"""A built-in vehicle that flies by itself on a port of this machine, and what to look at in it."""

import asyncio
import socket
from contextlib import asynccontextmanager

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.core.maths.accelerometer import parameter_names
from sitl.builtin.autopilot import Autopilot
from sitl.builtin.mission import Mission
from sitl.builtin.server import Server
from sitl.builtin.truth import GpsTruth, ImuTruth, Truth

SPEEDUP = 20.0
GROUND_S = 20.0
TRUE_SCALE = np.array([1.02, 0.985, 1.015])
TRUE_OFFSET = np.array([0.2, -0.15, 0.3])
TRUE_SIX = np.concatenate([TRUE_SCALE, TRUE_OFFSET])
IMU = ImuTruth(scale=tuple(TRUE_SCALE), offset=tuple(TRUE_OFFSET))


@asynccontextmanager
async def flying(
    port, *, flights=1, flight_s=120.0, antenna=(0.0, 0.0, 0.0), effects=(), speedup=SPEEDUP
):
    """A copter that flies by itself, at many times the pace of real life.

    ``antenna`` is where the GPS antenna really is, ``effects`` what else is; nobody is told.
    """
    truth = Truth(imus=(IMU,), gps=GpsTruth(antenna=antenna), effects=effects, seed=5)
    autopilot = Autopilot("copter", truth)
    mission = Mission(flights=flights, duration=flight_s, ground=GROUND_S)
    server = Server(autopilot, speedup=speedup, driver=mission)
    await server.connect_udp("127.0.0.1", port)
    station = await server.listen_udp()
    task = asyncio.create_task(server.run())
    try:
        yield autopilot, mission, station
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


class GroundStation:
    """Somebody else on another link to the same autopilot."""

    def __init__(self, port):
        self._packer = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
        self._parser = mavlink.MAVLink(None)
        self._parser.robust_parsing = True
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(("127.0.0.1", port))
        self._socket.setblocking(False)

    def close(self):
        self._socket.close()

    def set(self, name, value):
        self._send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, 9))

    async def read(self, component, name):
        """The value that a component gives to a parameter, asked for until it comes."""
        ask = mavlink.MAVLink_param_request_read_message(1, component, name.encode(), -1)
        while True:
            self._send(ask)
            for message in self._heard():
                if (
                    message.get_type() == "PARAM_VALUE"
                    and message.get_srcComponent() == component
                    and message.param_id == name
                ):
                    return message.param_value
            await asyncio.sleep(0.1)

    def _heard(self):
        while True:
            try:
                data = self._socket.recv(4096)
            except BlockingIOError:
                return
            yield from self._parser.parse_buffer(data) or []

    def _send(self, message):
        self._socket.send(message.pack(self._packer))


def six(autopilot):
    """The six parameters of the first accelerometer."""
    return np.array([autopilot.parameters[name] for name in parameter_names(1).six])


def level_error(numbers, true=TRUE_SIX):
    """Error of the force, m/s^2, that six numbers make of a z axis at rest and level."""
    raw = -9.80665 / true[2] + true[5]
    return numbers[2] * (raw - numbers[5]) + 9.80665
