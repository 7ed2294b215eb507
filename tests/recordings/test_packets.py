"""Unpacking without the dialect's own checks gives what the dialect gives."""

from __future__ import annotations

import random

import numpy as np
import pytest

from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import MESSAGE_IDS, mavlink
from onboard.recordings.packets import Unpacker

SENDER = mavlink.MAVLink(None, srcSystem=7, srcComponent=1)
KINDS = {"f": lambda r: r.uniform(-1e3, 1e3), "d": lambda r: r.uniform(-1e9, 1e9)}
BITS = {"B": 8, "H": 16, "I": 32, "Q": 64}


def filled(name: str, seed: int):
    """A message of that name with random fields, zeros at the end for one of them."""
    kind = mavlink.mavlink_map[MESSAGE_IDS[name]]
    r = random.Random(seed)
    values = []
    for letter in kind.unpacker.format.lstrip("<"):
        if letter in KINDS:
            values.append(KINDS[letter](r))
        elif letter in BITS:
            values.append(r.getrandbits(BITS[letter]))
        else:
            values.append(r.getrandbits(BITS[letter.upper()]) - 2 ** (BITS[letter.upper()] - 1))
    if seed == 0:
        values = [0] * len(values)
    return kind(*(values[i] for i in kind.orders))


def unpacked(*packets: bytes) -> list:
    """What the unpacker makes of packets that stand one after the other."""
    places = np.cumsum([0, *map(len, packets)])[:-1]
    return Unpacker()(np.frombuffer(b"".join(packets), np.uint8), places)


PLAIN = [n for n in Decoder.names if not any(mavlink.mavlink_map[MESSAGE_IDS[n]].array_lengths)]


@pytest.mark.parametrize("old", [False, True], ids=["MAVLink 2", "MAVLink 1"])
@pytest.mark.parametrize("name", PLAIN)
def test_every_plain_message_reads_as_the_dialect_reads_it(name, old):
    if old and MESSAGE_IDS[name] > 255:
        pytest.skip("MAVLink 1 has no such message")
    for seed in range(3):
        packet = filled(name, seed).pack(SENDER, force_mavlink1=old)
        theirs = mavlink.MAVLink(None).decode(bytearray(packet))
        (ours,) = unpacked(bytes(packet))
        assert ours.get_msgId() == theirs.get_msgId()
        assert (ours.get_srcSystem(), ours.get_srcComponent()) == (7, 1)
        for field in theirs.get_fieldnames():
            assert getattr(ours, field) == getattr(theirs, field)


def test_messages_with_strings_go_by_way_of_the_dialect():
    sent = mavlink.MAVLink_param_value_message(b"INS_ACCOFFS_X", 0.25, 9, 10, 3)
    (got,) = unpacked(bytes(sent.pack(SENDER)))
    assert (got.param_id, got.param_value) == ("INS_ACCOFFS_X", 0.25)
