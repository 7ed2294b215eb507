"""Samples one by one to blocks of them, and all that a calibrator has made of what it was fed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from onboard.answers.recorded import Recorded
from onboard.core.inputs.blocks import NO_ATTITUDE, AttitudeColumns, Block, ImuColumns, Piece
from onboard.core.inputs.samples import AttitudeSample, ImuSample, Sample


def block_of(samples: Sequence[Sample]) -> Block | None:
    """Samples as a block; None where one is of no column (an accelerometer without a gyroscope)."""
    kinds: dict[tuple, list[tuple[int, ImuSample]]] = {}
    attitudes, others = [], []
    for place, s in enumerate(samples):
        if isinstance(s, ImuSample):
            if s.w_b is None:
                return None
            kinds.setdefault((s.imu, s.f_step, s.w_step, s.source), []).append((place, s))
        elif isinstance(s, AttitudeSample):
            attitudes.append((place, s))
        else:
            others.append((place, s))
    attitude = NO_ATTITUDE
    if attitudes:
        angles = [(s.roll, s.pitch, s.yaw) for _, s in attitudes]
        attitude = AttitudeColumns(*placed(attitudes), np.array(angles))
    imus = []
    for (imu, *manner), found in kinds.items():
        heat = [np.nan if s.temperature is None else s.temperature for _, s in found]
        rows = [(*s.w_b, *s.f_b, x) for (_, s), x in zip(found, heat, strict=True)]
        imus.append(ImuColumns(imu, *placed(found), np.array(rows), *manner))
    return Block(tuple(imus), attitude, [s for _, s in others], [place for place, _ in others])


def placed(found: list) -> tuple[np.ndarray, np.ndarray]:
    return np.array([place for place, _ in found]), np.array([s.t for _, s in found])


def in_blocks(samples: Sequence[Sample], size: int) -> Iterator[Piece]:
    """The same samples, so many together at a time."""
    for start in range(0, len(samples), size):
        part = samples[start : start + size]
        block = block_of(part)
        yield from part if block is None else (block,)


def fed(pieces, reader) -> tuple[list, int]:
    """Feed a reader as a replay does: events, and how many samples went together."""
    events, together = [], 0
    for piece in pieces:
        if not isinstance(piece, Block):
            events += reader.feed(piece)
            continue
        came = reader.feed_block(piece)
        if came is None:
            for sample in piece.samples():
                events += reader.feed(sample)
        else:
            events += came
            together += len(piece)
    events += reader.finish()
    return events, together


def told(x: object) -> object:
    """Something with its arrays as bytes: what is equal is equal bit by bit."""
    if isinstance(x, np.ndarray):
        return x.shape, x.tobytes()
    if isinstance(x, dict):
        return {key: told(value) for key, value in x.items()}
    if isinstance(x, list | tuple):
        return tuple(map(told, x))
    if hasattr(x, "__slots__"):
        return type(x).__name__, tuple(told(getattr(x, name, None)) for name in x.__slots__)
    return repr(x)


def known(recorded: Recorded) -> dict[str, object]:
    """Everything that was made of what was fed: tracks, counters, trust, flight, what is drawn.

    Not the numbers: of the same flight they are the same.
    """
    calibrator, drawn = recorded.calibrator, recorded.chronicle
    streams, trust = calibrator._assembly.streams, calibrator._trust
    tracks = {
        imu: (track.arrays(), dict(track.refused), track.highres_t, told(track._manners))
        for imu, track in streams.imus.items()
    }
    slow = {name: track.arrays() for name, track in streams.slow.items()}
    return told(
        {
            "counts": dict(calibrator._counts),
            "clock": (calibrator._clock.first, calibrator._clock.newest, recorded._newest),
            "times": (calibrator.flown_s, calibrator.standing_s),
            "tracks": tracks,
            "recorded": streams.recorded.arrays(),
            "slow": slow,
            "fixes": (dict(streams.fixes.refused), [s.t for s, _ in streams.fixes._fixes]),
            "trust": (trust.phase, trust.reasons, trust.trusted_s, trust.rejected, trust.refusals),
            "heard": (trust._now, trust._last_heard, trust._last_fix),
            "parameters": calibrator.parameters.values,
            "flown": {imu: list(batches) for imu, batches in calibrator.flown.items()},
            "drawn": None
            if drawn is None
            else (
                [(p.first, p.last, p.drawn) for p in drawn._pieces],
                drawn._spans,
                drawn._speed,
                drawn._held,
            ),
        }
    )


def differing(one: Recorded, other: Recorded) -> list[str]:
    """Names of what is not the same, bit by bit: the things themselves are too long to be shown."""
    a, b = known(one), known(other)
    return [name for name in a if a[name] != b[name]]
