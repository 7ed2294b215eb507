"""One layout of a packet: what pymavlink packs, in either version, is found and read back."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.mavlink import framing
from onboard.mavlink.dialect import mavlink


def packed(*, v1: bool, signed: bool = False, seq: int = 7) -> bytes:
    sender = mavlink.MAVLink(None, srcSystem=3, srcComponent=9)
    sender.seq = seq
    if signed:
        sender.signing.secret_key = bytes(range(32))
        sender.signing.link_id = 1
        sender.signing.timestamp = 1
        sender.signing.sign_outgoing = True
    message = mavlink.MAVLink_attitude_message(1234, 0.1, -0.2, 0.3, 0.0, 0.0, 0.5)
    return bytes(message.pack(sender, force_mavlink1=v1))


KINDS = st.sampled_from([(True, False), (False, False), (False, True)])


@given(KINDS, st.integers(0, 255), st.binary(max_size=30).filter(lambda b: not {0xFD, 0xFE} & {*b}))
def test_a_packet_is_found_read_and_verified_wherever_it_stands(kind, seq, noise):
    v1, signed = kind
    packet = packed(v1=v1, signed=signed, seq=seq)
    for data in (noise + packet + noise, bytearray(noise + packet)):
        at = framing.next_valid(data, 0)
        assert at == len(noise)
        assert framing.packet_length(data, at) == len(packet)
        head = framing.header(data, at)
        assert head[:5] == (mavlink.MAVLINK_MSG_ID_ATTITUDE, 3, 9, seq, signed)
        assert data[head.payload : head.payload + 4] == (1234).to_bytes(4, "little")


@given(KINDS, st.data())
def test_no_changed_bit_passes(kind, data):
    v1, signed = kind
    packet = bytearray(packed(v1=v1, signed=signed))
    last = len(packet) - (13 if signed else 0)  # the signature is not under the checksum
    place = data.draw(st.integers(1, last - 1))
    packet[place] ^= 1 << data.draw(st.integers(0, 7))
    length = framing.packet_length(packet, 0)
    whole = 0 < length <= len(packet)
    assert not (whole and framing.is_valid(packet, 0, framing.message_id(packet, 0)))


@pytest.mark.parametrize("v1", [True, False])
def test_a_packet_that_has_not_all_come_is_none(v1):
    packet = packed(v1=v1)
    for length in range(len(packet)):
        assert framing.next_valid(packet[:length], 0) == length


def test_a_flag_that_nobody_knows_makes_it_no_packet():
    packet = bytearray(packed(v1=False))
    packet[2] |= 0x02
    assert framing.packet_length(packet, 0) == 0
