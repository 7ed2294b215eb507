"""Who floods a socket is in nobody's way but its own."""

import gc
import os
import socket

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.errors import UnavailableError
from onboard.mavlink import limits
from onboard.mavlink.endpoint import Endpoint
from onboard.mavlink.transport import line_of_its_own, open_transport
from onboard.mavlink.waiting import Waiting
from tests.mavlink.test_hostile_bytes import Turns

VEHICLE = ("10.0.0.1", 14550)


def address(number):
    return ("10.0.0.2", number)


def is_vehicle(source):
    return source == VEHICLE


@given(
    st.lists(st.tuples(st.integers(0, 5), st.binary(min_size=1, max_size=40)), max_size=60),
    st.integers(1, 50),
)
def test_every_senders_bytes_come_whole_and_in_their_order(datagrams, size):
    waiting, sent, handed = Waiting(), {}, {}
    for source, data in datagrams:
        waiting.put(address(source), memoryview(data))
        sent[address(source)] = sent.get(address(source), b"") + data
    while turn := waiting.take(size):
        assert 0 < len(turn[1]) <= size
        handed[turn[0]] = handed.get(turn[0], b"") + turn[1]
    assert handed == sent
    assert not waiting


def test_senders_are_served_in_turn_and_the_vehicle_before_them():
    waiting = Waiting(is_vehicle)
    for _ in range(3):
        for source in (address(1), address(2), VEHICLE):
            waiting.put(source, memoryview(b"0123456789"))
    order = [waiting.take(10)[0] for _ in range(9)]
    assert order == [VEHICLE] * 3 + [address(1), address(2)] * 3
    assert waiting.take(10) is None


def test_a_flood_is_cut_at_its_own_queue_and_crowds_at_their_number():
    waiting = Waiting(is_vehicle)
    for _ in range(1000):
        waiting.put(address(0), memoryview(b"x" * 1000))
    for number in range(1, 5000):
        waiting.put(address(number), memoryview(b"x"))
    assert waiting.refused == 1000 - limits.WAITING_BYTES // 1000 + 5000 - limits.SENDERS_WAITING
    held = sum(len(q) for q in waiting._others.values())
    assert held <= limits.WAITING_BYTES + limits.SENDERS_WAITING
    waiting.put(VEHICLE, memoryview(b"alive"))
    assert waiting.take(100) == (VEHICLE, b"alive")


def test_an_empty_datagram_waits_for_nothing():
    waiting = Waiting()
    waiting.put(VEHICLE, memoryview(b""))
    assert waiting.take(10) is None


def udp():
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind(("127.0.0.1", 0))
    sock.settimeout(5.0)
    return sock


def drained(sock):
    sock.setblocking(False)
    found = []
    while True:
        try:
            found.append(sock.recv(100))
        except BlockingIOError:
            return found


def test_what_others_send_takes_no_room_from_the_one_with_a_line_of_its_own():
    with udp() as port, udp() as vehicle, udp() as flood:
        port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        with line_of_its_own(port, vehicle.getsockname()) as line:
            for _ in range(2000):
                flood.sendto(b"flood", port.getsockname())
            vehicle.sendto(b"alive", port.getsockname())
            assert drained(line) == [b"alive"]
            assert set(drained(port)) == {b"flood"}


def test_where_it_cannot_be_had_no_socket_stays_behind():
    before = len(os.listdir("/proc/self/fd"))
    with udp() as port:
        assert line_of_its_own(port, ("255.255.255.255", 9)) is None  # broadcast is not allowed
    assert len(os.listdir("/proc/self/fd")) == before
    gc.collect()  # one that was only forgotten is told by a warning


@pytest.mark.parametrize("option", [0, socket.SO_REUSEADDR, socket.SO_REUSEPORT])
def test_the_port_is_still_nobody_elses(option):
    with (
        udp() as port,
        udp() as vehicle,
        line_of_its_own(port, vehicle.getsockname()),
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
    ):
        if option:
            other.setsockopt(socket.SOL_SOCKET, option, 1)
        with pytest.raises(OSError, match="in use"):
            other.bind(port.getsockname())


async def test_a_transport_keeps_the_vehicles_bytes_in_a_flood_and_lets_go_of_both_sockets():
    with udp() as vehicle, udp() as flood:
        turns = Turns()
        heard = {}

        def receive(data, source):
            heard[source] = heard.get(source, b"") + data
            turns.receive(data, source)

        first = vehicle.getsockname()
        transport = await open_transport(
            Endpoint.parse("udpin:127.0.0.1:0"), receive, turns.lost, linger=0.0,
            first=lambda source: source == first,
        )  # fmt: skip
        to = ("127.0.0.1", transport.port)
        vehicle.sendto(b"0", to)
        await turns.until(1)
        assert transport._line is not None
        sent = b"0"
        for number in range(1, 200):
            for _ in range(100):
                flood.sendto(b"\xfd" * 21, to)
            vehicle.sendto(b"%d" % number, to)
            sent += b"%d" % number
        while len(heard[first]) < len(sent):
            await turns.until(sum(turns.sizes) + 1)
        assert heard[first] == sent
        with pytest.raises(UnavailableError):
            await open_transport(Endpoint.parse(f"udpin:127.0.0.1:{to[1]}"), receive, turns.lost)
        transport.close()
        again = await open_transport(
            Endpoint.parse(f"udpin:127.0.0.1:{to[1]}"), receive, turns.lost
        )
        again.close()
