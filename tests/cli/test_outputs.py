"""A result is never written over what it was made of."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from onboard.cli.main import run
from tests.recordings.dataflash_writer import modern_log

OPTIONS = {
    "replay": ("--json", "--report", "--param", "--mcap"),
    "explain": ("--json", "--report", "--param", "--mcap"),
    "match": ("--json", "--report", "--param", "--frame-out"),
    "fleet": ("--json", "--parquet"),
}


@pytest.fixture
def log(tmp_path) -> Path:
    path = tmp_path / "flight.BIN"
    path.write_bytes(bytes(modern_log(1)))
    return path


def refused(capsys) -> str:
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    return err


@pytest.mark.parametrize(("verb", "option"), [(v, o) for v, os in OPTIONS.items() for o in os])
@pytest.mark.parametrize("name", ["itself", "symlink", "hard link", "another way"])
def test_no_result_takes_the_place_of_a_recording(log, capsys, verb, option, name):
    before, place = log.read_bytes(), log.parent / "x.BIN"
    if name == "symlink":
        place.symlink_to(log)
    elif name == "hard link":
        os.link(log, place)
    else:
        place = log if name == "itself" else log.parent / ".." / log.parent.name / log.name
    assert run([verb, str(log), option, str(place)]) == 2
    assert "would be overwritten" in refused(capsys)
    assert log.read_bytes() == before


def test_no_frame_takes_the_place_of_the_one_it_is_compared_with(log, capsys):
    frame = log.with_name("frame.json")
    frame.write_text("{}")
    assert run(["match", str(log), "--frame", str(frame), "--frame-out", str(frame)]) == 2
    assert "would be overwritten" in refused(capsys)
    assert frame.read_text() == "{}"


def test_two_results_have_two_places(log, capsys):
    place = str(log.with_name("x"))
    assert run(["explain", str(log), "--json", place, "--report", place]) == 2
    assert "two results" in refused(capsys)
    assert not Path(place).exists()


@pytest.mark.parametrize("verb", ["replay", "explain", "match"])
def test_two_results_do_not_both_go_to_standard_output(log, capsys, verb):
    assert run([verb, str(log), "--json", "-", "--param", "-"]) == 2
    assert "standard output" in refused(capsys)


@pytest.fixture
def untouched(monkeypatch):
    """No recording is replayed: what is refused is refused before."""

    def never(*_, **__):
        raise AssertionError("work was begun")

    monkeypatch.setattr("onboard.cli.fleet.fly", never)
    pytest.importorskip("pyarrow", reason="pyarrow is not installed")


@pytest.mark.parametrize("option", ["--json", "--parquet"])
@pytest.mark.parametrize("place", ["absent/x", "folder", "flight.BIN/x", "n" * 300])
def test_what_cannot_be_written_is_said_before_the_work(log, capsys, untouched, option, place):
    (log.parent / "folder").mkdir()
    there = sorted(log.parent.rglob("*"))
    assert run(["fleet", str(log), "--jobs", "1", option, str(log.parent / place)]) == 2
    assert "cannot be written" in refused(capsys)
    assert sorted(log.parent.rglob("*")) == there


@pytest.mark.parametrize("option", ["--json", "--parquet"])
@pytest.mark.parametrize("before", ["nothing", "a file", "a link", "a link to nothing"])
def test_a_place_that_can_be_written_is_left_as_it_is(log, untouched, option, before):
    """Not even its time is another one, should the work come to nothing."""
    place, other = log.with_name("x"), log.with_name("other")
    if before == "a file":
        place.write_bytes(b"before")
    elif before != "nothing":
        place.symlink_to(other)
    if before == "a link":
        other.write_bytes(b"before")
    state = [(f, f.lstat().st_mtime_ns) for f in sorted(log.parent.iterdir())]
    with pytest.raises(AssertionError, match="work was begun"):
        run(["fleet", str(log), "--jobs", "1", option, str(place)])
    assert [(f, f.lstat().st_mtime_ns) for f in sorted(log.parent.iterdir())] == state


@pytest.mark.parametrize("option", ["--json", "--parquet"])
def test_a_pipe_is_not_opened_for_nothing_and_no_table_takes_its_place(
    log, capsys, untouched, option
):
    """Opening one waits for a reader; one for JSON may have been made for that."""
    pipe = log.with_name("pipe")
    os.mkfifo(pipe)
    arguments = ["fleet", str(log), "--jobs", "1", option, str(pipe)]
    if option == "--json":
        with pytest.raises(AssertionError, match="work was begun"):
            run(arguments)
    else:
        assert run(arguments) == 2
        assert "is not a regular file" in refused(capsys)
    assert pipe.is_fifo()
