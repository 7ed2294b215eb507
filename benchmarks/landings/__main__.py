"""``make simulate``: landings with all that may happen around them, and what was written.

``python -m benchmarks.landings --seed 7 --landings 20`` plays restarts of the daemon, reboots of
the autopilot, other boards of the same model, bench calibrations and meddling ground stations at
random, and holds every write against what really happened (:mod:`benchmarks.landings.checker`).
A seed that fails prints its history.
"""

from __future__ import annotations

import argparse
import asyncio
import random
import sys
import tempfile
from pathlib import Path

from benchmarks.landings.boards import draw_boards
from benchmarks.landings.chapters import Chapter, draw_chapter
from benchmarks.landings.story import Story
from benchmarks.landings.table import table
from sitl.virtual_time import VirtualTimeLoop

BOARDS = 3


def play(chapters: list[Chapter], *, seed: int, imus: int, telling: bool = True) -> Story:
    """Play chapters from the beginning, in a fresh state directory."""

    async def played(directory: Path) -> Story:
        boards = draw_boards(random.Random(f"boards {seed}"), BOARDS, imus, telling=telling)  # noqa: S311 - chance
        story = Story(boards, directory, seed=seed)
        await story.play(chapters)
        return story

    with (
        tempfile.TemporaryDirectory() as folder,
        asyncio.Runner(loop_factory=VirtualTimeLoop) as runner,
    ):
        return runner.run(played(Path(folder)))


def main() -> int:
    """Play, print, and say by the exit status whether all rules held."""
    parser = argparse.ArgumentParser(prog="benchmarks.landings", description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--landings", type=int, default=20)
    parser.add_argument("--imus", type=int, choices=(1, 2), help="default: by the seed")
    parser.add_argument("--history", action="store_true", help="print it also if all rules hold")
    chosen = parser.parse_args()
    rng = random.Random(f"chapters {chosen.seed}")  # noqa: S311 - chance, no secret
    imus = chosen.imus or rng.choice((1, 2))
    telling = rng.random() < 0.8
    chapters = [draw_chapter(rng) for _ in range(chosen.landings)]
    print(
        f"seed {chosen.seed}: {chosen.landings} landings, {imus} accelerometer(s), boards that "
        f"tell {'their id' if telling else 'no id'}",
        flush=True,
    )
    story = play(chapters, seed=chosen.seed, imus=imus, telling=telling)
    if story.checker.faults or chosen.history:
        print("\n".join(story.history.lines), end="\n\n")
    print(table(story))
    return 1 if story.checker.faults else 0


if __name__ == "__main__":
    sys.exit(main())
