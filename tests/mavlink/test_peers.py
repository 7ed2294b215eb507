"""Addresses on a listening socket: by merit, with a ration each."""

import pytest

from onboard.mavlink.codec import Codec
from onboard.mavlink.limits import (
    PEER_BYTES_S,
    PEER_LIMIT,
    PEER_SILENCE_S,
    PEERS_KNOWN,
    PROOF_S,
)
from onboard.mavlink.peers import Merit, Peers
from onboard.mavlink.twins import Twins
from tests.mavlink.mavlink_peer import attitude, heartbeat

SENDER = Codec(system=1, component=1)


def table():
    return Peers(Codec, addressed=True)


def test_rubbish_gives_way_to_whoever_speaks_mavlink():
    peers = table()
    for number in range(PEERS_KNOWN):
        peers.feed(("noise", number), b"x", 1.0)
    assert peers.answered(1.0) == []
    _, frames = peers.feed(("vehicle", 1), SENDER.encode(heartbeat()), 2.0)
    assert len(frames) == 1
    assert peers.answered(2.0) == [("vehicle", 1)]
    assert len(list(peers)) == PEERS_KNOWN


@pytest.mark.parametrize("data", [b"x", SENDER.encode(attitude(1))])
def test_who_is_no_better_comes_in_only_when_somebody_has_fallen_silent(data):
    peers = table()
    first = [("first", number) for number in range(PEERS_KNOWN)]
    for address in first:
        peers.feed(address, data, 1.0)
    peers.feed(("late", 1), data, 2.0)
    assert [peer.address for peer in peers] == first
    peers.feed(("late", 1), data, 3.0 + PEER_SILENCE_S)
    assert peers.get(("late", 1)) is not None
    assert len(list(peers)) == PEERS_KNOWN


def test_claims_that_prove_nothing_wear_off():
    """They speak on, every second: it is not their silence that makes room."""
    peers = table()
    beat = SENDER.encode(heartbeat())
    for now in (0.0, 1.0, 2.0):
        for number in range(PEERS_KNOWN):
            peers.feed(("claim", number), beat, now)
    peer, frames = peers.feed(("vehicle", 1), beat, 2.5)
    assert frames == []
    for number in range(PEERS_KNOWN):
        peers.feed(("claim", number), beat, PROOF_S + 0.5)
    peer, frames = peers.feed(("vehicle", 1), beat, PROOF_S + 1.0)
    assert len(frames) == 1
    assert peer.merit is Merit.CLAIMS


def test_a_crowd_that_speaks_and_claims_nothing_makes_room_for_an_autopilot():
    peers = table()
    for number in range(PEERS_KNOWN):
        peers.feed(("crowd", number), SENDER.encode(attitude(1)), 1.0)
    assert peers.feed(("late", 1), SENDER.encode(attitude(1)), 1.5)[1] == []
    assert len(peers.feed(("vehicle", 1), SENDER.encode(heartbeat()), 1.5)[1]) == 1


def test_the_vehicle_never_gives_way():
    peers = table()
    vehicle, _ = peers.feed(("vehicle", 1), SENDER.encode(heartbeat()), 0.0)
    vehicle.rise(Merit.VEHICLE, 0.0)
    for number in range(500):
        peer, _ = peers.feed(("claim", number), SENDER.encode(heartbeat()), 100.0 + number)
        peer.rise(Merit.CLAIMS, 100.0 + number)
    assert peers.get(("vehicle", 1)) is vehicle
    assert ("vehicle", 1) not in peers.answered(599.0)  # silent for ten minutes
    peers.feed(("vehicle", 1), SENDER.encode(heartbeat()), 599.0)
    assert peers.answered(599.0)[0] == ("vehicle", 1)
    assert len(peers.answered(599.0)) <= PEER_LIMIT


def test_a_vehicle_that_moves_to_ever_other_ports_is_let_in():
    """A router that is restarted every few hours for weeks."""
    peers = table()
    beat = SENDER.encode(heartbeat())
    for number in range(3 * PEERS_KNOWN):
        now = 2.0 * PEER_SILENCE_S * number
        peer, frames = peers.feed(("vehicle", number), beat, now)
        assert len(frames) == 1
        peers.believe(peer, now)
        assert peers.is_vehicle(("vehicle", number))
        assert sum(p.merit is Merit.VEHICLE for p in peers) == 1
    assert len(list(peers)) <= PEERS_KNOWN


def test_a_flood_is_rationed_and_the_others_are_not():
    peers = table()
    frame = SENDER.encode(attitude(1))
    looked_at = 0
    for _ in range(50_000):  # in one second
        looked_at += len(peers.feed(("flood", 1), frame, 1.0)[1])
    assert looked_at <= PEER_BYTES_S / len(frame)
    assert peers.refused == 50_000 - looked_at
    assert len(peers.feed(("vehicle", 1), frame, 1.0)[1]) == 1


def test_halves_of_packets_from_two_addresses_are_kept_apart():
    peers = table()
    one, two = SENDER.encode(attitude(1)), SENDER.encode(attitude(2))
    peers.feed(("a", 1), one[:9], 0.0)
    peers.feed(("b", 1), two[:11], 0.0)
    assert peers.feed(("a", 1), one[9:], 0.0)[1][0].message.time_boot_ms == 1
    assert peers.feed(("b", 1), two[11:], 0.0)[1][0].message.time_boot_ms == 2


def test_of_two_services_each_knows_which_was_there_first():
    for gap in (0.0, 2.0, 3.0, 10.0, 1e7):
        first, second = Twins(lambda: 0.0, number=7), Twins(lambda gap=gap: gap, number=9)
        now = gap + 5.0
        a, b = first.signature(now), second.signature(now)
        first.hear(b, now)
        second.hear(a, now)
        assert first.first(now) != second.first(now)
        assert first.first(now) or gap <= 3.0
        assert first.there(now)
        assert not first.there(now + 20.0)
        assert second.first(now + 20.0)
        assert first.hear(a, now) is None  # its own, given back by a router
