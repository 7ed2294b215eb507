"""The autopilot on real sockets: what a client sends and gets."""

import asyncio
import contextlib
import itertools

import pytest
from click.testing import CliRunner
from pymavlink.dialects.v20 import ardupilotmega as mav

from onboard.cli.sim import parse_address, parse_truth, sim
from onboard.errors import UsageError
from sitl.builtin.autopilot import Autopilot
from sitl.builtin.impairment import Impairment
from sitl.builtin.mission import Mission
from sitl.builtin.server import Server
from sitl.builtin.truth import Truth, random_imus
from sitl.station import Station

pytestmark = pytest.mark.virtual_time


class Client(asyncio.DatagramProtocol):
    """A ground station: UDP, counts what comes."""

    def __init__(self):
        self.parser = mav.MAVLink(None)
        self.parser.robust_parsing = True
        self.packer = mav.MAVLink(None, srcSystem=255, srcComponent=190)
        self.messages = []
        self.transport = None
        self.news = asyncio.Event()

    def connection_made(self, transport):
        self.transport = transport

    def datagram_received(self, data, addr):
        self.messages += self.parser.parse_buffer(data) or []
        self.news.set()

    def send(self, message, address=None):
        self.transport.sendto(message.pack(self.packer), address)

    async def until(self, condition):
        while not (found := [m for m in self.messages if condition(m)]):
            self.news.clear()
            await self.news.wait()
        return found[-1]


@contextlib.asynccontextmanager
async def running(server):
    task = asyncio.create_task(server.run())
    try:
        yield
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


async def udp_client(port):
    loop = asyncio.get_running_loop()
    transport, client = await loop.create_datagram_endpoint(Client, remote_addr=("127.0.0.1", port))
    return transport, client


def heartbeat():
    return mav.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)


async def test_two_udp_clients_and_a_broadcast():
    server = Server(Autopilot("copter", Truth()), speedup=10.0)
    port = await server.listen_udp()
    async with running(server):
        peers = [await udp_client(port) for _ in range(2)]
        for _, client in peers:
            client.send(heartbeat())
            await client.until(lambda m: m.get_type() == "HEARTBEAT")
        peers[0][1].send(mav.MAVLink_param_set_message(1, 1, b"INS_ACCOFFS_X", 0.25, 9))
        for transport, client in peers:
            saved = await client.until(lambda m: m.get_type() == "PARAM_VALUE")
            assert (saved.param_id, saved.param_value) == ("INS_ACCOFFS_X", 0.25)
            transport.close()


async def test_a_companion_and_a_ground_station_hear_each_other_through_the_autopilot():
    server = Server(Autopilot("copter", Truth()), speedup=10.0)
    port = await server.listen_udp()
    async with running(server):
        peers = [await udp_client(port) for _ in range(2)]
        ground, companion = (client for _, client in peers)
        companion.packer = mav.MAVLink(None, srcSystem=1, srcComponent=191)
        for client in (ground, companion):
            client.send(heartbeat())
            await client.until(lambda m: m.get_type() == "HEARTBEAT")
        # For the companion alone: the autopilot's own parameters stay untouched and untold.
        ground.send(mav.MAVLink_param_set_message(1, 191, b"INS_ACCOFFS_X", 0.25, 9))
        heard = await companion.until(lambda m: m.get_type() == "PARAM_SET")
        assert (heard.get_srcSystem(), heard.target_component) == (255, 191)
        companion.send(mav.MAVLink_param_value_message(b"OBC_PUSH", 1.0, 9, 1, 0))
        await ground.until(lambda m: m.get_type() == "PARAM_VALUE")
        companion.send(heartbeat())
        await ground.until(lambda m: m.get_type() == "HEARTBEAT" and m.get_srcComponent() == 191)
        # For the autopilot alone: nobody else gets it.
        ground.send(mav.MAVLink_param_set_message(1, 1, b"INS_ACCOFFS_Y", 0.5, 9))
        await companion.until(
            lambda m: m.get_type() == "PARAM_VALUE" and m.param_id == "INS_ACCOFFS_Y"
        )
        assert sum(m.get_type() == "PARAM_SET" for m in companion.messages) == 1
        assert server.autopilot.parameters["INS_ACCOFFS_X"] != 0.25
        values = [m for m in ground.messages if m.get_type() == "PARAM_VALUE"]
        assert {m.param_id for m in values} <= {"OBC_PUSH", "INS_ACCOFFS_Y"}
        for transport, _ in peers:
            transport.close()


async def test_sends_unasked_to_a_listening_ground_station():
    loop = asyncio.get_running_loop()
    transport, client = await loop.create_datagram_endpoint(Client, local_addr=("127.0.0.1", 0))
    server = Server(Autopilot("plane", Truth()), speedup=10.0)
    await server.connect_udp("127.0.0.1", transport.get_extra_info("sockname")[1])
    async with running(server):
        beat = await client.until(lambda m: m.get_type() == "HEARTBEAT")
    assert beat.type == mav.MAV_TYPE_FIXED_WING
    transport.close()


