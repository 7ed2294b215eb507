"""Processes side by side: what one log does to its process is its own affair."""

from __future__ import annotations

import os

import msgspec
import pytest

from onboard.batches import crew
from onboard.batches.crew import ending, outcomes
from onboard.batches.job import Job, content, done
from tests.batches.logs import jobs, killed_by_some, write

ENCODE = msgspec.msgpack.encode


@pytest.mark.slow
def test_a_log_that_kills_its_process_costs_itself(tmp_path, monkeypatch):
    paths = write(tmp_path, {"a.BIN": 4, "killer.BIN": 4, "c.BIN": 5})
    monkeypatch.setattr(crew, "started", killed_by_some)
    found = dict(outcomes(jobs(paths), 1))
    assert sorted(found) == [0, 1, 2]
    assert [bool(found[i].record) for i in range(3)] == [True, False, True]
    assert found[1].error == (f"{paths[1]}: the process that replayed it was killed (SIGKILL)")


def test_whatever_goes_wrong_is_the_outcome(tmp_path, monkeypatch):
    (path,) = write(tmp_path, {"a.BIN": 4})

    def broken(*_arguments, **_more):
        raise KeyError("a fault of ours")

    assert "no such file" in done(Job(path=os.fsencode(tmp_path / "absent"))).error
    monkeypatch.setattr("onboard.batches.job.replay", broken)
    (job,) = jobs([path])
    assert "could not be replayed (KeyError: 'a fault of ours')" in done(job).error
    assert "another version" in done(Job(path=os.fsencode(path), version="old")).error


def test_the_hash_is_of_the_content(tmp_path):
    a, b = write(tmp_path, {"a.BIN": 4, "b.BIN": 4})
    assert content(a) == content(b) != content(write(tmp_path, {"c.BIN": 5})[0])
    assert content(tmp_path) == ""


def test_endings_in_words():
    assert ending(3) == "ended with status 3"
    assert ending(-9) == "was killed (SIGKILL)"
    assert ending(None) == "fell silent"
