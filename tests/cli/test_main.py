from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import click
import pytest

from onboard import __version__
from onboard.cli import main
from onboard.cli.main import Verb, run
from onboard.errors import LinkError, UsageError

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def verb(monkeypatch):
    """Registers a verb that raises what it is given, or prints."""

    def register(action: object) -> None:
        @click.command()
        @click.option("--number", type=int)
        def act(number: int | None) -> None:
            if isinstance(action, BaseException):
                raise action
            click.echo(action)

        monkeypatch.setattr(sys.modules[__name__], "act", act, raising=False)
        monkeypatch.setitem(main.VERBS, "act", Verb(__name__, "act", "Acts."))

    return register


def test_version_and_help(capsys):
    assert run(["--version"]) == 0
    assert __version__ in capsys.readouterr().out
    assert run(["--help"]) == 0
    text = capsys.readouterr().out
    assert "Exit status" in text
    for name in main.VERBS:
        if main.cli.get_command(click.Context(main.cli), name) is not None:
            assert f"\n  {name} " in text


def test_without_a_verb_the_help_and_status_2(capsys):
    assert run([]) == 2
    assert "Exit status" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nonsense"], "nonsense"),
        (["--nonsense"], "--nonsense"),
        (["act", "--nonsense"], "--nonsense"),
        (["act", "--number", "one"], "one"),
    ],
)
def test_wrong_usage_is_one_line_and_status_2(verb, capsys, arguments, said):
    verb("done")
    assert run(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("onboard: ")
    assert said in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("error", "status", "line"),
    [
        (UsageError("x.toml: no\nsuch key"), 2, "onboard: x.toml: no such key\n"),
        (LinkError("udp:14550: no heartbeat"), 3, "onboard: udp:14550: no heartbeat\n"),
        (KeyboardInterrupt(), 130, "onboard: interrupted\n"),
        (click.ClickException("bad thing"), 2, "onboard: bad thing\n"),
    ],
)
def test_failures_become_one_line_and_a_status(verb, capsys, error, status, line):
    verb(error)
    assert run(["act"]) == status
    assert capsys.readouterr() == ("", line)


def test_success_is_0(verb, capsys):
    verb("done")
    assert run(["act"]) == 0
    assert capsys.readouterr().out == "done\n"


def test_a_bug_is_not_hidden(verb):
    verb(ZeroDivisionError())
    with pytest.raises(ZeroDivisionError):
        run(["act"])


def test_a_closed_pipe_is_no_failure():
    code = (
        "import os, sys, click; from onboard.cli import main\n"
        "@click.command()\n"
        "def act():\n"
        "    for _ in range(100000): click.echo('line of text')\n"
        "sys.modules['verb'] = sys.modules['__main__']\n"
        "main.VERBS['act'] = main.Verb('click', 'act', '')\n"
        "click.act = act\n"
        "sys.argv[1:] = ['act']; main.main()\n"
    )
    process = subprocess.Popen(  # noqa: S603 - our own interpreter
        [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b"line of text\n"
    process.stdout.close()
    assert process.stderr is not None
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait() == 0


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from onboard.cli.main import run; run(['--help']);"
        "print(sorted({'numpy', 'rich', 'pymavlink', 'aiohttp'} & set(sys.modules)))"
    )
    done = subprocess.run(  # noqa: S603 - our own interpreter
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"
