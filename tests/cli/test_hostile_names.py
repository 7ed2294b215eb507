"""Files may be called anything, and folders may hold anything: names are shown, never obeyed."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from urllib.parse import unquote

import pytest

from onboard.cli.main import run
from onboard.printable import encodable, printable
from tests.recordings.dataflash_writer import modern_log

NO_TEXT = b"\xff\xfe.BIN"
ORDERS = b"\x1b]0;mine\x07\x1b[31m\n# x\nINS_ACC_ID,1\n.BIN"
SCRIPT = b"javascript:alert(1)<img src=x onerror=alert(2)>.BIN"
ADDRESS = b"50%#2?.BIN"
LONG = b"\xc3\xa9" * 120 + b".BIN"
TURNED = "\u202eNIB.gol.BIN".encode()
NAMES = (NO_TEXT, ORDERS, SCRIPT, ADDRESS, LONG, TURNED)


@pytest.fixture
def folder(tmp_path) -> Path:
    """Recordings with such names, and what a hostile folder has beside them."""
    there = tmp_path / "logs"
    there.mkdir()
    content = bytes(modern_log(4))
    for name in NAMES:
        Path(os.fsdecode(os.fsencode(there) + b"/" + name)).write_bytes(content)
    (there / "loop").symlink_to(there, target_is_directory=True)
    (there / "nowhere.BIN").symlink_to(there / "absent")
    (there / "endless.BIN").symlink_to("/dev/zero")
    (there / "folder.BIN").mkdir()
    os.mkfifo(there / "pipe.BIN")
    (there / "broken\x1b[2J\xe9.tlog").write_bytes(b"no recording")
    return there


def shown(text):
    return [c for c in text if c != "\n" and printable(c) != c]


def test_a_fleet_of_hostile_names_is_replayed_and_none_is_obeyed(folder, tmp_path, capsys):
    pages, file = tmp_path / "pages", tmp_path / "fleet.json"
    arguments = ["fleet", str(folder), "--jobs", "1", "--report", str(pages), "--json", str(file)]
    assert run(arguments) == 2  # one is no recording
    out, err = capsys.readouterr()
    assert shown(out) == shown(err) == []
    assert "could not be handed over" not in out
    entries = json.loads(file.read_text(encoding="utf-8"))["recordings"]
    assert [e["error"] for e in entries].count(None) == len(NAMES), entries
    index = (pages / "index.html").read_text(encoding="utf-8")
    addresses = re.findall(r'<a href="([^"]+)"', index)
    assert len(set(addresses)) == len(NAMES)
    assert all(address.startswith("./") for address in addresses)
    assert all((pages / unquote(address)).is_file() for address in addresses)
    assert "<img src=x" not in index


@pytest.mark.parametrize("name", NAMES, ids=range(len(NAMES)))
def test_one_recording_is_answered_in_every_form(name, folder, tmp_path, capsys):
    recording = os.fsdecode(os.fsencode(folder) + b"/" + name)
    files = {end: tmp_path / f"answer.{end}" for end in ("json", "html", "param")}
    outputs = ["--json", files["json"], "--report", files["html"], "--param", files["param"]]
    assert run(["replay", recording, *map(str, outputs)]) == 0
    assert shown(capsys.readouterr().out) == []
    assert json.loads(files["json"].read_text())["recording"]["files"] == [encodable(recording)]
    assert "<img src=x" not in files["html"].read_text()
    settings = [line for line in files["param"].read_text().splitlines() if line[:1] != "#"]
    assert "INS_ACC_ID,1" not in settings


def test_an_error_about_such_a_file_is_one_line_without_orders(folder, capsys):
    assert run(["replay", str(folder / "broken\x1b[2J\xe9.tlog")]) == 2
    out, err = capsys.readouterr()
    assert shown(out + err) == []
    assert err.count("\n") == 1