async def test_tcp_client_comes_and_goes():
    server = Server(Autopilot("copter", Truth()), speedup=10.0)
    port = await server.listen_tcp()
    async with running(server):
        for _ in range(2):
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            parser = mav.MAVLink(None)
            messages = []
            while not any(m.get_type() == "ATTITUDE" for m in messages):
                messages += parser.parse_buffer(await reader.read(2048)) or []
            writer.close()
            await writer.wait_closed()


async def test_bad_link_loses_and_doubles():
    server = Server(
        Autopilot("copter", Truth()),
        speedup=20.0,
        impairment=Impairment(loss=0.3, duplication=0.3, jitter=0.01, seed=1),
    )
    port = await server.listen_udp()
    async with running(server):
        transport, client = await udp_client(port)
        client.send(heartbeat())
        client.send(heartbeat())
        client.send(heartbeat())
        await client.until(lambda m: m.get_type() == "HEARTBEAT" and len(client.messages) > 300)
        transport.close()
    sequence = [m.get_seq() for m in client.messages]
    assert len(set(zip(sequence, map(str, client.messages), strict=True))) < len(sequence)
    steps = [(b - a) % 256 for a, b in itertools.pairwise(sequence)]
    assert any(step not in (0, 1) for step in steps)


def test_fates_are_reproducible_and_as_frequent_as_asked():
    fates = [Impairment(loss=0.2, duplication=0.1, seed=3).fates() for _ in range(1)]
    assert fates == [Impairment(loss=0.2, duplication=0.1, seed=3).fates()]
    bad = Impairment(loss=0.2, duplication=0.1, delay=0.1, jitter=0.05)
    drawn = [bad.fates() for _ in range(4000)]
    assert sum(not f for f in drawn) / 4000 == pytest.approx(0.2, abs=0.03)
    assert sum(len(f) == 2 for f in drawn) / 4000 == pytest.approx(0.08, abs=0.02)
    assert all(0.1 <= d <= 0.15 for f in drawn for d in f)


@pytest.mark.slow
def test_mission_flies_its_flights_and_no_more():
    autopilot = Autopilot("copter", Truth(imus=random_imus(1, 2), seed=1))
    mission = Mission(flights=2, duration=60.0, ground=5.0)
    armed = []
    for _ in range(1000):
        mission.step(autopilot)
        autopilot.advance(0.2)
        armed.append(autopilot.armed)
    assert sum(b and not a for a, b in itertools.pairwise(armed)) == 2
    assert not armed[-1]


@pytest.mark.parametrize("text", ["", "1,2", "1,1,1,0,0,x", "0,1,1,0,0,0", "1,1,1,0,0,0,0"])
def test_bad_truth_is_refused(text):
    with pytest.raises(UsageError, match="six numbers"):
        parse_truth(text)


@pytest.mark.parametrize("text", ["", "host", "host:", "host:x", ":14550", "host:70000"])
def test_bad_address_is_refused(text):
    with pytest.raises(UsageError, match="HOST:PORT"):
        parse_address(text)


async def test_port_in_use_is_one_clear_line():
    taken = await asyncio.start_server(lambda r, w: None, "127.0.0.1", 0)
    port = taken.sockets[0].getsockname()[1]
    result = await asyncio.to_thread(CliRunner().invoke, sim, ["--port", str(port), "--seed", "2"])
    assert isinstance(result.exception, UsageError)
    assert str(port) in str(result.exception)
    taken.close()
    await taken.wait_closed()


async def test_pace_is_a_parameter_that_any_client_may_change():
    server = Server(Autopilot("copter", Truth()), speedup=10.0)
    port = await server.listen_udp()
    async with running(server), Station.at("127.0.0.1", port) as station:
        station.set_pace(3.0)
        while server.speedup != 3.0:
            station.set_pace(3.0)
            await asyncio.sleep(0.02)


@pytest.mark.slow
async def test_station_flies_on_command_and_impatience_does_no_harm():
    server = Server(Autopilot("copter", Truth(imus=random_imus(1), seed=1)), speedup=50.0)
    port = await server.listen_udp()
    async with running(server), Station.at("127.0.0.1", port) as station:
        await station.take_off()
        await station.until_time(station.time + 40.0)
        await asyncio.gather(*(station.land() for _ in range(5)))
        await station.until_disarmed()
    assert server.autopilot.instant().landed


@pytest.mark.slow
async def test_a_flight_on_command_lasts_as_long_as_it_may():
    autopilot = Autopilot("copter", Truth(imus=random_imus(1), seed=1), longest=90.0)
    server = Server(autopilot, speedup=50.0)
    port = await server.listen_udp()
    async with running(server), Station.at("127.0.0.1", port) as station:
        await station.take_off()
        begun = station.time
        await station.until_time(begun + 20.0)
        assert station.armed
        await station.until_disarmed()
    assert 45.0 < station.time - begun < 120.0
