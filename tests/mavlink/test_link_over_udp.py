"""The link once for real, over loopback."""

import asyncio
import socket

from onboard.mavlink.codec import Codec
from onboard.mavlink.endpoint import Endpoint
from onboard.mavlink.link import Link
from tests.mavlink.mavlink_peer import attitude, heartbeat


async def test_over_real_udp():
    found = asyncio.Event()
    heard = []

    def hear(now, message):
        heard.append(message.time_boot_ms)
        if len(heard) == 50:
            found.set()

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.bind(("127.0.0.1", 0))
        vehicle.settimeout(20.0)
        link = Link([Endpoint.parse(f"udpout:127.0.0.1:{vehicle.getsockname()[1]}")])
        link.subscribe(hear, ["ATTITUDE"])
        task = asyncio.create_task(link.run())
        codec = Codec(system=3, component=1)
        ours, address = await asyncio.to_thread(vehicle.recvfrom, 300)
        assert Codec().feed(ours)[0].component == 191
        vehicle.sendto(codec.encode(heartbeat()), address)
        for ms in range(50):
            vehicle.sendto(codec.encode(attitude(ms)), address)
        await link.wait_autopilot(20.0)
        async with asyncio.timeout(20.0):
            await found.wait()
        assert heard == list(range(50))
        link.close()
        await task
