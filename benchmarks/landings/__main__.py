"""``make landings``: landings with all that may happen around them, and what was written.

``python -m benchmarks.landings --seed 7 --landings 20`` plays restarts of the daemon, reboots of
the autopilot, other boards of the same model, bench calibrations and meddling ground stations at
random, and holds every write against what really happened (:mod:`benchmarks.landings.checker`).
A seed that fails prints its history.
"""

from __future__ import annotations

import argparse
import random
import sys

from benchmarks.landings.chapters import draw_chapter
from benchmarks.landings.story import play
from benchmarks.landings.table import table

BOARDS = 3


def main() -> int:
    """Play, print, and say by the exit status whether all rules held."""
    parser = argparse.ArgumentParser(prog="benchmarks.landings", description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--landings", type=int, default=20)
    parser.add_argument("--imus", type=int, choices=(1, 2), help="default: by the seed")
    parser.add_argument("--history", action="store_true", help="print it as it happens")
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
    story = play(
        chapters,
        seed=chosen.seed,
        boards=BOARDS,
        imus=imus,
        telling=telling,
        live=chosen.history,
    )
    if story.checker.faults and not chosen.history:
        print("\n".join(story.history.lines), end="\n\n")
    print(table(story))
    return 1 if story.checker.faults else 0


if __name__ == "__main__":
    sys.exit(main())
