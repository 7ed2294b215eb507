"""Sums of blocks of a flight: enough of them for folds, clusters and forgetting."""

from __future__ import annotations

from dataclasses import dataclass

from onboard.core.maths.sums import NormalSums


@dataclass(slots=True)
class Block:
    """Sums of one block of flight."""

    start: float
    end: float
    sums: NormalSums


@dataclass(frozen=True, slots=True)
class Seconds:
    """How much flight is behind some sums: ``trusted``, and of that ``brisk``, s."""

    trusted: float
    brisk: float


def merged(blocks: list[Block], most: int) -> list[Block]:
    """At most ``most`` blocks, neighbours added up."""
    while len(blocks) > most:
        pairs = [
            Block(a.start, b.end, a.sums + b.sums)
            for a, b in zip(blocks[::2], blocks[1::2], strict=False)
        ]
        blocks = pairs + ([blocks[-1]] if len(blocks) % 2 else [])
    return blocks
