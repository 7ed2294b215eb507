"""onboard fleet: every recording gets its line, whatever the others are like."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from onboard.answers.fleet.places import found
from onboard.cli.fleet_results import pages_of
from onboard.cli.main import run
from onboard.errors import UsageError
from tests.recordings.dataflash_writer import modern_log
from tests.recordings.telemetry_writer import px4_log, telemetry

ONE = ("--jobs", "1")
"""Process: each costs a second to begin."""


@pytest.fixture
def fleet(tmp_path) -> Path:
    """Two vehicles' folders with three kinds of recordings, junk among them."""
    folder = tmp_path / "fleet"
    (folder / "one").mkdir(parents=True)
    (folder / "two with a rather long name of its own").mkdir()
    (folder / "one" / "a.BIN").write_bytes(bytes(modern_log(4)))
    (folder / "one" / "b.tlog").write_bytes(bytes(telemetry(5)))
    (folder / "two with a rather long name of its own" / "c.ulg").write_bytes(px4_log(5))
    (folder / "notes.txt").write_text("no recording")
    return folder


def lengthen(fleet: Path) -> None:
    """Long enough for something to be learned of it, which takes a second."""
    (fleet / "one" / "a.BIN").write_bytes(bytes(modern_log(20)))


def spoil(fleet: Path) -> None:
    (fleet / "one" / "bad.bin").write_bytes(b"\x00\x07" * 4000)


