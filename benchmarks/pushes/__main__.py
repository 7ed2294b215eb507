"""``make simulate``: pushes under faults, many histories, each from its seed.

``python -m benchmarks.pushes --count 100000`` plays them; a history in which a rule does not hold
(:mod:`benchmarks.pushes.rules`) is printed with its seed, and ``--seed N`` plays that one alone.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from benchmarks.pushes.faults import draw
from benchmarks.pushes.play import History
from benchmarks.pushes.story import BrokenRuleError

SHOWN = 3


def main() -> int:
    """Play, print, and say by the exit status whether all rules held."""
    parser = argparse.ArgumentParser(prog="benchmarks.pushes", description=__doc__)
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, help="only this one, with its history")
    chosen = parser.parse_args()
    seeds = range(chosen.first, chosen.first + chosen.count)
    if chosen.seed is not None:
        seeds = range(chosen.seed, chosen.seed + 1)
    memory = Path("/dev/shm")  # noqa: S108 - the simulated disk, in memory where there is one
    began, ends, broken = time.monotonic(), Counter[str](), 0
    with tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else None) as folder:
        for seed in seeds:
            script = draw(seed)
            try:
                History(script, Path(folder)).play()
            except BrokenRuleError as error:
                broken += 1
                if broken <= SHOWN:
                    print(f"{error}\n", flush=True)
            else:
                ends[_end(script.lines)] += 1
            if chosen.seed is not None:
                print(script, *script.lines, sep="\n")
    took = time.monotonic() - began
    print(f"{len(seeds)} histories in {took:.0f} s: {broken} with a broken rule")
    print(", ".join(f"{count} {name}" for name, count in ends.most_common()))
    return 1 if broken else 0


def _end(lines: list[str]) -> str:
    """How the last transaction ended, in a word."""
    for line in reversed(lines):
        for word in ("completed", "rolled_back", "aborted"):
            if f"  {word}: " in line:
                return word
    return "nothing was pushed"


if __name__ == "__main__":
    sys.exit(main())
