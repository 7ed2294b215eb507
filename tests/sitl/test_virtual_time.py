"""Time that jumps: not past a thread at work, nor past what has come in on a socket."""

import asyncio
import threading

import pytest

from tests.mavlink.virtual_time import virtual_time

HOUR_S = 3600.0
pytestmark = pytest.mark.virtual_time(always=True)


async def test_sleeping_takes_no_time_but_the_loops():
    begun = asyncio.get_running_loop().time()
    await asyncio.sleep(HOUR_S)
    assert asyncio.get_running_loop().time() - begun == pytest.approx(HOUR_S)


async def test_time_does_not_jump_while_a_thread_is_at_work():
    release = threading.Event()
    async with asyncio.timeout(HOUR_S):
        working = asyncio.create_task(asyncio.to_thread(release.wait, 60.0))
        await asyncio.sleep(0.02)
        release.set()
        assert await working
    assert asyncio.get_running_loop().threads == 0


async def test_what_was_sent_comes_before_any_later_timer():
    heard = asyncio.Queue()

    class Ear(asyncio.DatagramProtocol):
        def datagram_received(self, data, _address):
            heard.put_nowait(data)

    loop = asyncio.get_running_loop()
    ear, _ = await loop.create_datagram_endpoint(Ear, local_addr=("127.0.0.1", 0))
    mouth, _ = await loop.create_datagram_endpoint(
        asyncio.DatagramProtocol, remote_addr=ear.get_extra_info("sockname")
    )
    async with asyncio.timeout(HOUR_S):
        for word in (b"one", b"two"):
            mouth.sendto(word)
            assert await heard.get() == word
    mouth.close()
    ear.close()


@pytest.mark.slow
def test_waiting_for_nothing_is_an_error_and_no_hang():
    @virtual_time
    async def forever():
        await asyncio.Event().wait()

    with pytest.raises(RuntimeError, match="nothing will ever happen"):
        forever()
