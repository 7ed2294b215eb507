"""Messages between a process and those it has started: a length (8 bytes), then MessagePack."""

from __future__ import annotations

import struct
from typing import IO

import msgspec

from onboard.batches.job import Job, Outcome
from onboard.printable import encodable

_LENGTH = struct.Struct("<Q")


class Share(msgspec.Struct, frozen=True, tag="share"):
    """How much of a recording is read, 0 ... 1."""

    done: float


class Result(msgspec.Struct, frozen=True, tag="result"):
    """What came of it."""

    outcome: Outcome


_SAID: msgspec.msgpack.Decoder[Share | Result] = msgspec.msgpack.Decoder(Share | Result)
_JOB = msgspec.msgpack.Decoder(Job)


def send(pipe: IO[bytes], message: Job | Share | Result) -> None:
    """Write one message."""
    try:
        data = msgspec.msgpack.encode(message)
    except UnicodeEncodeError:  # a name that is no UTF-8
        plain = msgspec.to_builtins(message, builtin_types=(bytes,))
        data = msgspec.msgpack.encode(encodable(plain))
    pipe.write(_LENGTH.pack(len(data)) + data)
    pipe.flush()


def next_job(pipe: IO[bytes]) -> Job | None:
    """The next job; None where there is none any more."""
    data = _next(pipe)
    return None if data is None else _JOB.decode(data)


def next_said(pipe: IO[bytes]) -> Share | Result | None:
    """What a process says next; None if it has ended, in the middle or not."""
    data = _next(pipe)
    return None if data is None else _SAID.decode(data)


def _next(pipe: IO[bytes]) -> bytes | None:
    head = pipe.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    length = _LENGTH.unpack(head)[0]
    data = pipe.read(length)
    return data if len(data) == length else None
