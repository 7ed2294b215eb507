"""Starts that come to nothing wait longer and longer; one crash does not make the service wait."""

from __future__ import annotations

import asyncio
import itertools

import pytest

from onboard.cli import run as verb
from onboard.cli.main import run
from onboard.daemon.process import service as process
from onboard.daemon.process.limits import LONGEST_WAIT_S, STARTS_AT_ONCE
from onboard.daemon.process.starts import FILE, Starts, waiting
from onboard.errors import HeldError, LinkError, UnavailableError


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The unit's runtime directory, as systemd hands it over."""
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(tmp_path))
    return tmp_path


@pytest.fixture
def slept(monkeypatch):
    """How long starts wait, without waiting."""
    waited: list[float] = []
    monkeypatch.setattr(verb.time, "sleep", waited.append)
    return waited


@pytest.fixture
def ends(monkeypatch):
    """Let the service end in some way, some time after its start."""

    def with_(how, after_s=0.0):
        class Ended:
            stopped_by = None

            def __init__(self, configuration):
                del configuration

            async def run(self, *, handle_signals):
                del handle_signals
                await asyncio.sleep(after_s)
                if how is not None:
                    raise how

        monkeypatch.setattr(process, "Service", Ended)

    return with_


@pytest.fixture
def start(tmp_path, folder):
    del folder
    return lambda: run(["run", "--endpoint", "udpin:127.0.0.1:0", "--state", str(tmp_path / "s")])


def test_waits_grow_from_none_to_the_longest_and_stay_there():
    waits = [waiting(n) for n in range(200)]
    assert waits[:STARTS_AT_ONCE] == [0.0] * STARTS_AT_ONCE
    assert all(a <= b for a, b in itertools.pairwise(waits))
    assert waits[-1] == LONGEST_WAIT_S
    assert sum(w == 0.0 for w in waits) == STARTS_AT_ONCE


WAITED = [4.0, 8.0, 16.0, LONGEST_WAIT_S, LONGEST_WAIT_S]


def test_a_service_that_crashes_at_each_start_waits_longer_each_time(ends, start, slept):
    ends(RuntimeError("a fault of ours"))
    for _ in range(7):
        with pytest.raises(RuntimeError):
            start()
    assert slept == WAITED


@pytest.mark.parametrize("kind", [UnavailableError, HeldError])
def test_so_does_one_whose_port_or_directory_is_somebody_elses(ends, start, slept, kind):
    ends(kind("port in use"))
    assert [start() for _ in range(7)] == [3] * 7
    assert slept == WAITED


@pytest.mark.parametrize("how", [None, LinkError("no heartbeat")], ids=["stopped", "said why"])
def test_an_end_that_was_foreseen_begins_the_count_anew(ends, start, slept, folder, how):
    ends(RuntimeError("a fault of ours"))
    for _ in range(4):
        with pytest.raises(RuntimeError):
            start()
    ends(how)
    assert start() == (0 if how is None else how.exit_status)
    assert not (folder / FILE).exists()
    slept.clear()
    ends(RuntimeError("a fault of ours"))
    with pytest.raises(RuntimeError):
        start()
    assert slept == []


def test_a_minute_of_work_makes_the_next_crash_the_first(monkeypatch, ends, start, slept, folder):
    monkeypatch.setattr("onboard.daemon.process.limits.SETTLED_S", 0.01)
    ends(RuntimeError("a fault of ours"), after_s=0.05)
    for _ in range(5):
        with pytest.raises(RuntimeError):
            start()
    assert slept == []
    assert not (folder / FILE).exists()


def test_without_a_unit_nothing_waits_and_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.delenv("RUNTIME_DIRECTORY", raising=False)
    starts = Starts.from_environment()
    assert [starts.begin() for _ in range(9)] == [0.0] * 9
    starts.over()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", [b"", b"many", b"-3", b"\xff", b"9" * 5000])
def test_a_count_that_is_none_does_not_hold_a_start_up_for_longer_than_the_longest(folder, content):
    (folder / FILE).write_bytes(content)
    assert Starts.from_environment().begin() <= LONGEST_WAIT_S


def test_a_directory_that_takes_no_file_is_no_reason_not_to_start(folder):
    starts = Starts(folder / "gone")
    assert starts.begin() == 0.0
    starts.over()
