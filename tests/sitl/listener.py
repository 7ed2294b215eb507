"""A minimal client of its own: asks for rates and parameters, keeps every message."""

import asyncio
import contextlib

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

INTERVALS = {27: 20_000, 30: 20_000, 24: 100_000, 245: 500_000, 193: 500_000, 74: 200_000}


class Datagrams(asyncio.DatagramProtocol):
    def __init__(self, listener):
        self._listener = listener

    def datagram_received(self, data, addr):
        self._listener.take(data)


class Listener:
    """``more`` is asked for besides: interval in us by message number."""

    def __init__(self, more=None):
        self.messages = []
        self._intervals = INTERVALS | (more or {})
        self.packer = mav.MAVLink(None, srcSystem=1, srcComponent=191)
        self.parser = mav.MAVLink(None)
        self.parser.robust_parsing = True
        self._send = None

    @contextlib.asynccontextmanager
    async def at(self, endpoint):
        scheme, host, port = endpoint.split(":")
        if scheme == "tcp":
            reader, writer = await asyncio.open_connection(host, int(port))
            self._send = writer.write
            reading = asyncio.create_task(self._read(reader))
            try:
                yield
            finally:
                reading.cancel()
                await asyncio.gather(reading, return_exceptions=True)
                writer.close()
            return
        loop = asyncio.get_running_loop()
        transport, _ = await loop.create_datagram_endpoint(
            lambda: Datagrams(self), remote_addr=(host, int(port))
        )
        self._send = transport.sendto
        try:
            yield
        finally:
            transport.close()

    async def _read(self, reader):
        while data := await reader.read(4096):
            self.take(data)

    def take(self, data):
        self.messages += self.parser.parse_buffer(data) or []

    def send(self, message):
        self._send(message.pack(self.packer))

    async def ask(self):
        self.send(mav.MAVLink_heartbeat_message(18, 8, 0, 0, 0, 3))
        for number, wanted in self._intervals.items():
            for interval in range(wanted, wanted + 20_000, 5000):
                message = (1, 1, 511, 0, number, interval, 0, 0, 0, 0, 0)
                self.send(mav.MAVLink_command_long_message(*message))
                ack = await self.until(lambda m: m.get_type() == "COMMAND_ACK" and m.command == 511)
                if ack.result == mav.MAV_RESULT_ACCEPTED:
                    break
            else:
                pytest.fail(f"no interval of message {number} is accepted")
        self.send(mav.MAVLink_param_request_list_message(1, 1))

    async def until(self, condition):
        seen = len(self.messages)
        async with asyncio.timeout(60):
            while True:
                for message in self.messages[seen:]:
                    if condition(message):
                        return message
                seen = len(self.messages)
                await asyncio.sleep(0.01)
