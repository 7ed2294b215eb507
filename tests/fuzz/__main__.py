"""``make fuzz``: as many inputs as fit into a time, each target its share; a table at the end.

An input that raises anything but an OnboardError, takes too long or too much memory is written to
``out/fuzz``; moved to ``tests/fuzz/found`` it becomes a test.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import logging
import random
import resource
import signal
import sys
import time
import traceback
import warnings
from dataclasses import dataclass
from pathlib import Path

from onboard.errors import OnboardError
from tests.fuzz.mutations import mutated
from tests.fuzz.targets import TARGETS

LONGEST_S = 10
"""s of processor time; an input that takes longer has failed."""
MEMORY = 1 << 30
"""bytes of address space beyond what is used at the start."""
OUT = Path("out") / "fuzz"


@dataclass
class Tally:
    """What became of one target's inputs."""

    inputs: int = 0
    bytes: int = 0
    results: int = 0
    errors: int = 0
    failures: int = 0
    longest_s: float = 0.0


def main() -> int:
    """Exit status 1 if anything was found."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0, help="for all targets together")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*", choices=sorted(TARGETS), default=sorted(TARGETS))
    options = parser.parse_args()
    logging.basicConfig(level=logging.ERROR, stream=io.StringIO())
    warnings.simplefilter("error")
    signal.signal(signal.SIGPROF, _too_long)
    _limit_memory()
    tallies = {}
    for name in options.only:
        tallies[name] = _fuzz(name, options.seed, options.seconds / len(options.only))
        print(_row(name, tallies[name]), flush=True)
    print(_table(tallies))
    return 1 if any(tally.failures for tally in tallies.values()) else 0


def _fuzz(name: str, seed: int, seconds: float) -> Tally:
    target, tally = TARGETS[name], Tally()
    rng = random.Random(f"{name} {seed}")
    end = time.monotonic() + seconds
    seen: set[str] = set()
    while time.monotonic() < end:
        data = mutated(rng, target.seeds, target.tokens)
        tally.inputs += 1
        tally.bytes += len(data)
        began = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, LONGEST_S)
        try:
            target.run(data)
            tally.results += 1
        except OnboardError:
            tally.errors += 1
        except BaseException as error:  # that is what is looked for
            if isinstance(error, KeyboardInterrupt):
                raise
            tally.failures += 1
            _keep(name, data, error, seen)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        tally.longest_s = max(tally.longest_s, time.process_time() - began)
    return tally


def _keep(name: str, data: bytes, error: BaseException, seen: set[str]) -> None:
    """Write an input down and say where it failed, once for each place."""
    frames = traceback.extract_tb(error.__traceback__)
    place = f"{type(error).__name__} at " + " < ".join(
        f"{Path(f.filename).name}:{f.lineno}" for f in reversed(frames[-4:])
    )
    if place in seen:
        return
    seen.add(place)
    folder = OUT / name
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{hashlib.sha256(data).hexdigest()[:12]}.bin"
    path.write_bytes(data)
    print(f"{path}: {place}: {str(error)[:200]}", file=sys.stderr, flush=True)


class TooLongError(BaseException):
    """An input that takes too long."""


def _too_long(*_: object) -> None:
    raise TooLongError


def _limit_memory() -> None:
    pages = Path("/proc/self/statm")
    if not pages.exists():
        return
    used = int(pages.read_text().split()[0]) * resource.getpagesize()
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, hard))


def _row(name: str, tally: Tally) -> str:
    return (
        f"| {name} | {tally.inputs:,} | {tally.bytes:,} | {tally.results:,} | {tally.errors:,} | "
        f"{tally.failures} | {tally.longest_s * 1e3:.0f} |"
    )


def _table(tallies: dict[str, Tally]) -> str:
    total = Tally()
    for tally in tallies.values():
        total.inputs += tally.inputs
        total.bytes += tally.bytes
        total.results += tally.results
        total.errors += tally.errors
        total.failures += tally.failures
        total.longest_s = max(total.longest_s, tally.longest_s)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    lines = [
        "| bytes for | inputs | bytes | results | named errors | anything else | longest, CPU ms |",
        "|---|---|---|---|---|---|---|",
        *(_row(name, tally) for name, tally in tallies.items()),
        _row("all", total),
        "",
        f"Peak of the process: {peak:.0f} MB.",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
