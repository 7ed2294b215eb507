"""What the commands say of themselves, for other readers: ``python deploy/commands.py``.

Makes ``docs/commands.md``, the man page and the completions of bash, zsh and fish, which the wheel
puts where their readers look (``deploy/share``).  Needs a checkout with onboard installed.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import click
from click import shell_completion

from onboard.cli.main import COMPLETION, EPILOG, cli

ROOT = Path(__file__).resolve().parents[1]
SHARE = Path("deploy/share")
COMPLETIONS = {
    "bash": SHARE / "bash-completion/completions/onboard",
    "zsh": SHARE / "zsh/site-functions/_onboard",
    "fish": SHARE / "fish/vendor_completions.d/onboard.fish",
}
MAN = SHARE / "man/man1/onboard.1"
MANUAL = Path("docs/commands.md")


@dataclass(frozen=True, slots=True)
class Told:
    """One command: its words, with paragraphs apart."""

    name: str
    usage: str
    paragraphs: tuple[str, ...]
    options: tuple[tuple[str, str], ...]
    examples: tuple[str, ...]


def every() -> list[Told]:
    """The commands, in the order of the help."""
    with click.Context(cli, info_name="onboard") as context:
        return list(_below(context))


def _below(context: click.Context) -> Iterator[Told]:
    command = context.command
    if context.parent is not None:
        yield _told(context)
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            assert found is not None  # noqa: S101 - it has just said so
            with click.Context(found, info_name=name, parent=context) as below:
                yield from _below(below)


def _told(context: click.Context) -> Told:
    command = context.command
    records = (p.get_help_record(context) for p in command.get_params(context))
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    return Told(
        name=context.command_path,
        usage=usage,
        paragraphs=tuple(_paragraphs(command.help or "")),
        options=tuple(
            (_line(r[0]), _line(r[1])) for r in records if r is not None and "--help" not in r[0]
        ),
        examples=tuple((command.epilog or "").replace("\b", "").strip().splitlines()),
    )


def _paragraphs(text: str) -> list[str]:
    clean = inspect.cleandoc(text.split("\f", maxsplit=1)[0].replace("\b\n", ""))
    return [_line(paragraph) for paragraph in clean.split("\n\n") if paragraph.strip()]


def _line(text: str) -> str:
    return " ".join(text.split())


def manual() -> str:
    """The page of the manual."""
    parts = ["# Commands", *_paragraphs(cli.help or ""), *_epilog()]
    for told in every():
        parts += [
            f"## {told.name}",
            f"```text\n{told.usage}\n```",
            *map(_markdown, told.paragraphs),
        ]
        if told.options:
            rows = (f"| `{_cell(option)}` | {_markdown(words)} |" for option, words in told.options)
            parts.append("\n".join(("| option | |", "|---|---|", *rows)))
        if told.examples:
            parts.append("\n".join(("```sh", *told.examples, "```")))
    return "\n\n".join(parts) + "\n"


def _epilog() -> list[str]:
    """The last paragraph of the help, which is what programs rely on."""
    return [_paragraphs(EPILOG)[-1]]


def _markdown(text: str) -> str:
    return re.sub(r"([*_<>|\[\]])", r"\\\1", text)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def man_page() -> str:
    """The page of section 1."""
    out = [
        '.\\" Made by deploy/commands.py',
        '.TH ONBOARD 1 "" onboard "User Commands"',
        ".SH NAME",
        "onboard \\- in-flight calibration of the accelerometers of MAVLink autopilots",
        ".SH SYNOPSIS",
        ".B onboard",
        "COMMAND [OPTIONS] [ARGUMENTS]",
        ".SH DESCRIPTION",
        *_roff_paragraphs(tuple(_paragraphs(cli.help or ""))),
        ".SH COMMANDS",
    ]
    for told in every():
        out += [f".SS {_roff(told.usage)}", *_roff_paragraphs(told.paragraphs)]
        for option, words in told.options:
            out += [".TP", f".B {_roff(option)}", _roff(words)]
        if told.examples:
            out += [
                ".PP",
                "Examples:",
                ".PP",
                ".nf",
                ".RS",
                *map(_roff, told.examples),
                ".RE",
                ".fi",
            ]
    out += [".SH EXIT STATUS", *_roff_paragraphs(tuple(_epilog())), ".SH FILES"]
    for file, words in (
        ("/etc/onboard/onboard.toml", "The service's configuration, with every setting."),
        ("/var/lib/onboard", "What the service has learned, and its journal."),
    ):
        out += [".TP", f".I {file}", _roff(words)]
    return "\n".join(out) + "\n"


def _roff_paragraphs(paragraphs: tuple[str, ...]) -> list[str]:
    return [line for text in paragraphs for line in (".PP", _roff(text))]


def _roff(text: str) -> str:
    escaped = text.replace("\\", "\\e").replace("-", "\\-")
    return f"\\&{escaped}" if escaped.startswith((".", "'")) else escaped


def completion(shell: str) -> str:
    """The script that asks onboard itself, whenever somebody completes."""
    kind = shell_completion.get_completion_class(shell)
    assert kind is not None  # noqa: S101 - three that click has
    asked = kind(cli, {}, "onboard", COMPLETION)
    # Not source(): that runs a bash to see which one it is.
    return f"{(kind.source_template % asked.source_vars()).strip()}\n"


def made() -> dict[Path, str]:
    """Every file and its text, by its path in the project."""
    scripts = {path: completion(shell) for shell, path in COMPLETIONS.items()}
    return {MANUAL: manual(), MAN: man_page(), **scripts}


def main() -> None:
    """Write them."""
    for path, text in made().items():
        (ROOT / path).parent.mkdir(parents=True, exist_ok=True)
        (ROOT / path).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
