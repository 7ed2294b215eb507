from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common, development

from onboard.mavlink.codec import Codec, SourceStatistics
from onboard.mavlink.dialect import mavlink, message_ids
from onboard.mavlink.signing import EPOCH_UNIX_S, Signing
from tests.mavlink.mavlink_peer import attitude, heartbeat, raw_imu

NOW = EPOCH_UNIX_S + 3e8
KEY = bytes(range(32))


def messages():
    return st.one_of(
        st.integers(0, 2**32 - 1).map(attitude),
        st.integers(0, 2**63).map(raw_imu),
        st.integers(0, 255).map(lambda mode: heartbeat(base_mode=mode)),
        st.text("ABC_", min_size=1, max_size=16).map(
            lambda name: mavlink.MAVLink_param_value_message(name.encode(), 1.5, 9, 10, 3)
        ),
    )


def cut(data: bytes, places: list[int]) -> list[bytes]:
    edges = sorted({0, len(data), *(place % (len(data) + 1) for place in places)})
    return [data[a:b] for a, b in itertools.pairwise(edges)]


@given(st.lists(messages(), min_size=1, max_size=20), st.lists(st.integers(0, 10**4), max_size=30))
def test_every_frame_comes_back_however_the_bytes_are_cut(sent, places):
    sender, receiver = Codec(system=3, component=1), Codec()
    wire = [sender.encode(message) for message in sent]
    frames = [frame for part in cut(b"".join(wire), places) for frame in receiver.feed(part)]
    assert [frame.raw for frame in frames] == wire
    assert [f.message.to_dict() for f in frames] == [m.to_dict() for m in sent]
    assert {(f.system, f.component) for f in frames} == {(3, 1)}
    assert receiver.statistics.bad_bytes == 0
    assert receiver.statistics.sources[3, 1].lost == 0


# Garbage that is full of frame starts, which is what a parser fears.
garbage = st.lists(
    st.one_of(st.binary(max_size=40), st.binary(max_size=6).map(lambda b: b"\xfd" + b)), max_size=4
).map(b"".join)


@pytest.mark.slow
@settings(max_examples=300)
@given(st.lists(st.tuples(garbage, messages()), min_size=1, max_size=10))
def test_garbage_between_frames_costs_no_frame(parts):
    sender, receiver = Codec(system=3, component=1), Codec()
    wire, stream = [], b""
    for noise, message in parts:
        frame = sender.encode(message)
        wire.append(frame)
        stream += noise + frame
    # Zeros enough to end the longest frame that garbage may have announced.
    got = [f.raw for f in receiver.feed(stream + bytes(300))]
    assert [raw for raw in got if raw in wire] == wire


@given(st.binary(max_size=2000))
def test_no_bytes_whatever_raise_and_all_are_accounted_for(data):
    receiver = Codec()
    frames = receiver.feed(data)
    waiting = len(data) - receiver.statistics.bad_bytes - sum(len(f.raw) for f in frames)
    assert 0 <= waiting <= 280


@given(messages(), st.integers(0, 10**6), st.integers(1, 255))
def test_a_corrupted_frame_never_becomes_a_message(message, place, flip):
    """CRC-16 finds every error burst of up to 16 bits."""
    wire = bytearray(Codec(system=3, component=1).encode(message))
    wire[place % len(wire)] ^= flip
    frames = Codec().feed(bytes(wire) + bytes(300))
    assert all(f.message is None for f in frames)


def test_frames_after_a_lost_byte_are_not_lost_with_it():
    sender, receiver = Codec(system=3, component=1), Codec()
    wire = [sender.encode(attitude(i)) for i in range(20)]
    stream = wire[0] + wire[1][:7] + wire[1][8:] + b"".join(wire[2:])
    assert len(receiver.feed(stream)) == 19
    assert receiver.statistics.bad_bytes == len(wire[1]) - 1
    assert receiver.statistics.sources[3, 1].lost == 1


def test_unwanted_messages_are_framed_but_not_built():
    sender, receiver = Codec(system=3, component=1), Codec(wanted=message_ids(["HEARTBEAT"]))
    frames = receiver.feed(sender.encode(attitude(1)) + sender.encode(heartbeat()))
    assert [f.message is None for f in frames] == [True, False]
    assert frames[0].message_id == mavlink.MAVLINK_MSG_ID_ATTITUDE


def test_mavlink_1_is_understood():
    old = common.MAVLink(None, srcSystem=5, srcComponent=1)
    wire = heartbeat().pack(old, force_mavlink1=True)
    (frame,) = Codec().feed(wire)
    assert (frame.system, frame.component, frame.message.get_type()) == (5, 1, "HEARTBEAT")


def unknown_message(seq=0):
    """A message that the ardupilotmega dialect does not have."""
    number = next(n for n in development.mavlink_map if n not in mavlink.mavlink_map and n > 300)
    other = development.MAVLink(None, srcSystem=3, srcComponent=1)
    other.seq = seq
    kind = development.mavlink_map[number]
    values = kind.unpacker.unpack(bytes(range(1, kind.unpacker.size + 1)))
    message = kind.__new__(kind)
    development.MAVLink_message.__init__(message, number, kind.msgname)
    return bytes(message._pack(other, kind.crc_extra, kind.unpacker.pack(*values)))


