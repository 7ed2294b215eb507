"""The manuals hold: links lead somewhere, commands parse, settings are those of the code."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path

import click
import pytest

from onboard.cli import main
from onboard.core.inputs.parameters import receiver_names
from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.pushing import parameters
from onboard.daemon.setup import configuration, settings
from onboard.push.policy import ALLOWED

ROOT = Path(__file__).resolve().parents[2]
MANUALS = sorted([ROOT / "README.md", ROOT / "systemd/README.md", *(ROOT / "docs").glob("*.md")])
PARAMETERS = (ROOT / "docs" / "parameters.md").read_text(encoding="utf-8")


def named(path: Path) -> str:
    return str(path.relative_to(ROOT))


def anchors(path: Path) -> set[str]:
    """As forges make them of headings."""
    titles = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    words = (re.sub(r"[^\w\- ]", "", title.lower()) for title in titles)
    return {word.replace(" ", "-") for word in words}


@pytest.mark.parametrize("manual", MANUALS, ids=named)
def test_every_link_leads_somewhere(manual):
    for target in re.findall(r"\]\(([^)\s]+)\)", manual.read_text(encoding="utf-8")):
        if re.match(r"https?:", target):
            pytest.fail(f"{target}: the manuals need no network")
        file, _, anchor = target.partition("#")
        there = (manual.parent / file).resolve() if file else manual
        assert there.exists(), target
        assert not anchor or anchor in anchors(there), target


def commands(manual: Path) -> list[str]:
    text = manual.read_text(encoding="utf-8")
    blocks = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    lines = [line.strip() for block in blocks for line in block.splitlines()]
    lines += re.findall(r"`(onboard [^`]+)`", text)
    starts = r"^(?:sudo )?(?:[\w./]*/)?onboard "
    return [re.sub(starts, "onboard ", line) for line in lines if re.match(starts, line)]


EVERY = [(manual, line) for manual in MANUALS for line in commands(manual)]


@pytest.mark.parametrize(("manual", "line"), EVERY, ids=[f"{m.stem}: {c}" for m, c in EVERY])
def test_every_command_is_one_that_the_program_understands(manual, line):
    words = shlex.split(re.split(r" \||`", line)[0], comments=True)[1:]
    if "/" in words:  # a list of verbs, as in a table
        words = [word for word in words if word in main.VERBS][:1]
    if words[0].startswith("-"):
        assert words in (["--help"], ["--version"])
        return
    command = main.cli.get_command(click.Context(main.cli), words[0])
    assert command is not None, words
    given = words[1:]
    # In running text a command may stand without what it is about.
    if any(p.required and p.param_type_name == "argument" for p in command.params):
        given = [*given, "flight.BIN", "other.BIN"]
    with click.Context(command, info_name=words[0]) as context:
        command.parse_args(context, [g for g in given if g not in {"...", "LOG..."}])


def test_every_configuration_in_the_manuals_is_valid():
    found = 0
    for manual in MANUALS:
        for block in re.findall(
            r"```toml\n(.*?)```", manual.read_text(encoding="utf-8"), re.DOTALL
        ):
            lines = "\n".join(line.strip() for line in block.splitlines())
            chosen = configuration.from_mapping(tomllib.loads(lines), source=named(manual))
            settings.endpoints(chosen.link)
            found += 1
    assert found >= 5


def test_the_parameters_that_are_written_are_exactly_those_allowed():
    section = PARAMETERS.split("## What is read")[0]
    told = set(re.findall(r"`(INS\w+_[XYZ])`", section))
    assert told == set(ALLOWED)
    for imu, names in re.findall(r"^\| (\d) \| (.+) \|$", section, re.MULTILINE):
        assert re.findall(r"`(\w+)`", names) == list(parameter_names(int(imu)).six)


def test_limits_and_defaults_are_those_of_the_configuration():
    rows = re.findall(r"^\| .+ \| ([\d.]+) \| `\[push\] (\w+)` \|$", PARAMETERS, re.MULTILINE)
    assert len(rows) == 8
    for value, key in rows:
        assert getattr(configuration.PushSettings(), key) == float(value), key


def test_what_is_read_is_named():
    section = PARAMETERS.split("## What is read")[1].split("## ")[0]
    told = [
        re.escape(n).replace(r"\*", r"\w+").replace("n", r"\d")
        for n in re.findall(r"`([A-Z][\w*]+)`", section)
    ]
    # Not the name of the first gyroscope, nor those that receivers had before.
    once = {"INS_GYR_ID", *(n for k in (1, 2) for _, n in receiver_names(k).values())}
    for name in {*parameters.MEANING, *parameters.KNOWLEDGE} - once:
        assert any(re.fullmatch(pattern, name) for pattern in told), name
