"""Bytes that are nearly right, which go further than random ones: edits of samples."""

from __future__ import annotations

import random
from collections.abc import Sequence

INTERESTING = (b"\x00", b"\xff", b"\x7f", b"\x80", b"\xfd", b"\xfe", b"\x00" * 8, b"\xff" * 8)
LONGEST = 200_000
"""bytes; nothing is made longer."""


def mutated(rng: random.Random, seeds: Sequence[bytes], tokens: Sequence[bytes] = ()) -> bytes:
    """One of the seeds after a few edits; now and then noise alone."""
    if rng.random() < 0.05:
        return rng.randbytes(rng.choice((0, 1, 7, 64, 1000)))
    data = bytearray(rng.choice(seeds))
    for _ in range(rng.choice((1, 1, 2, 3, 5, 8, 20))):
        _edit(rng, data, seeds, (*tokens, *INTERESTING))
    return bytes(data[:LONGEST])


def _edit(
    rng: random.Random, data: bytearray, seeds: Sequence[bytes], tokens: Sequence[bytes]
) -> None:
    at = rng.randint(0, len(data))
    length = rng.choice((1, 2, 4, 8, 50, 500))
    match rng.randint(0, 8):
        case 0 if at < len(data):
            data[at] ^= 1 << rng.randint(0, 7)
        case 1 if at < len(data):
            data[at] = rng.randint(0, 255)
        case 2:
            del data[at:]
        case 3:
            del data[at : at + length]
        case 4:
            data[at:at] = rng.randbytes(length)
        case 5:
            data[at : at + length] = bytes(len(data[at : at + length]))
        case 6:
            token = rng.choice(tokens)
            end = at + (len(token) if rng.random() < 0.5 else 0)
            data[at:end] = token * rng.choice((1, 1, 1, 2, 30))
        case 7:
            other = rng.choice(seeds)
            start = rng.randint(0, len(other))
            data[at:at] = other[start : start + length]
        case _:
            data[at:at] = data[at : at + length] * rng.choice((1, 1, 5))
