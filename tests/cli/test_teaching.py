"""What the command line teaches: help with examples, completion, progress for terminals only."""

from __future__ import annotations

import os
import pty
import select
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest

from onboard.cli import main
from onboard.cli.main import run
from tests.recordings.dataflash_writer import modern_log

ROOT = Path(__file__).resolve().parents[2]


def example_lines(verb: str) -> list[str]:
    command = main.cli.get_command(click.Context(main.cli), verb)
    assert command is not None
    text = (command.epilog or "").replace("\b", "")
    return [line.strip() for line in text.splitlines() if line.strip()]


@pytest.mark.parametrize("verb", main.VERBS)
def test_every_verb_has_examples_that_its_own_options_accept(verb, capsys):
    lines = example_lines(verb)
    assert lines
    for line in lines:
        command = line.split(" | ")[0]
        words = shlex.split(command, comments=True)
        program, name, *arguments = words[words[0] == "sudo" :]
        assert (Path(program).name, name) == ("onboard", verb)
        # Parsing alone: nothing is read, connected or written.
        made = main.cli.get_command(click.Context(main.cli), verb)
        assert made is not None
        with click.Context(made, info_name=verb) as context:
            made.parse_args(context, arguments)


@pytest.mark.parametrize("verb", ["", *main.VERBS])
def test_help_fits_eighty_columns_and_shows_each_example_on_its_line(verb, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert run([verb, "--help"] if verb else ["--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    if verb:
        assert set(example_lines(verb)) <= {line.strip() for line in lines}


FLEET_OPTIONS = {
    "--json", "--parquet", "--report", "--imu", "--by-folder", "--jobs", "--store", "--scheduler",
    "--batch", "--help",
}  # fmt: skip


def complete(words: str, index: int, shell: str = "bash") -> list[str]:
    environment = {
        **os.environ,
        "_ONBOARD_COMPLETE": f"{shell}_complete",
        "COMP_WORDS": words,
        "COMP_CWORD": str(index),
    }
    done = subprocess.run(
        [sys.executable, "-m", "onboard"],
        env=environment,
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    return [line.split(",")[-1] for line in done.stdout.splitlines()]


@pytest.mark.parametrize(
    ("words", "index", "offered"),
    [
        ("onboard re", 1, {"replay", "reject", "reset"}),
        ("onboard run --po", 2, {"--policy"}),
        ("onboard run --policy l", 3, {"landed"}),
        ("onboard fleet --", 2, FLEET_OPTIONS),
    ],
)
def test_completion_offers_verbs_options_and_choices(words, index, offered):
    assert set(complete(words, index)) == offered


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_gets_its_script(shell):
    environment = {**os.environ, "_ONBOARD_COMPLETE": f"{shell}_source"}
    done = subprocess.run(
        [sys.executable, "-m", "onboard"],
        env=environment,
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "_ONBOARD_COMPLETE" in done.stdout


def on_terminal(*arguments: str) -> tuple[str, str]:
    """Standard output and what a terminal on standard error was shown."""
    master, slave = pty.openpty()
    process = subprocess.Popen(  # noqa: S603 - our own program
        [sys.executable, "-m", "onboard", *arguments],
        stdout=subprocess.PIPE,
        stderr=slave,
        cwd=ROOT,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "80"},
    )
    os.close(slave)
    shown = b""
    while True:
        ready, _, _ = select.select([master], [], [], 60.0)
        try:
            part = os.read(master, 65536) if ready else b""
        except OSError:  # the other end is closed
            break
        if not part:
            break
        shown += part
    out, _ = process.communicate(timeout=60)
    os.close(master)
    assert process.returncode == 0
    return out.decode(), shown.decode()


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["replay", "explain", "fleet"])
def test_progress_is_for_terminals_and_never_in_the_output(tmp_path, verb):
    log = tmp_path / "short.BIN"
    log.write_bytes(bytes(modern_log(4)))
    out, shown = on_terminal(verb, str(log), "--json", "-")
    assert "reading" in shown
    assert "reading" not in out
    assert out.startswith("{")