def test_an_unknown_message_is_a_frame_without_a_message():
    sender, receiver = Codec(system=3, component=1), Codec()
    wire = sender.encode(heartbeat()) + unknown_message(seq=1)
    sender.encode(heartbeat())
    frames = receiver.feed(wire + sender.encode(attitude(5)))
    assert [f.message is None for f in frames] == [False, True, False]
    assert receiver.statistics.unknown == 1
    assert receiver.statistics.sources[3, 1].lost == 0


def test_a_supposed_unknown_message_does_not_swallow_a_real_one():
    real = Codec(system=3, component=1).encode(attitude(5))
    false_start = bytes((0xFD, len(real) - 2, 0, 0, 0, 0, 0, 0xEE, 0xEE, 0x7E))
    frames = Codec().feed(false_start + real)
    assert [f.raw for f in frames] == [real]


def test_loss_duplication_and_reordering_are_told_apart():
    statistics = SourceStatistics()
    for sequence in (254, 255, 0, 3, 2, 3, 4, 4):
        statistics.count(sequence)
    assert statistics.received == 8
    assert statistics.lost == 1  # number 1; 2 came late
    assert statistics.late == 1
    assert statistics.duplicated == 2


@given(st.integers(0, 255), st.lists(st.booleans(), min_size=2, max_size=400))
def test_lost_counts_exactly_what_was_dropped_in_between(first, kept):
    """As long as fewer than 240 in a row are lost, which a byte cannot tell from lateness."""
    statistics = SourceStatistics()
    kept = [True, *kept, True]
    run = longest = 0
    for there in kept:
        run = 0 if there else run + 1
        longest = max(longest, run)
    for i, there in enumerate(kept):
        if there:
            statistics.count((first + i) & 0xFF)
    if longest < 239:
        assert statistics.lost == kept.count(False)
        assert statistics.late == statistics.duplicated == 0


class TestSigning:
    def pair(self, *, sender_key=KEY, receiver_key=KEY, now=lambda: NOW, **kwargs):
        sender = Codec(system=3, component=1, signing=Signing(sender_key, now), link_id=4)
        return sender, Codec(signing=Signing(receiver_key, now, **kwargs))

    def test_signed_frames_pass_with_the_right_key(self):
        sender, receiver = self.pair()
        wire = [sender.encode(attitude(i)) for i in range(5)]
        assert len(receiver.feed(b"".join(wire))) == 5

    def test_pymavlink_agrees_about_the_signature(self):
        sender, _ = self.pair()
        oracle = mavlink.MAVLink(None)
        oracle.signing.secret_key = KEY
        assert oracle.decode(bytearray(sender.encode(attitude(1)))).get_signed()

    def test_we_accept_what_pymavlink_signs(self):
        oracle = mavlink.MAVLink(None, srcSystem=3, srcComponent=1)
        oracle.signing.secret_key = KEY
        oracle.signing.sign_outgoing = True
        oracle.signing.timestamp = int((NOW - EPOCH_UNIX_S) * 1e5)
        _, receiver = self.pair()
        assert len(receiver.feed(attitude(1).pack(oracle))) == 1

    def test_wrong_key_replay_and_unsigned_are_refused(self):
        sender, receiver = self.pair(sender_key=bytes(32))
        assert receiver.feed(sender.encode(attitude(1))) == []
        sender, receiver = self.pair()
        wire = sender.encode(attitude(1))
        assert len(receiver.feed(wire)) == 1
        assert receiver.feed(wire) == []
        assert receiver.feed(Codec(system=3, component=1).encode(attitude(2))) == []
        assert receiver.statistics.bad_signatures == 2

    def test_a_forged_frame_does_not_advance_the_stream(self):
        ahead, _ = self.pair(sender_key=bytes(32), now=lambda: NOW + 1e6)
        sender, receiver = self.pair()
        assert receiver.feed(ahead.encode(attitude(1))) == []
        assert len(receiver.feed(sender.encode(attitude(1)))) == 1

    def test_a_new_stream_may_be_a_minute_behind_but_no_more(self):
        for lag, passes in ((59.0, 1), (61.0, 0)):
            late = Codec(system=3, component=1, signing=Signing(KEY, lambda lag=lag: NOW - lag))
            receiver = Codec(signing=Signing(KEY, lambda: NOW))
            assert len(receiver.feed(late.encode(attitude(1)))) == passes

    def test_radios_and_mixed_networks_may_be_unsigned(self):
        radio = mavlink.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7)
        plain = Codec(system=51, component=68)
        _, receiver = self.pair()
        assert len(receiver.feed(plain.encode(radio))) == 1
        _, receiver = self.pair(accept_unsigned=True)
        assert len(receiver.feed(plain.encode(attitude(1)))) == 1

    def test_stamps_grow_even_if_the_clock_stands_still_or_goes_back(self):
        times = iter((NOW, NOW, NOW - 100.0, NOW - 100.0))
        signing = Signing(KEY, lambda: next(times))
        stamps = [signing.next_timestamp() for _ in range(4)]
        assert stamps == sorted(set(stamps))

    def test_a_key_has_32_bytes(self):
        with pytest.raises(ValueError, match="32 bytes"):
            Signing(b"short", lambda: NOW)
