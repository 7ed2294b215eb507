"""What a command costs and answers, against the code of another revision, in turn on one machine.

``python -m benchmarks.against [REV]`` takes ``REV`` out of git into a temporary folder and runs
``replay`` of two accelerometers, ``explain`` and ``match`` there and in the working tree, one after
the other and the other way round, each in a process of its own.  A machine that is slower today, or
that others use as well, makes both slower: ratios of pairs stay.  Beside what it costs stands how
the answers differ: by how many of their sigmas numbers are others, and names that came or went.
Without a revision it is the last tag or, where there is none, the commit before the one that the
working tree and ``main`` have in common.

The flight is a simulated one, written by the working tree's simulator; ``--recordings FILE...``
adds logs.  What runs first of each is not counted: it compiles what it runs.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import shutil
import subprocess
import tarfile
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from statistics import median

from benchmarks.apart import Apart, Json, apart
from benchmarks.explain_time import Cost, cost_of, flown

HERE = Path(__file__).resolve().parents[1]
COMMANDS = ("replay", "explain", "match")
SHOWN = 4
"""Changes of each kind that are written out; the rest is counted."""
EXPORTED = ("onboard", "sitl")


class NoRevisionError(Exception):
    """Git has no such revision, or there is no git."""


@dataclass(frozen=True, slots=True)
class Compared:
    """One command on one recording.

    Attributes:
        before: what each run of the other revision cost.
        now: what each run of the working tree did, in the same order.
        answers: how both answers differ.
    """

    before: tuple[Cost, ...]
    now: tuple[Cost, ...]
    answers: Apart

    def ratio(self, of: str) -> float:
        """Median over the pairs: the working tree's part of what the other revision takes."""
        pairs = zip(self.now, self.before, strict=True)
        return median(getattr(now, of) / getattr(before, of) for now, before in pairs)


def _git(*arguments: str) -> bytes:
    git = shutil.which("git")
    if git is None:
        raise NoRevisionError("there is no git")
    made = subprocess.run([git, *arguments], cwd=HERE, capture_output=True, check=False)  # noqa: S603
    if made.returncode:
        raise NoRevisionError(made.stderr.decode().strip() or f"git {arguments[0]} failed")
    return made.stdout


def usual_revision() -> tuple[str, str]:
    """The revision to compare with where none is named, and what it is."""
    with contextlib.suppress(NoRevisionError):
        return _git("describe", "--tags", "--abbrev=0").decode().strip(), "the last tag"
    common = _git("merge-base", "HEAD", "main").decode().strip()
    return f"{common}^", "there are no tags: the commit before what is common with main"


def exported(revision: str, folder: Path) -> Path:
    """The programs of a revision, in the folder, as they are in git."""
    data = _git("archive", "--format=tar", revision, *EXPORTED)
    with tarfile.open(fileobj=BytesIO(data)) as archive:
        archive.extractall(folder, filter="data")
    return folder


def run(tree: Path, command: str, log: Path, out: Path) -> Cost:
    """A command of the programs in a folder, in a process of its own; its JSON goes to ``out``."""
    return cost_of(command, str(log), "--json", str(out), tree=tree)


def compared(before: Path, now: Path, command: str, log: Path, pairs: int) -> Compared:
    """Run a command of two trees in turn on a recording, after one of each that is not counted."""
    with tempfile.TemporaryDirectory() as folder:
        answers: list[Json] = []
        for tree in (before, now):
            out = Path(folder) / "answer.json"
            run(tree, command, log, out)
            answers.append(json.loads(out.read_text(encoding="utf-8")))
        first, second = [], []
        for k in range(pairs):
            # Whatever changes steadily meanwhile is for the one as often as for the other.
            one, other = (before, now) if k % 2 == 0 else (now, before)
            a, b = (run(tree, command, log, Path(folder) / "again.json") for tree in (one, other))
            first.append(a if one is before else b)
            second.append(b if one is before else a)
        return Compared(tuple(first), tuple(second), apart(*answers))


def rows(name: str, found: Compared) -> Iterator[str]:
    """Lines on one command and recording."""
    seconds = [median(c.processor for c in costs) for costs in (found.before, found.now)]
    memory = [median(c.memory for c in costs) for costs in (found.before, found.now)]
    yield (
        f"{name:32}{seconds[0]:9.2f}{seconds[1]:9.2f} s{found.ratio('processor'):8.2f}"
        f"{memory[0]:9.0f}{memory[1]:9.0f} MB{found.ratio('memory'):8.2f}"
    )
    answers = found.answers
    if answers.nothing:
        yield "    the very same answers"
        return
    for changes, unit in ((answers.in_sigmas, "of its sigma"), (answers.relative, "of itself")):
        for c in changes[:SHOWN]:
            yield f"    {c.by:8.2g} {unit}: {c.where} {c.before:.6g} -> {c.now:.6g}"
        if len(changes) > SHOWN:
            yield f"    and {len(changes) - SHOWN} more, less by {unit.split()[-1]}"
    for names, what in ((answers.came, "came"), (answers.went, "went")):
        yield from (f"    {what}: {where}" for where in names)
    yield from (f"    {where}: {old!r} -> {new!r}" for where, old, new in answers.said)


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Cost and answers against another revision.")
    parser.add_argument("revision", nargs="?", help="of git; the last tag by default")
    parser.add_argument("--pairs", type=int, default=5, help="of runs that are counted")
    parser.add_argument("--length", type=float, default=600.0, help="of the simulated flight, s")
    parser.add_argument("--commands", nargs="+", choices=COMMANDS, default=COMMANDS)
    parser.add_argument("--recordings", nargs="+", type=Path, default=[], metavar="FILE")
    chosen = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        try:
            revision, why = (chosen.revision, "") if chosen.revision else usual_revision()
            before = exported(revision, Path(folder) / "before")
            named = _git("log", "-1", "--format=%h %s", revision).decode().strip()
        except NoRevisionError as error:
            print(f"nothing to compare with: {error}")
            return
        print(f"against {named}{f' ({why})' if why else ''}")
        print(f"{'':32}{'before':>9}{'now':>9}  {'ratio':>8}{'before':>9}{'now':>9}   {'ratio':>8}")
        made = Path(folder) / "two accelerometers.tlog"
        flown(made, "copter", 2, (), chosen.length)
        for log in (made, *(file.resolve() for file in chosen.recordings)):
            for command in chosen.commands:
                _say(before, command, log, chosen.pairs)


def _say(before: Path, command: str, log: Path, pairs: int) -> None:
    name = f"{command}: {log.stem}"
    try:
        found = compared(before, HERE, command, log, pairs)
    except subprocess.CalledProcessError as error:
        print(f"{name:32} ended with {error.returncode} in one of both", flush=True)
        return
    for line in rows(name, found):
        print(line, flush=True)


if __name__ == "__main__":
    main()
