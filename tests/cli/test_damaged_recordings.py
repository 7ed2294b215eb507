"""A damaged recording is read as far as it goes, and every answer says what was skipped of it."""

from __future__ import annotations

import json
import random
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from onboard.answers.match_document import match_document
from onboard.cli.main import run
from onboard.cli.match import summary
from onboard.report.match import match_html
from tests.recordings.dataflash_writer import modern_log
from tests.recordings.telemetry_writer import px4_log, telemetry
from tests.report.html_page import Page
from tests.report.matches_by_hand import by_hand

NOISE = 3000
"""Bytes that are put into the middle of a recording."""
TORN = 25
"""Bytes that are missing at its end."""
LOGS = {
    "a.BIN": lambda: bytes(modern_log(6)),
    "a.tlog": lambda: bytes(telemetry(6)),
    "a.ulg": lambda: px4_log(6),
}


def spoilt(data: bytes) -> bytes:
    """With bytes in the middle that are no record of any kind, and without its end."""
    noise, middle = random.Random(5).randbytes(NOISE), len(data) // 2
    return data[:middle] + noise + data[middle:-TORN]


@pytest.fixture(params=LOGS)
def log(request, tmp_path) -> Path:
    path = tmp_path / request.param
    path.write_bytes(spoilt(LOGS[request.param]()))
    return path


def skipped(sentences: list[str]) -> int:
    """Bytes that some sentences say were skipped."""
    return sum(int(n) for said in sentences for n in re.findall(r"(\d+) bytes? skipped", said))


@pytest.mark.parametrize("verb", ["replay", "explain"])
def test_terminal_document_and_page_say_what_was_skipped(log, tmp_path, capsys, verb):
    page, file = tmp_path / "p.html", tmp_path / "d.json"
    assert run([verb, str(log), "--report", str(page), "--json", str(file)]) == 0
    out = " ".join(capsys.readouterr().out.split())
    told = json.loads(file.read_text())["recording"]["damage"]
    assert skipped(told) >= NOISE
    words = Page.of(page.read_text()).words
    for sentence in told:
        name, _, note = sentence.partition(": ")
        assert name == log.name
        assert note in out
        assert f"Damage: {sentence}" in words


def test_the_answer_comes_before_what_was_skipped(log, capsys):
    assert run(["explain", str(log)]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert lines[0].startswith(log.name)
    first = next(i for i, line in enumerate(lines) if line.startswith("damage:"))
    assert any(line.startswith(("To do", "To fly")) for line in lines[:first])


@pytest.mark.parametrize("verb", ["replay", "explain"])
def test_of_a_whole_recording_nothing_is_said(tmp_path, capsys, verb):
    log, page, file = tmp_path / "a.BIN", tmp_path / "p.html", tmp_path / "d.json"
    log.write_bytes(LOGS["a.BIN"]())
    assert run([verb, str(log), "--report", str(page), "--json", str(file)]) == 0
    assert json.loads(file.read_text())["recording"]["damage"] == []
    assert "damage" not in capsys.readouterr().out
    assert "Damage:" not in Page.of(page.read_text()).words


def test_a_fleet_says_it_of_the_row_that_it_belongs_to(tmp_path, capsys):
    logs, pages, file = tmp_path / "logs", tmp_path / "pages", tmp_path / "d.json"
    logs.mkdir()
    (logs / "hurt.BIN").write_bytes(spoilt(LOGS["a.BIN"]()))
    (logs / "whole.tlog").write_bytes(LOGS["a.tlog"]())
    options = ("--jobs", "1", "--report", str(pages), "--json", str(file))
    assert run(["fleet", str(logs), *options]) == 0
    out = " ".join(capsys.readouterr().out.split())
    entries = json.loads(file.read_text())["recordings"]
    told = {Path(e["file"]).name: e["replay"]["recording"]["damage"] for e in entries}
    assert told["whole.tlog"] == []
    assert skipped(told["hurt.BIN"]) >= NOISE
    index = (pages / "index.html").read_text()
    rows = dict(re.findall(r'<li><a href="\./([\w.]+)\.html">(.*?)</li>', index, re.DOTALL))
    assert "Damage:" not in rows["whole.tlog"]
    for sentence in told["hurt.BIN"]:
        note = sentence.removeprefix("hurt.BIN: ")
        assert f"Damage: {note}" in rows["hurt.BIN"]
        assert note in out


def test_a_match_says_it_of_both_recordings():
    told = [f"{name}: 1 damaged place, 3000 bytes skipped" for name in ("sim.BIN", "real.BIN")]
    both = [SimpleNamespace(name=n[:7], source=SimpleNamespace(damage=[n])) for n in told]
    made = replace(by_hand(), simulation=both[0], real=both[1])
    assert json.loads(match_document(made).to_json())["recordings"]["damage"] == told
    words, lines = Page.of(match_html(made)).words, [str(part) for part in summary(made)]
    for sentence in told:
        assert f"Damage: {sentence}" in words
        assert f"damage: {sentence}" in lines


def test_a_match_that_says_nothing_says_what_was_skipped(log, capsys):
    assert run(["match", str(log)]) == 2
    assert skipped([capsys.readouterr().err]) >= NOISE


@pytest.mark.parametrize("name", LOGS)
def test_a_recording_of_which_nothing_is_left_says_how_much_was_skipped(tmp_path, capsys, name):
    log = tmp_path / name
    log.write_bytes(LOGS[name]()[:100] + random.Random(5).randbytes(NOISE))
    assert run(["replay", str(log)]) == 2
    assert skipped([capsys.readouterr().err]) >= NOISE - 100
