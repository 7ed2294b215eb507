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
