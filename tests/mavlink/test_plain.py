"""Messages of numbers, read in one step, against pymavlink's reading of the same packets."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.mavlink import framing, plain
from onboard.mavlink.codec import Codec
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import MESSAGE_IDS, mavlink
from tests.mavlink.mavlink_peer import attitude, received

PLAIN = sorted(number for number in mavlink.mavlink_map if plain.layout(number))


def packet(number: int, payload: bytes, *, first: bool, flags: int = 0) -> bytes:
    """A frame with any payload, also one that no sender would make."""
    if first:
        body = bytes((len(payload), 7, 3, 9, number)) + payload
    else:
        body = bytes((len(payload), flags, 0, 7, 3, 9)) + number.to_bytes(3, "little") + payload
    extra = bytes((mavlink.mavlink_map[number].crc_extra,))
    crc = mavlink.x25crc(body + extra).crc.to_bytes(2, "little")
    return (b"\xfe" if first else b"\xfd") + body + crc + bytes(13 if flags else 0)


@given(st.data())
def test_a_plain_message_says_what_pymavlink_reads(data):
    """Whatever the bits are (no number, too), with less than the whole payload, and with more."""
    first = data.draw(st.booleans())
    number = data.draw(st.sampled_from([n for n in PLAIN if n < 256] if first else PLAIN))
    size = plain.layout(number).size
    payload = data.draw(st.binary(max_size=size if first else min(255, size + 9)))
    flags = 0 if first else data.draw(st.sampled_from((0, 1)))
    raw = packet(number, payload, first=first, flags=flags)
    (frame,) = Codec().feed(raw)
    oracle = mavlink.MAVLink(None).decode(bytearray(raw))
    assert isinstance(frame.message, plain.PlainMessage)
    assert repr(frame.message.to_dict()) == repr(oracle.to_dict())
    for ask in ("get_msgId", "get_type", "get_srcSystem", "get_srcComponent"):
        assert getattr(frame.message, ask)() == getattr(oracle, ask)()
    assert (frame.system, frame.component) == (3, 9)


def test_what_comes_by_the_hundred_is_plain_and_text_is_not():
    assert {MESSAGE_IDS[n] for n in ("RAW_IMU", "ATTITUDE", "GPS_RAW_INT", "HEARTBEAT")} <= set(
        PLAIN
    )
    for name in ("STATUSTEXT", "PARAM_VALUE", "BATTERY_STATUS", "AUTOPILOT_VERSION"):
        assert plain.layout(MESSAGE_IDS[name]) is None
    assert plain.layout(16_000_000) is None  # the dialect has none


def test_a_message_that_was_received_cannot_be_changed():
    message = received(attitude(1000))
    with pytest.raises(AttributeError):
        message.roll = 1.0
    assert Decoder(1, 1).decode(message)[0].roll == message.roll == 0.125


@given(st.binary(max_size=300))
def test_the_checksum_is_pymavlinks(data):
    assert framing.checksum(data) == mavlink.x25crc(data).crc
