"""A fleet that is killed in the middle: the next run does what is missing, and says the same."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from onboard.cli.main import run
from tests.batches.logs import write

LOGS = {f"{k}.BIN": 3 + k for k in range(30)}
"""So many that no machine is through with them before it is noticed that two are done."""
LIMIT_S = 120.0


def children(pid: int) -> set[int]:
    """Processes that ``pid`` has begun and that are there still."""
    found = set()
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            text = stat.read_text()
        except OSError:
            continue
        if int(text.rpartition(")")[2].split()[1]) == pid:
            found.add(int(stat.parent.name))
    return found


def gone(pid: int) -> bool:
    """Whether it has ended; one that nobody has waited for yet has."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def until(condition) -> None:
    end = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def answers(file: Path) -> object:
    return json.loads(file.read_text())


def test_a_fleet_that_is_killed_is_taken_up_where_it_was(tmp_path, capsys):
    logs, store = tmp_path / "logs", tmp_path / "store"
    logs.mkdir()
    write(logs, LOGS)
    whole, resumed = tmp_path / "whole.json", tmp_path / "resumed.json"
    assert run(["fleet", str(logs), "--jobs", "1", "--json", str(whole)]) == 0
    command = [sys.executable, "-m", "onboard", "fleet", str(logs), "--jobs", "1"]
    killed = subprocess.Popen([*command, "--store", str(store)], stdout=subprocess.DEVNULL)  # noqa: S603
    until(lambda: len(list(store.glob("*/*.record"))) >= 2 or killed.poll() is not None)
    workers = children(killed.pid)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    kept = {file: file.stat().st_mtime_ns for file in store.glob("*/*.record")}
    assert 2 <= len(kept) < len(LOGS)
    until(lambda: all(map(gone, workers)))  # nobody goes on working for nobody
    # What was being written when the power went.
    torn = next(iter(kept)).with_suffix(".part")
    torn.write_bytes(b"onboard fleet 1\n")
    os.truncate(next(iter(kept)), 100)
    again = ["fleet", str(logs), "--jobs", "1", "--store", str(store), "--json", str(resumed)]
    assert run(again) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "torn or not of this program, replayed anew" in said
    assert answers(resumed) == answers(whole)
    untouched = list(kept)[1:]
    assert all(file.stat().st_mtime_ns == kept[file] for file in untouched)
    assert len(list(store.glob("*/*.record"))) == len(LOGS)