@pytest.mark.slow
def test_a_line_for_each_accelerometer_of_each_recording(fleet, capsys):
    lengthen(fleet)
    assert run(["fleet", str(fleet), *ONE]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    head, *lines = out.splitlines()
    assert head.split()[:3] == ["recording", "imu", "state"]
    assert max(map(len, out.splitlines())) <= 80
    assert [line.split()[0] for line in lines if line[0] != " "][:2] == ["one/a.BIN", "one/b.tlog"]
    assert any("of its own/c.ulg" in line for line in lines)
    assert "notes" not in out


def test_a_bad_one_is_told_of_and_the_rest_is_done(fleet, capsys):
    run(["fleet", str(fleet), *ONE])
    good = capsys.readouterr().out.splitlines()
    spoil(fleet)
    assert run(["fleet", str(fleet), *ONE]) == 2
    out, err = capsys.readouterr()
    assert err == "onboard: 1 of 4 recordings could not be read\n"
    assert set(good) <= set(out.splitlines())
    assert "one/bad.bin" in out
    assert "not a .tlog" in out


def test_json_has_a_replay_or_an_error_for_each(fleet, capsys):
    spoil(fleet)
    assert run(["fleet", str(fleet), "--json", "-", *ONE]) == 2
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "onboard.fleet/1"
    assert (document["read"], document["failed"]) == (3, 1)
    for entry in document["recordings"]:
        assert (entry["error"] is None) != (entry["replay"] is None)
        if entry["replay"] is not None:
            assert entry["replay"]["schema"] == "onboard.replay/1"
            assert entry["replay"]["recording"]["files"] == [entry["file"]]


@pytest.mark.slow
def test_each_recording_can_have_a_page(fleet, tmp_path, capsys):
    lengthen(fleet)
    assert (
        run(["fleet", str(fleet / "one"), "--report", str(tmp_path / "new" / "pages"), *ONE]) == 0
    )
    pages = sorted(p.name for p in (tmp_path / "new" / "pages").iterdir())
    assert pages == ["a.BIN.html", "b.tlog.html", "index.html"]
    index = (tmp_path / "new" / "pages" / "index.html").read_text(encoding="utf-8")
    assert 'href="./a.BIN.html"' in index
    assert "http" not in index


@pytest.mark.slow
def test_neither_processes_nor_the_store_change_a_digit(fleet, tmp_path, capsys):
    lengthen(fleet)
    spoil(fleet)
    store = ["--store", str(tmp_path / "store")]

    def document(*more):
        assert run(["fleet", str(fleet), "--json", str(tmp_path / "out.json"), *more]) == 2
        return (tmp_path / "out.json").read_bytes(), capsys.readouterr().out

    first, _ = document("--jobs", "1", *store)
    again, _ = document("--jobs", "2")
    assert again == first
    kept = sorted((tmp_path / "store").rglob("*.record"))
    assert len(kept) == 3
    kept[0].write_bytes(kept[0].read_bytes()[:-1])
    times = [file.stat().st_mtime_ns for file in kept]
    again, told = document("--jobs", "2", *store)
    assert again == first
    assert "torn" in " ".join(told.split())
    assert [file.stat().st_mtime_ns == t for file, t in zip(kept, times, strict=True)] == [
        False, True, True,
    ]  # fmt: skip
    moved = fleet.rename(tmp_path / "elsewhere")
    assert run(["fleet", str(moved), "--json", "-", *store]) == 2
    recordings = json.loads(capsys.readouterr().out)["recordings"]
    assert all(str(moved) in r["file"] for r in recordings)
    assert all(r["replay"]["recording"]["files"] == [r["file"]] for r in recordings if r["replay"])


def test_a_result_that_is_lost_does_not_cost_the_others(fleet, tmp_path, capsys, monkeypatch):
    """The disk that is full, the table that cannot be made: after hours, the rest is there."""
    spoil(fleet)

    def full(*_):
        raise UsageError("fleet.parquet: cannot be written (No space left on device)")

    monkeypatch.setattr("onboard.batches.table.write_parquet", full)
    monkeypatch.setattr("onboard.batches.table.imported", lambda: None)
    pages, file = tmp_path / "pages", tmp_path / "fleet.json"
    (pages / "one-a.BIN.html").mkdir(parents=True)
    results = ["--parquet", str(tmp_path / "x"), "--json", str(file), "--report", str(pages)]
    assert run(["fleet", str(fleet), *results, *ONE]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "a.BIN.html: cannot be written" in err
    assert "No space left" in err
    assert "1 of 4 recordings could not be read" in err
    assert json.loads(file.read_bytes())["read"] == 3
    index = (pages / "index.html").read_text(encoding="utf-8")
    assert "b.tlog.html" in index
    assert "a.BIN.html" not in index


def test_a_file_may_be_named_and_comes_once(fleet, capsys):
    file = fleet / "one" / "a.BIN"
    assert run(["fleet", str(file), str(file.parent), "--json", "-", *ONE]) == 0
    files = [r["file"] for r in json.loads(capsys.readouterr().out)["recordings"]]
    assert files == [str(file), str(file.with_name("b.tlog"))]


def test_names_tell_recordings_apart_and_so_do_their_pages(tmp_path):
    for name in ("x/kite", "y/kite", "z"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "1.BIN").write_bytes(b"")
    names = [name for _, name in found([tmp_path / "x" / "kite", tmp_path / "z"])]
    assert names == ["kite/1.BIN", "z/1.BIN"]
    names = [name for _, name in found([tmp_path / n for n in ("x/kite", "y/kite", "z")])]
    assert len(set(names)) == 3
    assert names[2] == "z/1.BIN"
    pages = pages_of(["a/b.BIN", "a-b.BIN", "index"])
    assert len(set(pages.values())) == 3
    assert "index.html" not in pages.values()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["{tmp}/absent"], "no such folder"),
        (["{tmp}/empty"], "no recording"),
        ([], "DIR"),
        (["{fleet}", "--report", "{fleet}/notes.txt"], "cannot be made"),
        (["{fleet}", "--store", "{fleet}/notes.txt"], "cannot be written"),
        (["{fleet}", "--jobs", "0"], "--jobs"),
        (["{fleet}", "--json", "{tmp}/empty"], "cannot be written"),
    ],
)
def test_bad_input_is_one_line_and_status_2(fleet, tmp_path, capsys, arguments, said):
    (tmp_path / "empty").mkdir()
    assert run(["fleet", *(a.format(tmp=tmp_path, fleet=fleet) for a in arguments)]) == 2
    err = capsys.readouterr().err
    assert err.startswith("onboard: ")
    assert err.count("\n") == 1
    assert said in err
