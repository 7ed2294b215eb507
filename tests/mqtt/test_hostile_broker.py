"""A broker that is somebody else's: what it sends is bounded, whatever it says it is."""

from __future__ import annotations

import asyncio
import struct
from contextlib import asynccontextmanager

from onboard.daemon.mqtt import limits
from tests.mqtt.published import Obedient, snapshot

CONNACK = b"\x20\x02\x00\x00"
PAYLOAD = bytes(limits.PACKET_MAX - 200)
TOPIC = b"onboard/1/command"


def length(count):
    """Of the rest of a packet, seven bits a byte."""
    out = bytearray()
    while True:
        count, digit = divmod(count, 128)
        out.append(digit | (0x80 if count else 0))
        if not count:
            return bytes(out)


def publish(number, quality):
    """A message with that quality of service, which asks for an answer by that number."""
    body = struct.pack(">H", len(TOPIC)) + TOPIC + struct.pack(">H", number) + PAYLOAD
    return bytes((0x30 | quality << 1,)) + length(len(body)) + body


class Hostile:
    """Accepts everybody, and sends as many messages as are taken once somebody listens."""

    def __init__(self, quality, most=20_000):
        self.quality, self.most = quality, most
        self.taken = self.connections = 0

    async def serve(self, reader, writer):
        self.connections += 1
        flood = None
        try:
            while True:
                kind, body = await self._packet(reader)
                if kind >> 4 == 1:
                    writer.write(CONNACK)
                elif kind >> 4 == 3:
                    at = 2 + int.from_bytes(body[:2])
                    writer.write(b"\x40\x02" + body[at : at + 2])
                elif kind >> 4 == 8:
                    writer.write(b"\x90\x03" + body[:2] + b"\x01")
                    flood = asyncio.create_task(self._flood(writer))
                elif kind >> 4 in (4, 5):  # received, and kept until it is released
                    self.taken += 1
        except (asyncio.IncompleteReadError, ConnectionError):
            pass
        finally:
            if flood is not None:
                flood.cancel()
            writer.close()

    async def _packet(self, reader):
        kind = (await reader.readexactly(1))[0]
        count = shift = 0
        while True:
            digit = (await reader.readexactly(1))[0]
            count |= (digit & 0x7F) << shift
            shift += 7
            if not digit & 0x80:
                return kind, await reader.readexactly(count)

    async def _flood(self, writer):
        for number in range(self.most):
            writer.write(publish(number % 65535 + 1, self.quality))
            await writer.drain()


@asynccontextmanager
async def hostile(quality):
    broker = Hostile(quality)
    server = await asyncio.start_server(broker.serve, "127.0.0.1", 0)
    async with server:
        yield broker, server.sockets[0].getsockname()[1]


async def test_messages_that_are_never_released_are_not_collected(publishing):
    """Of quality 2 a receiver keeps each until the broker releases it: 65,535 of 16 kB."""
    async with hostile(2) as (broker, port), publishing(port, commands=True) as publisher:
        publisher.publish(snapshot())
        async with asyncio.timeout(60.0):
            while broker.connections < 2 and broker.taken < 1000:
                await asyncio.sleep(0.05)
        assert broker.taken < 2 * limits.COMMANDS_WAITING + 2
        assert publisher.counters["mqtt_failures"] >= 1


async def test_a_flood_of_commands_leaves_the_loop_its_turns(publishing):
    """One packet a turn: what else is due comes between any two of them."""
    actions = Obedient()
    async with (
        hostile(1) as (broker, port),
        publishing(port, commands=True, actions=actions) as publisher,
    ):
        publisher.publish(snapshot())
        turns = 0
        async with asyncio.timeout(60.0):
            while broker.taken < 500:
                turns += 1
                await asyncio.sleep(0)
        assert turns > 250
        assert actions.asked == []  # zeros are no command
